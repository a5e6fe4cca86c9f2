"""Checks of what schemes can follow, and times at which functions of time jump or have corners."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from shellmb.errors import SceneError
from shellmb.scene.description import Description
from shellmb.scene.loads.supports import Fixed, at_rest, moves
from shellmb.scene.schemes import DISSIPATIVE, SCHEMES, Traits
from shellmb.scene.values.renamed import choice_of_today
from shellmb.scene.values.validate import error_of, listed, refused, said, show

# relative difference of values before and after a time from which on it is a jump, no round-off
LEAP = 1e-9
# a rotation by this is off by its square in a linear analysis: positions by half a per cent, rad
SMALL_ANGLE = 0.1
# times at which prescribed rotations are looked at, in parts of the run
LOOKED_AT = np.linspace(0.0, 1.0, 33)


def check_scheme(scene: Description) -> None:
    """Check that there is such a scheme, and that bodies and output are such as it can have.

    Raises:
        SceneError: At the first thing that is impossible.
    """
    _scheme(scene)
    _quadratic(scene)
    _end_forces(scene)


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
            raise error_of(scene, f"{what} is missing; scheme '{scene.scheme_name}' needs it")
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


def check_linear(scene: Description) -> None:
    """Check a scene with a linear scheme.

    Raises:
        SceneError: If something of it is not small.
    """
    if not scene.linear:
        return
    scheme = f"with scheme '{scene.scheme_name}'"
    for joint in scene.joints:
        if joint.rolls:
            raise SceneError(
                f"{joint.said}: what rolls goes far, and {scheme} displacements are small; the "
                "scheme must be another, as 'ep'"
            )
    for driver in scene.drivers:
        _small(scene, driver.rotation, f"driver '{driver.name}': rotation")
    for support in scene.supports:
        _small(scene, support.rotation, f"{said(support)}: rotation")
    for lock in scene.acting_locks:
        late = [start for start, _ in lock.active or () if start > 0]
        if lock.switch is not None:
            raise SceneError(
                f"lock of joint '{lock.joint}': event '{lock.switch}' switches it; {scheme} it "
                "must begin at 0, in the reference configuration, in a window"
            )
        if late:
            raise SceneError(
                f"lock of joint '{lock.joint}': a window begins at t = {late[0]:g}; {scheme} it "
                "must begin at 0, in the reference configuration"
            )
    _given(scene, scheme)


def _given(scene: Description, scheme: str) -> None:
    """Check where the scene starts, and what is requested."""
    who = f"scene '{scene.name}'"
    for what, wrong in (
        ("start is 'equilibrium'", "equilibrium" in scene.starts),
        ("assemble is True", scene.assemble),
    ):
        if wrong:
            raise SceneError(
                f"{who}: {what}; {scheme} it must be left out: displacements are from the given "
                "positions, which are at rest"
            )
    if scene.output.end_forces and not scene.static:
        raise SceneError(
            f"{who}: output has end_forces; {scheme} it must have none: forces are means over the "
            "step, free of oscillation"
        )


def _small(scene: Description, angle: Any, who: str) -> None:
    if angle is None:
        return
    times = LOOKED_AT * scene.t_end
    angles = [abs(float(angle(t)) if callable(angle) else float(angle)) for t in times]
    worst = int(np.argmax(angles))
    if angles[worst] > SMALL_ANGLE:
        raise SceneError(
            f"{who} is {show(float(f'{angles[worst]:.4g}'))} at t = {times[worst]:g}; with scheme "
            f"'{scene.scheme_name}' rotations must be at most {SMALL_ANGLE:g} rad, or the scheme "
            "another, as 'static' or 'ep'"
        )


def check_path(scene: Description) -> None:
    """Check that a scene is one whose path can be followed.

    Raises:
        SceneError: Says what stands against it.
    """
    if scene.path is None:
        return
    if scene.starts:
        raise refused(
            scene, "start", "a path starts from the unloaded structure, so it must be left out"
        )
    who = f"scene '{scene.name}': path following"
    if scene.scheme_name != "static":
        raise SceneError(
            f"{who} has scheme {show(scene.scheme_name)}; it must be 'static', or path must be "
            "left out"
        )
    _check_given(scene, who)
    followed: list[Any] = [*scene.loads, *(body for body in scene.meshed if body.natural)]
    followed += [p for p in scene.potentials if p.load]
    followed += [s for s in scene.supports if moves(s)]
    followed += [v for v in scene.volumes if v.change is not None]
    followed += [joint for joint in scene.joints if joint.given]
    followed += [coupling for coupling in scene.couplings if coupling.given]
    if not followed and not scene.drivers:
        raise SceneError(
            f"{who} has no load to follow; it must have one at least: a load, a natural strain, a "
            "potential with load=True, or a prescribed motion"
        )
    for load in scene.loads:
        if load.time is not None:
            raise SceneError(
                f"{who}: a {load.label} has a function of time; it must be left out, because the "
                "load factor multiplies all loads"
            )
    moved = [f"lock of joint '{lock.joint}'" for lock in scene.locks]
    moved += [f"windows of joint '{j.name}'" for j in scene.joints if j.active is not None]
    if moved:
        raise SceneError(
            f"{who}: something is prescribed over time ({moved[0]}); it must be left out, because "
            "loads are followed and there is no time"
        )


def _check_given(scene: Description, who: str) -> None:
    """Refuse motions that do not begin with the unloaded structure."""
    given: list[tuple[str, Any]] = []
    for support in scene.supports:
        what = f"{said(support)} at {show(support.at)}"
        if not moves(support) and not at_rest(support):
            raise SceneError(
                f"{who}: {what} prescribes a number other than 0; it must be a "
                "function of the load factor, as lambda factor: 0.1 * factor"
            )
        single = isinstance(support, Fixed)
        given += [(what if single else f"{what}: {n}", c) for n, c in support.given.items()]
    given += [(f"{said(v)}: change", v.change) for v in scene.volumes if v.change is not None]
    for driver in scene.drivers:
        given += [(f"{said(driver)}: {name}", value) for name, value in driver.given.items()]
    for what, value in given:
        start = np.max(np.abs(value(0.0) if callable(value) else value or 0.0))
        if start > 0:
            raise SceneError(
                f"{who}: {what} is {start:g} at the load factor 0; it must be 0 there, because a "
                "path starts from the unloaded structure"
            )


def check_control(scene: Description) -> None:
    """Check the tolerance and the times of the step control.

    Raises:
        SceneError: If a scene without velocities has a tolerance, if bounds of the step exclude its
            first one, or if a time is behind the end or on a static path.
    """
    control = scene.step_control
    who = f"scene '{scene.name}'"
    if control.times and scene.path is not None:
        raise SceneError(
            f"{who}: the step control has times; it must have none where a path is followed, whose "
            "steps are arc lengths"
        )
    if control.times and control.times[-1] > scene.t_end:
        raise SceneError(
            f"{who}: the step control has the time {show(control.times[-1])}; it must be at most "
            f"t_end, which is {show(scene.t_end)}"
        )
    if control.step_error is None:
        return
    tolerance = f"{who}: step_error of the step control is {show(control.step_error)}"
    if scene.static:
        raise SceneError(
            f"{tolerance}; it must be left out, because scheme '{scene.scheme_name}' has no motion "
            "whose error a step could follow"
        )
    for bound, value, wrong in (
        ("min_dt", control.min_dt, control.min_dt and control.min_dt > scene.dt),
        ("max_dt", control.max_dt, control.max_dt and control.max_dt < scene.dt),
    ):
        if wrong:
            raise SceneError(
                f"{tolerance} and {bound} is {show(value)}; dt, the first step, is "
                f"{show(scene.dt)} and must be within the bounds"
            )


def corners(scene: Description) -> tuple[float, ...]:
    """Times within a run at which a function of time is known to have a jump or a corner [s].

    Steps across one are less accurate than the scheme is.

    Args:
        scene: The scene.
    """
    return _corners(scene, lambda function, t: True)


def jumps(scene: Description) -> tuple[float, ...]:
    """Times within a run at which a function of time is known to jump [s].

    Args:
        scene: The scene.
    """
    return _corners(scene, _leaps)


def functions_of_time(scene: Description) -> list[Any]:
    """Functions of time of loads and of motions that are prescribed, others among them.

    Args:
        scene: The scene.
    """
    functions: list[Any] = [load.time for load in scene.loads]
    prescribed: tuple[Any, ...] = (*scene.supports, *scene.drivers)
    functions += (value for item in prescribed for value in item.given.values())
    constraints: tuple[Any, ...] = (*scene.joints, *scene.couplings)
    functions += (function for item in constraints for function in item.given)
    return functions


def _leaps(function: Any, t: float) -> bool:
    """Decide whether a function has another value right before a time [s], beyond round-off."""
    value, before = function(t), function(math.nextafter(t, -math.inf))
    return abs(value - before) > LEAP * max(abs(value), abs(before))


def _corners(scene: Description, wanted: Callable[[Any, float], bool]) -> tuple[float, ...]:
    """Times within a run at which functions of time have corners of the wanted kind."""
    every = ((f, float(t)) for f in functions_of_time(scene) for t in getattr(f, "corners", ()))
    return tuple(sorted({t for f, t in every if 0 < t < scene.t_end and wanted(f, t)}))
