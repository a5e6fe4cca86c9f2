"""Checks of what schemes can follow, and times at which functions of time jump or have corners."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from shellmb.errors import SceneError
from shellmb.scene.description import Description
from shellmb.scene.loads.supports import Fixed, Support, at_rest, moves
from shellmb.scene.schemes import DISSIPATIVE, SCHEMES, Traits
from shellmb.scene.values.renamed import choice_of_today
from shellmb.scene.values.validate import Sentences, error_of, listed, said, show

# relative difference of values before and after a time from which on it is a jump, no round-off
LEAP = 1e-9
# a rotation by this is off by its square in a linear analysis: positions by half a per cent, rad
SMALL_ANGLE = 0.1
# times at which prescribed rotations are looked at, in parts of the run
LOOKED_AT = np.linspace(0.0, 1.0, 33)


def scheme_rules(scene: Description, _: Any) -> Sentences:
    """Refuse schemes that there are not, and bodies, steps and output that they cannot have."""
    scheme, name = scene.scheme, scene.scheme_name
    if isinstance(scheme, str):
        if scheme not in SCHEMES:
            known = f"one of {listed(SCHEMES)}, or a scheme object"
            yield "scheme", f"it must be {known}{choice_of_today('scheme', scheme)}"
        has_jump = SCHEMES[scheme].jump
    else:
        if not isinstance(getattr(scheme, "name", None), str) or isinstance(scheme, type):
            yield "scheme", f"it must be one of {listed(SCHEMES)}, or a scheme object with a name"
        if hasattr(scheme, "forms"):
            yield (
                f"scheme '{name}' has a member 'forms', which nothing reads; its equations must be "
                "those of expand(levels, dt), and what else it has must have another name"
            )
        has_jump = "j" in getattr(scheme, "stages", ())
    for what in ("dt", "t_end"):
        if getattr(scene, what) is None:
            yield f"{what} is missing; scheme '{name}' needs it"
    jump = scene.step_control.jump_tolerance
    if jump is not None and not has_jump:
        yield (
            f"jump_tolerance is {show(jump)}; it must be left out, because scheme '{name}' has no "
            "jump as 'ed' has"
        )
    yield from _control(scene)
    if SCHEMES.get(name, Traits()).quadratic:
        check_quadratic(scene)
    # forces at the end of a step need resultants that follow from strains
    for body in () if scene.static or not scene.output.end_forces else scene.meshed:
        if body.holds_strains:
            raise error_of(
                body,
                "it holds strains at zero, and the forces that hold them are known as means over a "
                "step only; output must be without end_forces, or the body must have all of its "
                "strains",
            )


def _control(scene: Description) -> Sentences:
    """Refuse tolerances, bounds and times of the step control that cannot be."""
    control = scene.step_control
    if control.times and scene.path is not None:
        yield (
            "the step control has times; it must have none where a path is followed, whose steps "
            "are arc lengths"
        )
    if control.times and control.times[-1] > scene.t_end:
        last = f"the step control has the time {show(control.times[-1])}"
        yield f"{last}; it must be at most t_end, which is {show(scene.t_end)}"
    if control.step_error is None:
        return
    tolerance = f"step_error of the step control is {show(control.step_error)}"
    if scene.static:
        yield (
            f"{tolerance}; it must be left out, because scheme '{scene.scheme_name}' has no motion "
            "whose error a step could follow"
        )
    for bound, value, wrong in (
        ("min_dt", control.min_dt, control.min_dt and control.min_dt > scene.dt),
        ("max_dt", control.max_dt, control.max_dt and control.max_dt < scene.dt),
    ):
        if wrong:
            yield (
                f"{tolerance} and {bound} is {show(value)}; dt, the first step, is "
                f"{show(scene.dt)} and must be within the bounds"
            )


def check_quadratic(scene: Description) -> None:
    """Check that schemes quadratic in time get inertia of directors.

    Args:
        scene: The scene.

    Raises:
        SceneError: Names the body, or those that share directors.
    """
    scheme = scene.scheme_name
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
    for pair in scene.tied:
        if len({light[name] for name in pair if name in light}) > 1:
            idle, inert = sorted(pair, key=lambda name: not light[name])
            raise SceneError(
                f"'{idle}' and '{inert}' are joined: only '{idle}' has no rotary inertia; with "
                f"scheme '{scheme}' both or none must have it, because directors of the one are "
                "tied to those of the other"
            )


def small_joint(scene: Description, joint: Any) -> Sentences:
    """Refuse what goes far with a linear scheme."""
    if scene.linear and joint.rolls:
        yield (
            f"what rolls goes far, and {_with(scene)} displacements are small; the scheme must be "
            "another, as 'ep'"
        )


def small_rotation(scene: Description, item: Any) -> Sentences:
    """Refuse rotations with a linear scheme that are not small."""
    angle = getattr(item, "rotation", None)
    if not scene.linear or angle is None:
        return
    times = LOOKED_AT * scene.t_end
    angles = [abs(float(angle(t)) if callable(angle) else float(angle)) for t in times]
    worst = int(np.argmax(angles))
    if angles[worst] > SMALL_ANGLE:
        yield (
            f"rotation is {show(float(f'{angles[worst]:.4g}'))} at t = {times[worst]:g}; "
            f"{_with(scene)} rotations must be at most {SMALL_ANGLE:g} rad, or the scheme another, "
            "as 'static' or 'ep'"
        )


def early_lock(scene: Description, lock: Any) -> Sentences:
    """Refuse locks with a linear scheme that do not begin in the reference configuration."""
    if not scene.linear:
        return
    right = f"{_with(scene)} it must begin at 0, in the reference configuration"
    if lock.switch is not None:
        yield f"event '{lock.switch}' switches it; {right}, in a window"
    for late in [start for start, _ in lock.active or () if start > 0][:1]:
        yield f"a window begins at t = {late:g}; {right}"


def linear_rules(scene: Description, _: Any) -> Sentences:
    """Refuse starts and outputs that a linear scheme cannot have."""
    if not scene.linear:
        return
    for what, wrong in (
        ("start is 'equilibrium'", "equilibrium" in scene.starts),
        ("assemble is True", scene.assemble),
    ):
        if wrong:
            yield (
                f"{what}; {_with(scene)} it must be left out: displacements are from the given "
                "positions, which are at rest"
            )
    if scene.output.end_forces and not scene.static:
        yield (
            f"output has end_forces; {_with(scene)} it must have none: forces are means over the "
            "step, free of oscillation"
        )


def _with(scene: Description) -> str:
    return f"with scheme '{scene.scheme_name}'"


LINEAR_RULES: tuple[tuple[str, Callable[[Description, Any], Sentences | None]], ...] = (
    ("joints", small_joint),
    ("drivers supports", small_rotation),
    ("acting_locks", early_lock),
    ("scene", linear_rules),
)


def path_rules(scene: Description, _: Any) -> Sentences:
    """Refuse what stands against following a path."""
    if scene.path is None:
        return
    if scene.starts:
        yield "start", "a path starts from the unloaded structure, so it must be left out"
    who = "path following"
    if scene.scheme_name != "static":
        right = "it must be 'static', or path must be left out"
        yield f"{who} has scheme {show(scene.scheme_name)}; {right}"
    for support in scene.supports:
        if not moves(support) and not at_rest(support):
            yield (
                f"{who}: {_place(support)} prescribes a number other than 0; it must be a function "
                "of the load factor, as lambda factor: 0.1 * factor"
            )
    for item, name, value in scene.prescribed:
        start = np.max(np.abs(value(0.0) if callable(value) else value or 0.0))
        if start > 0:
            what = _place(item) if isinstance(item, Fixed) else f"{_place(item)}: {name}"
            yield (
                f"{who}: {what} is {start:g} at the load factor 0; it must be 0 there, because a "
                "path starts from the unloaded structure"
            )
    followed: list[Any] = [*scene.loads, *scene.drivers, *filter(moves, scene.supports)]
    followed += [body for body in scene.meshed if body.natural]
    followed += [p for p in scene.potentials if p.load]
    related: tuple[Any, ...] = (*scene.volumes, *scene.joints, *scene.couplings)
    followed += [part for part in related if part.given]
    if not followed:
        yield (
            f"{who} has no load to follow; it must have one at least: a load, a natural strain, a "
            "potential with load=True, or a prescribed motion"
        )
    for load in scene.loads:
        if load.time is not None:
            yield (
                f"{who}: a {load.label} has a function of time; it must be left out, because the "
                "load factor multiplies all loads"
            )
    moved = [said(lock) for lock in scene.locks]
    moved += [f"windows of joint '{j.name}'" for j in scene.joints if j.active is not None]
    if moved:
        yield (
            f"{who}: something is prescribed over time ({moved[0]}); it must be left out, because "
            "loads are followed and there is no time"
        )


def _place(item: Any) -> str:
    """Name of a part, of a support with its place."""
    return f"{said(item)} at {show(item.at)}" if isinstance(item, Support) else said(item)


def corners(
    scene: Description, wanted: Callable[[Any, float], bool] = lambda function, t: True
) -> tuple[float, ...]:
    """Times within a run at which a function of time is known to have a jump or a corner [s].

    Steps across one are less accurate than the scheme is.

    Args:
        scene: The scene.
        wanted: Whether a function has what is looked for at a time.
    """
    every = ((f, float(t)) for f in functions_of_time(scene) for t in getattr(f, "corners", ()))
    return tuple(sorted({t for f, t in every if 0 < t < scene.t_end and wanted(f, t)}))


def jumps(scene: Description) -> tuple[float, ...]:
    """Times within a run at which a function of time is known to jump [s].

    Args:
        scene: The scene.
    """
    return corners(scene, _leaps)


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
