"""Times of steps: equal ones are counted, and some end exactly where they must.

These are times of locks, corners of loads and motions, samples of controllers, the end, and what a
user names.
"""

import sys
from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache

from shellmb.restart import Restartable
from shellmb.scene import Scene
from shellmb.scene.checks.schemes import corners
from shellmb.simulate.stepsize import StepSize

# times that differ by this fraction of a step, or by so many spacings of floating-point numbers,
# are one: somebody has computed or written them down with fewer digits
NEAR, SPACINGS = 1e-6, 4


def near(t: float, dt: float) -> float:
    """Largest difference of times that are one, s.

    Args:
        t: Time, s.
        dt: Length of steps there, s.
    """
    return NEAR * dt + SPACINGS * sys.float_info.epsilon * abs(t)


@lru_cache
def rounded(dt: float) -> float:
    """A step without what round-off makes of steps of one length, s."""
    return float(f"{dt:.12g}")


@dataclass
class Count(Restartable):
    """Times of equal steps, `begin + steps dt`: round-off does not add up.

    Args:
        begin: Time of the first one's start, s.
        dt: Their length, s.
        steps: Their number so far.
    """

    begin: float = 0.0
    dt: float = 0.0
    steps: int = 0
    remembered = ("begin", "dt", "steps")

    def after(self, t: float, dt: float) -> float:
        """Count a step; time at its end, s.

        Args:
            t: Its start, s; another time than that of the last step's end begins a new count.
            dt: Its length, s; another one does, too.
        """
        if dt != self.dt or t != self.begin + self.steps * dt:
            self.begin, self.dt, self.steps = t, dt, 0
        self.steps += 1
        return self.begin + self.steps * dt


class Landing:
    """The times of a run at which steps must end.

    Corners count where steps follow their error: long ones could pass a whole load. Fixed steps are
    the user's, and so is what they do at a corner.

    Args:
        scene: The scene.
        events: Times at which something begins or ends to act, s.

    Attributes:
        times: All of them in their order, s.
    """

    def __init__(self, scene: Scene, events: Iterable[float]) -> None:
        self._nominal = scene.dt
        self._corners = tuple(corners(scene) if scene.step_control.step_error is not None else ())
        self.times = tuple(sorted({*events, *scene.step_control.times, *self._corners}))

    def step(
        self, t: float, t_end: float, sample: float, size: StepSize
    ) -> tuple[float, float | None]:
        """Length of the next step, s, and the time that it lands on, s; None: on none.

        Args:
            t: Its start, s.
            t_end: End of the run, s.
            sample: Time of the next sample of controllers, s.
            size: The step size.
        """
        end = min(self._after(t, (sample, t_end)), t_end)
        remaining = end - t
        if abs(remaining - size.dt) <= near(end, 0.0):
            # of the same length to the last bit: its matrix is known
            return size.dt, end
        if remaining <= size.dt + near(end, size.dt):
            return remaining, end
        # two equal steps instead of one and a rest that is too short
        return (remaining / 2 if remaining < (1 + size.least_rest) * size.dt else size.dt), None

    def _after(self, t: float, others: Sequence[float]) -> float:
        """The next of the times and of others, s; of several that are one the last."""
        k = bisect_right(self.times, t + near(t, self._nominal))
        first = min((*others, *self.times[k : k + 1]))
        reach = first + near(first, self._nominal)
        also = self.times[k : bisect_right(self.times, reach, k)]
        return max([first, *also[-1:], *(time for time in others if time <= reach)])

    def corner(self, t: float) -> bool:
        """Decide whether forces or motions have a corner at a time [s] that steps landed on."""
        off = near(t, self._nominal)
        return any(abs(t - corner) <= off for corner in self._corners)
