"""Functions of time for loads and prescribed motions: any ``f(t) -> float``, or one of these.

These know their ``corners``, the times [s] at which they or their rates jump. A function of the
user's may have such an attribute, too.
"""

import math
from collections.abc import Callable

import numpy as np

from shellmb.scene.types import Finite, Listed, Positive
from shellmb.scene.values.validate import Sentences, described

type TimeFunction = Callable[[float], float]


@described("step")
class Step:
    """0 before ``start``, 1 from then on.

    Args:
        start: Time of the jump [s].
    """

    start: Finite = 0.0

    @property
    def corners(self) -> tuple[float, ...]:
        """The jump [s]."""
        return (self.start,)

    def __call__(self, t: float) -> float:
        """Value at time ``t`` [s]."""
        return 1.0 if t >= self.start else 0.0


@described("ramp")
class Ramp:
    """0 before ``start``, then linear, 1 after ``duration``.

    Args:
        duration: Time from 0 to 1 [s].
        start: Time at which the ramp begins [s].
    """

    duration: Positive
    start: Finite = 0.0

    @property
    def corners(self) -> tuple[float, ...]:
        """Begin and end of the slope [s]."""
        return self.start, self.start + self.duration

    def __call__(self, t: float) -> float:
        """Value at time ``t`` [s]."""
        return min(max((t - self.start) / self.duration, 0.0), 1.0)


@described("time table")
class Table:
    """Straight lines between given values, constant before the first and after the last.

    Args:
        times: Increasing times [s].
        values: The value at each time.
    """

    times: Listed[Finite]
    values: Listed[Finite]

    def _wrong(self) -> Sentences:
        """Check that the table is one."""
        if not self.times or len(self.times) != len(self.values):
            yield (
                f"it has {len(self.times)} times and {len(self.values)} values; it must have as "
                "many of each, and one at least"
            )
        for a, b in zip(self.times, self.times[1:], strict=False):
            if not b > a:
                yield f"time {b:g} follows {a:g}; times must increase"

    @property
    def corners(self) -> tuple[float, ...]:
        """All its times [s]."""
        return self.times

    def __call__(self, t: float) -> float:
        """Value at time ``t`` [s]."""
        return float(np.interp(t, self.times, self.values))


@described("sine")
class Sine:
    """``sin(2 pi frequency (t - start) + phase)`` from ``start`` on, 0 before.

    Args:
        frequency: Cycles per second [Hz].
        phase: Phase at ``start`` [rad].
        start: Time at which the oscillation begins [s].
    """

    frequency: Positive
    phase: Finite = 0.0
    start: Finite = 0.0

    @property
    def corners(self) -> tuple[float, ...]:
        """The begin [s]."""
        return (self.start,)

    def __call__(self, t: float) -> float:
        """Value at time ``t`` [s]."""
        if t < self.start:
            return 0.0
        return math.sin(2 * math.pi * self.frequency * (t - self.start) + self.phase)
