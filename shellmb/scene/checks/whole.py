"""Checks of a scene that concern several of its parts; all of them before DOLFINx is imported."""

from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np

from shellmb.errors import SceneError
from shellmb.scene.checks import multibody as checks_multibody
from shellmb.scene.checks import potentials as checks_potentials
from shellmb.scene.checks import schemes as checks_schemes
from shellmb.scene.checks import signals as checks_signals
from shellmb.scene.checks.ignored_settings import effect_rules
from shellmb.scene.checks.names import ANY, EDGES, PARTS, check_place, field_rules, reserve_rules
from shellmb.scene.description import Description
from shellmb.scene.loads.loads import EdgeLoad, PointLoad
from shellmb.scene.loads.supports import Fixed, HardSupport, Support, at_rest
from shellmb.scene.lookup import connected
from shellmb.scene.multibody.joints import GROUND
from shellmb.scene.probes import Probe
from shellmb.scene.shells.sections import LinearSection
from shellmb.scene.shells.shell import Join
from shellmb.scene.values.bodies import SceneBody
from shellmb.scene.values.user_functions import finite_in_time, values_at
from shellmb.scene.values.validate import Sentences, as_names, error_of, refuse, said, show

# parts of a scene whose names differ within each of them, and others with names
RECORDED = ("probes", "reserves", "controllers")
NAMED = ("bodies", "joints", "drivers", "force_elements", "couplings", *RECORDED)
EVENTS = "all_events"
ALSO_NAMED = ("potentials", "contacts", "volumes", "events")
# what the name of a place may be of: what is along an edge, as HardSupport and loads are, has no
# meaning on an area
NAMES: dict[Any, tuple[str, ...]] = {
    Fixed: ANY,
    HardSupport: EDGES,
    Support: PARTS,
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
            called = f"its files would be called '{stem}', as {other}"
            raise error_of(body, f"{called}; it must have another name")
        files[stem] = body.name
    columns: tuple[Any, ...] = (*scene.probes, *scene.reserves)
    for item in columns:
        if item.name in COLUMNS:
            column = f"every history has a column '{item.name}'"
            raise error_of(item, f"{column}; it must have another name")


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


def scene_rules(scene: Description, _: Any) -> Sentences:
    """Refuse scenes without bodies, and names that are given twice."""
    if not scene.bodies:
        yield "it has no bodies; it must have a shell, a beam or a rigid body"
    for body in scene.bodies:
        if body.name == GROUND:
            yield (
                f"a {body.label} is named '{GROUND}'; it must have another name, because this "
                "one is reserved"
            )
    for what in ("shells", *NAMED, EVENTS):
        for name, count in Counter(item.name for item in getattr(scene, what)).items():
            if count > 1:
                many = f"{count} {what.removeprefix('all_').replace('_', ' ')} are named '{name}'"
                note = " (a lock with a condition has one of its own)" if what == EVENTS else ""
                yield f"{many}{note}; each must have a name of its own"
    check_names(scene)


_FROM_EQUILIBRIUM = (
    "its Prony series has relaxed=False, and the scene starts in equilibrium, which is that of "
    "relaxed branches; relaxed must be True"
)


def _relaxes(body: Any) -> bool:
    return bool(body.section.relaxes and not body.rigid)


def relaxing_body(scene: Description, body: Any) -> Sentences:
    """Refuse what bodies whose sections relax cannot have."""
    if not _relaxes(body):
        return
    relaxed, natural = body.section.relaxed, body.natural
    if body.modes:
        yield (
            f"its section relaxes, and its model is {show(body.model)}; modes do not relax: the "
            "model must be 'exact' or 'floating-frame'"
        )
    if getattr(body.section, "functions", None) and any(body.section.damping_times):
        yield (
            "its section varies, relaxes, and has stiffness_damping; where it relaxes and varies, "
            "stiffness_damping must be 0"
        )
    if not relaxed and "equilibrium" in scene.starts:
        yield _FROM_EQUILIBRIUM
    if natural is not None and not (scene.static or (relaxed and natural.time is None)):
        yield (
            "its section relaxes, and its branches do not follow a natural strain; in motion "
            "natural must be left out, or be constant in time, with relaxed=True"
        )


def relaxing_element(scene: Description, element: Any) -> Sentences:
    """Refuse what force elements that relax cannot have."""
    series = element.relaxation
    if series is None:
        return
    if any(_relaxes(body) and body.name == element.name for body in scene.meshed):
        yield (
            f"a body that relaxes has this name, too, and columns as "
            f"'{element.name}.relaxation.loss' are by names; it must have another name"
        )
    if not series.relaxed and "equilibrium" in scene.starts:
        yield _FROM_EQUILIBRIUM


def target_rules(scene: Description, item: Any) -> Sentences:
    """Refuse places of supports, loads, initial velocities and probes that are not there."""
    for body in scene.bodies_of(item):
        if not body.directors and np.any(getattr(item, "offset", None)):
            right = f"it must be 0 on {said(body)}, whose nodes have no directors for an arm"
            yield "offset", right
        kinds = next((some for kind, some in NAMES.items() if isinstance(item, kind)), None)
        if kinds is not None:
            # of several names each is that of an edge or an area
            several = isinstance(item.at, tuple)
            check_place(body, item.at, said(item), kinds[:2] if several else kinds)


def check_join(scene: Description, join: Join) -> None:
    """Check that shells have the edges of a join, and that these are joined once."""
    for name, edge in ((join.first, join.at), (join.second, join.second_at)):
        check_place(scene.shell(name, "join"), edge, "join", EDGES)
    ends = join.first, join.second
    if sum(all(_edges_of(one, n) & _edges_of(join, n) for n in ends) for one in scene.joins) > 1:
        of = f"of '{join.first}' and '{join.second}', {show(join.at)} and {show(join.second_at)}"
        raise error_of(scene, f"two joins join the same edges {of}; remove one of them")


def _edges_of(join: Join, shell: str) -> set[str]:
    """Edges of a shell along which it is joined."""
    ends = ((join.first, join.at), (join.second, join.second_at))
    return {edge for name, at in ends if name == shell for edge in as_names(at)}


def check_time(scene: Description, _: Any) -> None:
    """Check that functions of time give finite numbers: first, in the middle, and at the end."""
    end = scene.given_until
    for load in scene.loads:
        finite_in_time(load.time, scene.t_end, f"{load.label}: time", 1)
    for body in scene.meshed:
        if body.natural is not None:
            who = f"natural strain of {said(body)}: time"
            finite_in_time(body.natural.time, scene.t_end, who, 1)
    for item, name, value in scene.prescribed:
        what = "prescribed value" if isinstance(item, Fixed) else name
        size = 3 if isinstance(item, Support) and name == "translation" else 1
        finite_in_time(value, end, f"{said(item)}: {what}", size)


def check_positions(scene: Description, _: Any) -> None:
    """Check loads, directions and sections that are functions of the position at a few points."""
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


def fixed_rules(scene: Description, support: Any) -> Sentences:
    """Refuse directors of bodies that have none, or three."""
    if not any(c is not None for c in getattr(support, "director", ())):
        return
    (body,) = scene.bodies_of(support)
    if body.directors != 1:
        yield (
            f"director is {show(support.director)} on {said(body)}; it must be left out, because "
            "only a shell has one: use Clamped or a joint to the ground"
        )


def check_reduced(scene: Description, _: Any = None) -> None:
    """Check what concerns bodies in modes.

    Raises:
        SceneError: At the first thing that they cannot have.
    """
    _alike(scene)
    groups = [[b for b in scene.meshed if b.name in group] for group in groups_of(scene)]
    for group in groups:
        for body in group:
            # modes know one mass matrix: what damps in proportion to it has one rate
            first, own = (b.section.mass_damping for b in (group[0], body))
            if own != first:
                raise SceneError(
                    f"{said(group[0])} and {said(body)} are one body in modes, and mass_damping of "
                    f"their sections is {show(first)} and {show(own)}; it must be the same, or the "
                    "model 'exact'"
                )
            if not body.mass_given > 0:
                raise SceneError(
                    f"{said(body)} is reduced to modes and has no mass, by which these are found, "
                    "in statics too; give its section a density"
                )
    modal = {body.name for group in groups for body in group}
    for support in scene.supports:
        for target in scene.bodies_of(support):
            if target.name in modal and not at_rest(support):
                raise SceneError(
                    f"{support.label}: {said(target)} is reduced to modes and would be moved; what "
                    "moves it must be a Driver of a joint, and supports must hold it where it is"
                )
    for joint in scene.joints:
        if joint.rolls and {joint.first, joint.second} & modal:
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


def _word(body: SceneBody) -> str:
    return f"Modal({body.modes})" if body.modes else repr(body.model)


def groups_of(scene: Description) -> list[tuple[str, ...]]:
    """Names of the shells and beams that make up each reduced body, in the order of the scene."""
    led = [glue.beam for glue in scene.glues if scene.shell(glue.shell).modes]
    names = [b.name for b in scene.meshed if b.modes or b.name in led]
    groups = connected(names, (pair for pair in scene.tied if {*pair} <= {*names}))
    found = (tuple(name for name in names if name in group) for group in groups)
    return sorted(found, key=lambda group: names.index(group[0]))


# what the parts of a scene, by the names of its fields, are looked at for, in this order
RULES: tuple[tuple[str, Callable[[Description, Any], Sentences | None]], ...] = (
    ("scene", scene_rules),
    ("scene", checks_schemes.scheme_rules),
    ("meshed", relaxing_body),
    ("force_elements", relaxing_element),
    ("supports loads initial probes", target_rules),
    ("joins", check_join),
    ("scene", check_time),
    ("scene", check_positions),
    *checks_multibody.RULES,
    ("supports", fixed_rules),
    ("scene", checks_multibody.check_supported),
    *checks_potentials.RULES,
    ("scene", check_reduced),
    ("scene", effect_rules),
    *checks_schemes.LINEAR_RULES,
    *checks_signals.RULES,
    ("scene", checks_schemes.path_rules),
    ("scene", field_rules),
    ("reserves", reserve_rules),
)


def check(scene: Description) -> None:
    """Check the whole scene.

    Args:
        scene: The scene.

    Raises:
        SceneError: At the first thing that is impossible.
    """
    for fields, rules in RULES:
        for what in fields.split():
            for part in (scene,) if what == "scene" else getattr(scene, what):
                refuse(part, rules(scene, part) or ())
