"""Checks of a scene that concern several of its parts; all of them before DOLFINx is imported."""

from collections import Counter
from collections.abc import Iterator
from itertools import combinations
from typing import Any

import numpy as np

from shellmb.errors import SceneError
from shellmb.scene.checks import ignored_settings as checks_effect
from shellmb.scene.checks import multibody as checks_multibody
from shellmb.scene.checks import schemes as checks_schemes
from shellmb.scene.checks.fields import check_fields, check_reserves
from shellmb.scene.checks.locations import ANY, EDGES, FIELDS, check_place
from shellmb.scene.checks.potentials import check_potentials
from shellmb.scene.checks.signals import check_signals
from shellmb.scene.description import Description
from shellmb.scene.loads.loads import EdgeLoad, PointLoad
from shellmb.scene.loads.supports import Fixed, HardSupport, Support, at_rest
from shellmb.scene.multibody.joints import GROUND
from shellmb.scene.probes import Probe
from shellmb.scene.shells.sections import LinearSection
from shellmb.scene.shells.shell import Join
from shellmb.scene.values.bodies import SceneBody
from shellmb.scene.values.user_functions import finite_in_time, values_at
from shellmb.scene.values.validate import as_names, error_of, kind_of, said, show

# parts of a scene whose names differ within each of them, and others with names
RECORDED = ("probes", "reserves", "controllers")
NAMED = ("bodies", "joints", "drivers", "force_elements", "couplings", *RECORDED)
ALSO_NAMED = ("potentials", "contacts", "volumes", "events")
# what the name of a place may be of: what is along an edge, as HardSupport and loads are, has no
# meaning on an area
NAMES: dict[Any, tuple[str, ...]] = {
    Fixed: ANY,
    HardSupport: EDGES,
    Support: FIELDS,
    EdgeLoad: EDGES,
    PointLoad | Probe: ("point",),
}
# what separates folders, columns and texts
SEPARATORS = "/\\,;\"'"
# file systems take 255 bytes, endings included
LONGEST = 200
# files of all rigid bodies, of their shapes, of all joints, and of all obstacles
RESERVED = ("rigid_bodies", "solids", "joints", "obstacles")
# columns that every history has
COLUMNS = ("step", "t", "dt", "iterations", "rejected", "jump", "wall_s")


def check(scene: Description) -> None:
    """Check the whole scene.

    Raises:
        SceneError: At the first thing that is impossible.
    """
    _names(scene)
    checks_schemes.check_scheme(scene)
    _relaxation(scene)
    _targets(scene)
    _time_functions(scene)
    _functions_of_position(scene)
    checks_multibody.check(scene)
    check_potentials(scene)
    check_reduced(scene)
    checks_effect.check(scene)
    checks_schemes.check_linear(scene)
    check_signals(scene)
    checks_schemes.check_path(scene)
    check_fields(scene)
    check_reserves(scene)


def check_names(scene: Description) -> None:
    """Refuse names that cannot be those of files and columns.

    Raises:
        SceneError: At the first.
    """
    several = (getattr(scene, what) for what in (*NAMED, *ALSO_NAMED))
    named: list[Any] = [item for items in several for item in items]
    for item in (scene, *named):
        wrong = _wrong(item.name)
        if wrong:
            raise SceneError(
                f"{item.label}: name is {item.name[:60]!r}, {wrong}; it must be possible as the "
                "name of a file and of a column: letters, digits, spaces, and signs such as "
                "_ - + . ( )"
            )
    files: dict[str, str] = {}
    for body in scene.meshed:
        stem = body.name.replace(" ", "_")
        if stem in RESERVED or stem in files:
            other = f"that of '{files[stem]}'" if stem in files else "that of all of them"
            raise error_of(
                body, f"its files would be called '{stem}', as {other}; it must have another name"
            )
        files[stem] = body.name
    columns: tuple[Any, ...] = (*scene.probes, *scene.reserves)
    for item in columns:
        if item.name in COLUMNS:
            raise SceneError(
                f"{said(item)}: every history has a column '{item.name}'; it must have another name"
            )


def _wrong(name: str) -> str:
    """Say what is wrong with a name, if anything is."""
    separators = [sign for sign in SEPARATORS if sign in name]
    if separators:
        return f"with {separators[0]} in it"
    if not name.isprintable():
        return "with a sign in it that cannot be printed"
    if name != name.strip():
        return "with a space at its end" if name.strip() else "of spaces only"
    if name.startswith("."):
        return "with a dot at its beginning"
    length = len(name.encode())
    return f"of {length} bytes (at most {LONGEST})" if length > LONGEST else ""


def _names(scene: Description) -> None:
    if not scene.bodies:
        raise error_of(scene, "it has no bodies; it must have a shell, a beam or a rigid body")
    for body in scene.bodies:
        if body.name == GROUND:
            raise SceneError(
                f"scene '{scene.name}': a {kind_of(body)} is named '{GROUND}'; it must have "
                "another name, because this one is reserved"
            )
    for what in ("shells", *NAMED):
        for name, count in Counter(item.name for item in getattr(scene, what)).items():
            if count > 1:
                raise SceneError(
                    f"scene '{scene.name}': {count} {what.replace('_', ' ')} are named '{name}'; "
                    "each must have a name of its own"
                )
    check_names(scene)


_FROM_EQUILIBRIUM = (
    "its Prony series has relaxed=False, and the scene starts in equilibrium, which is that of "
    "relaxed branches; relaxed must be True"
)


def _relaxation(scene: Description) -> None:
    """Refuse what bodies whose sections relax cannot have."""
    for body in scene.meshed:
        if not body.section.relaxes or body.model == "rigid":
            continue
        who, relaxed = said(body), body.section.relaxed
        if body.modes:
            raise SceneError(
                f"{who}: its section relaxes, and its model is {show(body.model)}; modes do not "
                "relax: the model must be 'exact' or 'floating-frame'"
            )
        if getattr(body.section, "functions", None) and any(body.section.damping_times):
            raise SceneError(
                f"{who}: its section varies, relaxes, and has stiffness_damping; where it relaxes "
                "and varies, stiffness_damping must be 0"
            )
        if not relaxed and "equilibrium" in scene.starts:
            raise SceneError(f"{who}: {_FROM_EQUILIBRIUM}")
        natural = body.natural
        if natural is not None and not (scene.static or (relaxed and natural.time is None)):
            raise SceneError(
                f"{who}: its section relaxes, and its branches do not follow a natural strain; in "
                "motion natural must be left out, or be constant in time, with relaxed=True"
            )
    relaxing = {b.name for b in scene.meshed if b.section.relaxes and b.model != "rigid"}
    for element in scene.force_elements:
        series, who = element.relaxation, said(element)
        if series is None:
            continue
        if element.name in relaxing:
            raise SceneError(
                f"{who}: a body that relaxes has this name, too, and columns as "
                f"'{element.name}.relaxation.loss' are by names; it must have another name"
            )
        if not series.relaxed and "equilibrium" in scene.starts:
            raise SceneError(f"{who}: {_FROM_EQUILIBRIUM}")


def _targets(scene: Description) -> None:
    """Names of bodies, edges and points."""
    items: tuple[Any, ...] = (*scene.supports, *scene.loads, *scene.initial, *scene.probes)
    for item in items:
        who = said(item)
        for body in scene.bodies_of(item):
            offset = getattr(item, "offset", None)
            if not body.directors and np.any(offset):
                raise SceneError(
                    f"{who}: offset is {show(offset)}; it must be 0 on {said(body)}, whose nodes "
                    "have no directors for an arm"
                )
            kinds = next((some for kind, some in NAMES.items() if isinstance(item, kind)), None)
            if kinds is not None:
                # of several names each is that of an edge or an area
                check_place(body, item.at, who, kinds[:2] if isinstance(item.at, tuple) else kinds)
    for join in scene.joins:
        for name, edge in ((join.first, join.at), (join.second, join.second_at)):
            check_place(scene.shell(name, "join"), edge, "join", EDGES)
    for one, two in combinations(scene.joins, 2):
        if all(_edges_of(one, name) & _edges_of(two, name) for name in (one.first, one.second)):
            raise SceneError(
                f"scene '{scene.name}': two joins join the same edges of '{one.first}' and "
                f"'{one.second}', {show(one.at)} and {show(one.second_at)}; remove one of them"
            )


def _edges_of(join: Join, shell: str) -> set[str]:
    """Edges of a shell along which it is joined."""
    ends = ((join.first, join.at), (join.second, join.second_at))
    return {edge for name, at in ends if name == shell for edge in as_names(at)}


def _time_functions(scene: Description) -> None:
    """Every function of time gives finite numbers at the beginning, the middle and the end."""
    end = scene.given_until
    for load in scene.loads:
        finite_in_time(load.time, scene.t_end, f"{load.label}: time", 1)
    for body in scene.meshed:
        if body.natural is not None:
            who = f"natural strain of {said(body)}: time"
            finite_in_time(body.natural.time, scene.t_end, who, 1)
    for volume in scene.volumes:
        finite_in_time(volume.change, end, f"{said(volume)}: change", 1)
    for s in scene.supports:
        for name, value in s.given.items():
            what = "prescribed value" if isinstance(s, Fixed) else name
            size = 3 if name == "translation" else 1
            finite_in_time(value, end, f"{s.label}: {what}", size)


def _functions_of_position(scene: Description) -> None:
    """Loads, directions and sections that are, tried at a few points where the surface is known."""
    s = np.linspace(0.05, 0.95, 7)
    for load in scene.loads:
        for name in ("force", "p", "moment"):
            value = getattr(load, name, None)
            if not callable(value):
                continue
            (body,) = scene.bodies_of(load)
            x = body.some_positions(s)
            if x is not None:
                values_at(value, x, 1 if name == "p" else 3, f"{load.label}: {name}")
    for shell in scene.shells:
        x = shell.some_positions(s)
        if x is None:
            continue
        if callable(shell.direction):
            values_at(shell.direction, x, 3, f"shell '{shell.name}': direction")
        if isinstance(shell.section, LinearSection) and shell.section.functions:
            shell.section.at(x, f"shell '{shell.name}'")


def check_reduced(scene: Description) -> None:
    """Check what concerns bodies in modes.

    Raises:
        SceneError: At the first thing that they cannot have.
    """
    groups = list(groups_of(scene))
    if not groups:
        return
    _alike(scene)
    for group in groups:
        _slowed_alike(scene, group)
        for body in scene.meshed:
            if body.name in group and not body.mass_given > 0:
                raise SceneError(
                    f"{said(body)} is reduced to modes and has no mass, by which these are found, "
                    "in statics too; give its section a density"
                )
    modal = {name: group for group in groups for name in group}
    for support in scene.supports:
        for target in scene.bodies_of(support):
            if target.name in modal and not at_rest(support):
                raise SceneError(
                    f"{support.label}: {said(target)} is reduced to modes and would be moved; what "
                    "moves it must be a Driver of a joint, and supports must hold it where it is"
                )
    for joint in scene.joints:
        if joint.rolls and {joint.first, joint.second} & modal.keys():
            raise SceneError(
                f"{joint.said}: one of its bodies is reduced to modes; what rolls must be a rigid "
                "body or a beam with model='exact'"
            )


def _alike(scene: Description) -> None:
    """Check that shells with joined edges are reduced together, and glued beams with theirs."""
    named = {body.name: body for body in scene.meshed}
    pairs = [(join.first, join.second, "join") for join in scene.joins]
    pairs += [(glue.shell, glue.beam, "glue") for glue in scene.glues]
    for first, second, what in pairs:
        one, other = named[first], named[second]
        wrong = bool(one.modes) != bool(other.modes)
        if what == "glue":
            wrong = bool((other.modes and not one.modes) or (one.modes and other.rigid))
        if wrong or (one.modes and other.modes and one.model != other.model):
            raise SceneError(
                f"{what} of '{first}' and '{second}': their models are {_word(one)} and "
                f"{_word(other)}; what is reduced to modes and shares an edge is one body: both "
                "must have the same Modal(...), or be connected by joints"
            )


def _slowed_alike(scene: Description, group: tuple[str, ...]) -> None:
    """Modes know one mass matrix: what damps in proportion to it has one rate."""
    bodies = [body for body in scene.meshed if body.name in group]
    first = bodies[0]
    for body in bodies[1:]:
        if body.section.mass_damping != first.section.mass_damping:
            raise SceneError(
                f"{said(first)} and {said(body)} are one body in modes, and mass_damping of their "
                f"sections is {show(first.section.mass_damping)} and "
                f"{show(body.section.mass_damping)}; it must be the same, or the model 'exact'"
            )


def _word(body: SceneBody) -> str:
    return f"Modal({body.modes})" if body.modes else repr(body.model)


def groups_of(scene: Description) -> Iterator[tuple[str, ...]]:
    """Names of the shells and beams that make up each reduced body, in the order of the scene."""
    group = {b.name: b.name for b in scene.meshed if b.modes}
    group |= {glue.beam: glue.beam for glue in scene.glues if glue.shell in group}
    pairs = [(join.first, join.second) for join in scene.joins]
    pairs += [(glue.shell, glue.beam) for glue in scene.glues]
    for first, second in pairs:
        if first in group and second in group:
            old, new = group[second], group[first]
            group = {name: new if g == old else g for name, g in group.items()}
    names = [b.name for b in scene.meshed if b.name in group]
    for head in dict.fromkeys(group[name] for name in names):
        yield tuple(name for name in names if group[name] == head)
