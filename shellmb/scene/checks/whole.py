"""Checks of a scene that concern several of its parts; all of them before DOLFINx is imported."""

from __future__ import annotations

from collections import Counter
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from shellmb.errors import SceneError
from shellmb.scene.beams.beam import Beam
from shellmb.scene.checks import ignored_settings as checks_effect
from shellmb.scene.checks import linear as checks_linear
from shellmb.scene.checks import multibody as checks_multibody
from shellmb.scene.checks import reduced as checks_reduced
from shellmb.scene.checks.control import check_control
from shellmb.scene.checks.locations import (
    areas_of,
    check_edges,
    check_point,
    edges_of,
    finite_in_time,
    points_of,
)
from shellmb.scene.checks.names import check_names
from shellmb.scene.checks.potentials import check_potentials
from shellmb.scene.checks.signals import check_signals
from shellmb.scene.loads.body_loads import LineForce
from shellmb.scene.loads.loads import EdgeLoad, PointLoad
from shellmb.scene.loads.supports import Driven, Fixed, HardSupport, Support
from shellmb.scene.lookup import bodies_of, find_shell, kind_of, listed, said
from shellmb.scene.multibody.joints import GROUND
from shellmb.scene.multibody.own_bodies import UserBody
from shellmb.scene.probes import Probe
from shellmb.scene.schemes import DISSIPATIVE, SCHEMES, Traits
from shellmb.scene.shells.sections import LinearSection
from shellmb.scene.shells.shell import Join, Shell
from shellmb.scene.values.models import Modal
from shellmb.scene.values.positions import values_at
from shellmb.scene.values.renamed import choice_of_today
from shellmb.scene.values.validate import edge_names, show

if TYPE_CHECKING:
    from shellmb.scene.description import Body, Description

__all__ = ["check"]


def check(scene: Description) -> None:
    """Check the whole scene.

    Raises:
        SceneError: At the first thing that is impossible.
    """
    _names(scene)
    _scheme(scene)
    _quadratic(scene)
    _end_forces(scene)
    _relaxation(scene)
    _targets(scene)
    _time_functions(scene)
    _functions_of_position(scene)
    checks_multibody.check(scene)
    check_potentials(scene)
    checks_reduced.check(scene)
    checks_effect.check(scene)
    checks_linear.check(scene)
    check_signals(scene)


def _names(scene: Description) -> None:
    if not scene.bodies:
        raise SceneError(
            f"scene '{scene.name}': it has no bodies; it must have a shell, a beam or a rigid body"
        )
    for body in scene.bodies:
        if body.name == GROUND:
            raise SceneError(
                f"scene '{scene.name}': a {kind_of(body)} is named '{GROUND}'; it must have "
                "another name, because this one is reserved"
            )
    named = (
        "shells",
        "bodies",
        "joints",
        "drivers",
        "force_elements",
        "couplings",
        "probes",
        "reserves",
        "controllers",
    )
    for what in (*named, "controllers"):
        for name, count in Counter(item.name for item in getattr(scene, what)).items():
            if count > 1:
                raise SceneError(
                    f"scene '{scene.name}': {count} {what.replace('_', ' ')} are named '{name}'; "
                    "each must have a name of its own"
                )
    check_names(scene)


def _scheme(scene: Description) -> None:
    scheme = scene.scheme
    if isinstance(scheme, str):
        if scheme not in SCHEMES:
            raise SceneError(
                f"scene '{scene.name}': scheme is {show(scheme)}; "
                f"it must be one of {listed(SCHEMES)}, or a scheme object"
                + choice_of_today("scheme", scheme)
            )
        has_jump = SCHEMES[scheme].jump
    elif not isinstance(getattr(scheme, "name", None), str):
        raise SceneError(
            f"scene '{scene.name}': scheme is {show(scheme)}; "
            f"it must be one of {listed(SCHEMES)}, or a scheme object with a name"
        )
    else:
        has_jump = "j" in getattr(scheme, "stages", ())
    for what in ("dt", "t_end"):
        if getattr(scene, what) is None:
            raise SceneError(
                f"scene '{scene.name}': {what} is missing; scheme '{scene.scheme_name}' needs it"
            )
    if scene.step_control.jump_tolerance is not None and not has_jump:
        raise SceneError(
            f"scene '{scene.name}': jump_tolerance is {show(scene.step_control.jump_tolerance)}; "
            f"it must be left out, because scheme '{scene.scheme_name}' has no jump as 'ed' has"
        )
    check_control(scene)


def _quadratic(scene: Description) -> None:
    """Refuse what schemes that are quadratic in time cannot do where directors have no inertia.

    Raises:
        SceneError: Names the body, or those that share directors.
    """
    scheme = scene.scheme_name
    if not SCHEMES.get(scheme, Traits()).quadratic:
        return
    bodies: list[Any] = [*scene.shells, *scene.beams]
    light = {b.name: not (b.rotary_inertia and b.section.masses[2]) for b in bodies if b.nodal}
    alpha = getattr(scene.scheme, "alpha", scene.dissipation if scheme in DISSIPATIVE else 0.0)
    for body in scene.meshed:
        if alpha == 0 and light.get(body.name):
            raise SceneError(
                f"{said(body)}: rotary_inertia is False, or its section has no second moments of "
                f"mass; scheme '{scheme}' without dissipation keeps errors of directors without "
                "inertia, which arise at the start and where loads jump: they must have inertia, "
                "or use scheme 'ed3' with alpha > 0, 'ep' or 'ed'"
            )
    pairs = [(join.first, join.second) for join in scene.joins]
    pairs += [(glue.beam, glue.shell) for glue in scene.glues]
    for pair in pairs:
        if len({light[name] for name in pair if name in light}) > 1:
            idle, inert = sorted(pair, key=lambda name: not light[name])
            raise SceneError(
                f"'{idle}' and '{inert}' are joined: only '{idle}' has no rotary inertia; with "
                f"scheme '{scheme}' both or none must have it, because directors of the one are "
                "tied to those of the other"
            )


def _end_forces(scene: Description) -> None:
    """Forces at the end of a step need resultants that follow from strains."""
    if scene.static or not scene.output.end_forces:
        return
    for body in scene.meshed:
        if body.holds_strains:
            raise SceneError(
                f"{said(body)}: it holds strains at zero, and the forces that hold them are "
                "known as means over a step only; output must be without end_forces, or the body "
                "must have all of its strains"
            )


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
        if isinstance(body.model, Modal):
            raise SceneError(
                f"{who}: its section relaxes, and its model is {show(body.model)}; modes do not "
                "relax: the model must be 'exact' or 'floating-frame'"
            )
        if isinstance(body, Shell) and body.holds_strains:
            raise SceneError(
                f"{who}: its section relaxes, and it holds strains at zero; a shell that relaxes "
                "must have stretching=True and transverse_shear=True"
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
        for body in bodies_of(scene, item):
            offset = getattr(item, "offset", None)
            if isinstance(body, UserBody) and np.any(offset):
                raise SceneError(
                    f"{who}: offset is {show(offset)}; it must be 0 on {said(body)}, whose nodes "
                    "have no directors for an arm"
                )
            if isinstance(item, Fixed):
                _edge_or_point(body, item.at, who)
            elif isinstance(item, Support | EdgeLoad):
                # what is along an edge, as HardSupport and loads are, has no meaning on an area
                held = isinstance(item, Support) and not isinstance(item, HardSupport)
                check_edges(body, item.at, who, areas_of(body) if held else ())
            elif isinstance(item, PointLoad | Probe):
                check_point(body, item.at, who)
    for join in scene.joins:
        for name, edge in ((join.first, join.at), (join.second, join.second_at)):
            check_edges(find_shell(scene, name, "join"), edge, "join")
    for one, two in combinations(scene.joins, 2):
        if all(_edges_of(one, name) & _edges_of(two, name) for name in (one.first, one.second)):
            raise SceneError(
                f"scene '{scene.name}': two joins join the same edges of '{one.first}' and "
                f"'{one.second}', {show(one.at)} and {show(one.second_at)}; remove one of them"
            )


def _edges_of(join: Join, shell: str) -> set[str]:
    """Edges of a shell along which it is joined."""
    ends = ((join.first, join.at), (join.second, join.second_at))
    return {edge for name, at in ends if name == shell for edge in edge_names(at)}


def _edge_or_point(body: Body, where: Any, who: str) -> None:
    edges, points = edges_of(body), points_of(body)
    if (
        edges is None
        or points is None
        or (isinstance(where, tuple) and len(where) == 3 and not isinstance(where[0], str))
    ):
        return
    if isinstance(where, str) and where in points:
        return
    for name in edge_names(where):
        if name not in (*edges, *areas_of(body)):
            raise SceneError(
                f"{who}: {said(body)} has no edge or point '{name}'; its edges are "
                f"{listed(edges)}, its points {listed(points)}"
            )


def _time_functions(scene: Description) -> None:
    """Every function of time gives finite numbers at the beginning, the middle and the end."""
    assert scene.t_end is not None
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
        if isinstance(s, Fixed):
            for c in (*s.displacement, *s.director):
                finite_in_time(c, end, "fixed components: prescribed value", 1)
        elif isinstance(s, Driven):
            finite_in_time(s.rotation, end, "driven edge: rotation", 1)
            finite_in_time(s.translation, end, "driven edge: translation", 3)


def _functions_of_position(scene: Description) -> None:
    """Loads, directions and sections that are, tried at a few points where the surface is known."""
    s = np.linspace(0.05, 0.95, 7)
    for load in scene.loads:
        given = {name: getattr(load, name, None) for name in ("force", "p", "moment")}
        for name, value in given.items():
            if callable(value):
                if isinstance(load, LineForce):
                    (beam,) = bodies_of(scene, load)
                    assert isinstance(beam, Beam)
                    if beam.curve.shell is None:
                        values_at(value, beam.curve.position(s), 3, f"{load.label}: {name}")
                    continue
                surface = find_shell(scene, load.body, load.label).surface
                if surface.edges is not None:
                    x = surface.position(s, s[::-1].copy())
                    values_at(value, x, 1 if name == "p" else 3, f"{load.label}: {name}")
    for shell in scene.shells:
        if shell.surface.edges is None:
            continue
        x = shell.surface.position(s, s[::-1].copy())
        if callable(shell.direction):
            values_at(shell.direction, x, 3, f"shell '{shell.name}': direction")
        if isinstance(shell.section, LinearSection) and shell.section.functions:
            shell.section.at(x, f"shell '{shell.name}'")
