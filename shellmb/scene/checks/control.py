"""Requirements of step control by error, and the times at which its steps must end."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from shellmb.errors import SceneError
from shellmb.scene.loads.supports import Driven, Fixed
from shellmb.scene.values.validate import show

if TYPE_CHECKING:
    from shellmb.scene.description import Description

# relative difference of values before and after a time from which on it is a jump, no round-off
LEAP = 1e-9


def check_control(scene: Description) -> None:
    """Check the tolerance and the times of the step control.

    Raises:
        SceneError: If a scene without velocities has a tolerance, if bounds of the step exclude its
            first one, or if a time is behind the end or on a static path.
    """
    control = scene.step_control
    who = f"scene '{scene.name}'"
    assert scene.dt is not None and scene.t_end is not None
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
    return _within(scene, (t for f in functions_of_time(scene) for t in _corners(f)))


def jumps(scene: Description) -> tuple[float, ...]:
    """Times within a run at which a function of time is known to jump [s].

    Args:
        scene: The scene.
    """
    every = ((f, t) for f in functions_of_time(scene) for t in _corners(f))
    return _within(scene, (t for f, t in every if _leaps(f, t)))


def functions_of_time(scene: Description) -> list[Any]:
    """Functions of time of loads and of motions that are prescribed, others among them.

    Args:
        scene: The scene.
    """
    functions: list[Any] = [load.time for load in scene.loads]
    for support in scene.supports:
        if isinstance(support, Fixed):
            functions += (*support.displacement, *support.director)
        elif isinstance(support, Driven):
            functions += (support.rotation, support.translation)
    for driver in scene.drivers:
        functions += (driver.rotation, driver.translation)
    constraints: tuple[Any, ...] = (*scene.joints, *scene.couplings)
    functions += (function for item in constraints for function in item.given)
    return functions


def _corners(function: Any) -> tuple[float, ...]:
    return tuple(float(t) for t in getattr(function, "corners", ()))


def _leaps(function: Any, t: float) -> bool:
    """Decide whether a function has another value right before a time [s], beyond round-off."""
    value, before = function(t), function(math.nextafter(t, -math.inf))
    return abs(value - before) > LEAP * max(abs(value), abs(before))


def _within(scene: Description, times: Iterable[float]) -> tuple[float, ...]:
    assert scene.t_end is not None
    return tuple(sorted({t for t in times if 0 < t < scene.t_end}))
