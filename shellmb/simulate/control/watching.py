"""Events in a run: when they have gone on and off, and where in a step the next one does."""

import math
from collections.abc import Callable, Mapping

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import ControlError
from shellmb.restart import Restartable
from shellmb.scene.control.sensors import Condition, Event, Sensor

# tolerance of the time of an event where it says nothing, in steps
TOLERANCE = 1e-6
# so many changes of one event within the scene's step are no mechanics
CHATTER = 40
# solutions of one step after which nothing is found any more; bisection to 1e-9 of it takes 90
MOST = 120


class Watch(Restartable):
    """An event in a run.

    Args:
        event: The event.
        dt: The scene's step, s.

    Attributes:
        times: When it went on, off, on, ..., s.
        armed: Whether the condition that is waited for has been false.
        tolerance: By how much later than the condition it may be found, s.
    """

    remembered = ("times", "armed")

    def __init__(self, event: Event, dt: float) -> None:
        self.event, self._dt = event, dt
        self.times: list[float] = []
        # at the start a condition counts at once
        self.armed = True
        self.tolerance = TOLERANCE * dt if event.tolerance is None else event.tolerance

    @property
    def on(self) -> bool:
        """Decide whether the event is on."""
        return len(self.times) % 2 == 1

    @property
    def condition(self) -> Condition | None:
        """The one that is waited for; None: none any more."""
        return self.event.until if self.on else self.event.when

    def margin(self, read: Mapping[str, float], t: float) -> float:
        """Margin of the condition that is waited for; -inf if there is none.

        Args:
            read: What sensors read, by their names.
            t: Time, s.

        Raises:
            ControlError: If it is no number.
        """
        if self.condition is None:
            return -math.inf

        def reading(sensor: Sensor) -> float:
            return read[sensor.name]

        try:
            found = self.condition.margin(reading, t)
        except ArithmeticError:
            found = math.nan
        if math.isnan(found):
            raise ControlError(
                f"event '{self.event.name}' at t = {t:.9g}: its condition compares what is no "
                f"number, where {', '.join(f'{k} = {v:.6g}' for k, v in read.items())}"
            )
        return found

    def change(self, t: float) -> None:
        """Go on, or off.

        Args:
            t: Time, s.

        Raises:
            ControlError: If it does so again and again.
        """
        self.times.append(t)
        self.armed = False
        if len(self.times) > CHATTER and t - self.times[-1 - CHATTER] < self._dt:
            raise ControlError(
                f"event '{self.event.name}' has gone on and off {CHATTER} times within "
                f"{t - self.times[-1 - CHATTER]:.3g} s before t = {t:.9g}; its conditions 'when' "
                "and 'until' must be further apart"
            )

    @property
    def windows(self) -> list[tuple[float, float]]:
        """Windows of time in which it is on, s."""
        ends = [*self.times[1::2], math.inf]
        return list(zip(self.times[::2], ends, strict=False))


def comes_soon(start: Floats, end: Floats, dt: float, least: float) -> bool:
    """Decide whether a margin that goes on as in a step will cross zero too soon behind it.

    Args:
        start: Margins at its start.
        end: At its end, below zero.
        dt: Its length, s.
        least: What is too soon, s.
    """
    rising = (end > start) & np.isfinite(start)
    rise = end[rising] - start[rising]
    return bool(np.any(-end[rising] * dt < least * rise))


def turning_point(
    before: Floats, start: Floats, end: Floats, steps: tuple[float, float]
) -> float | None:
    """Find where in a step the first of several margins turns at zero or above, by what is known.

    Between two ends below zero, by the parabola through the end before; one that stays below zero
    by a quarter of its own rise is looked at too, as that is only so good.

    Args:
        before: Margins at the start of the step before.
        start: At the start of the step.
        end: At its end, below zero.
        steps: Lengths of both, s.

    Returns:
        The part of the step up to there, s; None where none does.
    """
    first, last = steps
    found = []
    for values in zip(before, start, end, strict=True):
        if not np.all(np.isfinite(values)):
            continue
        a, b, c = (float(v) for v in values)
        slope = (c - b) / last
        bend = (slope - (b - a) / first) / (first + last)
        part = last / 2 - slope / (2 * bend) if bend < 0 else 0.0
        if 0 < part < last:
            top = b + part * slope + part * (part - last) * bend
            if top + (top - max(b, c)) / 4 >= 0:
                found.append(part)
    return min(found, default=None)


def first_crossing(
    margins: Callable[[float], Floats],
    start: Floats,
    end: Floats,
    dt: float,
    tolerance: float,
    least: float = 0.0,
) -> tuple[float, Floats]:
    """Find where in a step the first of several margins comes up to zero.

    By the secant, with the Illinois rule against an end that stays (M. Dowell, P. Jarratt, BIT 11
    (1971) 168-174), and by bisection where two points have not halved what is left. Each point is
    at least the tolerance off both ends, so that what is left in the end is no more.

    Args:
        margins: Margins at a part of the step, s.
        start: At its start, below zero.
        end: At its end, one of them at least zero.
        dt: Its length, s.
        tolerance: By how much later the crossing may be found, s.
        least: Least length of a step, s.

    Returns:
        The length of the step in which it happens, s, and the margins at its end.
    """
    low, high, before, behind = 0.0, dt, start.copy(), end
    weight, stayed, widths = np.ones(2), 0, [math.inf, math.inf]
    for _ in range(MOST):
        if high - max(low, least if low == 0 else 0.0) <= tolerance:
            break
        slow, widths = high - low > widths[0] / 2, [widths[1], high - low]
        crossing = behind >= 0
        a, b = weight[0] * before[crossing], weight[1] * behind[crossing]
        part = float(np.min(a / (a - b))) if np.all(a < 0) else 0.0
        off = min(tolerance, (high - low) / 2)
        middle = min(max(low + part * (high - low), low + off), high - off)
        if slow:
            middle = (low + high) / 2
        if low == 0:
            middle = max(middle, least)
        found = margins(middle)
        if np.any(found >= 0):
            high, behind = middle, found
            weight = np.array([weight[0] / 2 if stayed > 0 else 1.0, 1.0])
            stayed = 1
        else:
            low, before = middle, found
            weight = np.array([1.0, weight[1] / 2 if stayed < 0 else 1.0])
            stayed = -1
    return high, behind
