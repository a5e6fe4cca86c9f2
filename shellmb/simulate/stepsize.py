"""Size of the time step: halved where Newton fails, and grown back; or by its jump or error.

Times of equal steps are counted, and some end exactly where they must: at times of locks, corners
of loads and motions, samples of controllers, the end, and what a user names.
"""

import math
import sys
from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

from shellmb.restart import Restartable
from shellmb.scene import Scene, StepControl
from shellmb.scene.checks.schemes import corners

# no step is shorter than that, in steps: round-off of positions over its square is one of forces
LEAST = 1e-3
# nor is one that is left before a time at which steps end: what velocities of EP are off by joints
# over the step is a force (a pendulum's hinge has -0.04 N for 0.7 N in a hundredth of a step)
SHORT = 0.1
# smallest step relative to the nominal one, if the scene does not say
DEFAULT_SMALLEST = 1 / 1024
# of statics, before any load acts, and in parts of the load that acts
FIRST_LOAD, NEXT_LOAD = 2.0**-30, 1 / 16
# what goes astray in a small part of the load does so in any: it snaps through
SMALL_LOAD = 1 / 32

# the jump between the states j and i is `-dt^2/6` times the acceleration, eq. (31)
JUMP_ORDER = 2
SAFETY = 0.9


@dataclass
class StepSize(Restartable):
    """The step size, as it changes.

    Args:
        settings: Settings of the scene.
        nominal: The scene's step, s.

    Attributes:
        dt: Step to try next, s.
        good: Number of accepted steps since the last change.
        rejected: Number of rejected steps.
        least_rest: Least part of a step that may be left before a time at which steps end.
    """

    least_rest: ClassVar[float] = SHORT
    settings: StepControl
    nominal: float
    remembered: ClassVar[tuple[str, ...]] = ("dt", "good", "rejected")

    def __post_init__(self) -> None:
        self.dt = min(self.nominal, self.largest)
        self.good = 0
        self.rejected = 0
        # the longest step tried from the current state, whether longer ones are being tried, and
        # the shortest one that failed
        self._tried, self._lengthened, self._shortest = 0.0, False, math.inf

    @property
    def largest(self) -> float:
        """Largest step, s."""
        return self.settings.max_dt or self.nominal

    @property
    def smallest(self) -> float:
        """Smallest step, s."""
        return self.settings.min_dt or DEFAULT_SMALLEST * self.nominal

    def reject(self, dt: float, measured: float | None = None) -> bool:
        """Shrink the step after a failure at `dt`; False if it was the smallest already.

        Args:
            dt: The step that failed, s.
            measured: What was too large; None: Newton's method failed.
        """
        self.rejected += 1
        self.good = 0
        self._shortest = min(self._shortest, dt)
        if not self._lengthened:
            self._tried = max(self._tried, dt)
        # what was tried before is not tried again
        floor = self._tried if self._lengthened else self.smallest
        if dt <= floor * (1 + 1e-9):
            return False
        self.dt = max(self.settings.shrink * dt, self.smallest)
        return not self._lengthened or self.dt > floor * (1 + 1e-9)

    def _within(self, dt: float) -> float:
        """A step, or the smallest or the largest one, s."""
        return min(max(dt, self.smallest), self.largest)

    def failed(self, dt: float) -> str:
        """The step that failed last, s, and the shortest one that did from this state, in words."""
        shorter = f", and those down to {self._shortest:g}" if self._shortest < dt else ""
        return f"dt = {dt:g}{shorter}"

    def lengthen(self) -> bool:
        """Try longer steps than any so far from this state; False if there are none.

        Where the steps before ended at a singular position, a dead point say, shorter ones come
        nearer to it and never pass it. Longer ones do. A limit on the jump forbids them.
        """
        if self.settings.jump_tolerance is not None or self._lengthened:
            return False
        if not 0 < self._tried < self.largest * (1 - 1e-9):
            return False
        self._lengthened, self.dt = True, self.largest
        return True

    def accept(self, measured: float | None, dt: float = 0.0) -> None:
        """Grow the step after success: by the jump if it controls, else after some good steps.

        Args:
            measured: The jump, if there is one.
            dt: The step, s.
        """
        self.good += 1
        self._tried, self._lengthened, self._shortest = 0.0, False, math.inf
        tolerance = self.settings.jump_tolerance
        if tolerance is not None and measured is not None:
            factor = SAFETY * (tolerance / max(measured, 1e-300)) ** (1 / JUMP_ORDER)
            self.dt = self._within(self._moderate(factor) * self.dt)
        elif self.good >= self.settings.patience and self.dt < self.largest:
            self.dt = min(self.settings.growth * self.dt, self.largest)
            self.good = 0

    def _moderate(self, factor: float) -> float:
        """A factor on the step that neither grows nor shrinks it by more than it may."""
        return min(self.settings.growth, max(self.settings.shrink, factor))

    def too_large(self, measured: float | None, dt: float = 0.0) -> bool:
        """Decide whether a step must be repeated because of its jump; arguments as of `accept`."""
        tolerance = self.settings.jump_tolerance
        return tolerance is not None and measured is not None and measured > tolerance


@dataclass
class LoadSize(StepSize):
    """The step of a load in statics: as long as hardly any of it acts, far smaller ones are tried.

    What has next to no bending stiffness, a cable or a membrane, is stiff by the load it carries:
    it moves far under the first of it.
    """

    remembered = (*StepSize.remembered, "_reached")

    def __post_init__(self) -> None:
        super().__post_init__()
        # load that acts
        self._reached = 0.0

    @property
    def smallest(self) -> float:
        """Smallest step."""
        if self.settings.min_dt:
            return self.settings.min_dt
        begins = max(FIRST_LOAD * self.nominal, NEXT_LOAD * self._reached)
        return min(DEFAULT_SMALLEST * self.nominal, begins)

    def too_large(self, measured: float | None, dt: float = 0.0) -> bool:
        """Decide whether a load is taken in parts, as Newton's method may have gone astray."""
        return measured is not None and measured > 1 and dt > SMALL_LOAD * self.nominal

    def accept(self, measured: float | None, dt: float = 0.0) -> None:
        """Grow the step after success."""
        super().accept(None, dt)
        self._reached += dt


# Tolerance that the scene's step is thought to be for. The first steps have none before them by
# which their error is known where a force begins to act; for smaller tolerances they are shorter
USUAL = 1e-4
# the ratio that is wanted
AIM = 0.5
INTEGRAL, PROPORTIONAL = 0.3, 0.4
# schemes of third order and more take so many times the steps: what a few radians cost then adds up
# to the tolerance, which is asked of them for small errors over long motions
MORE = 1.4
# steps are kept where the one that is wanted is within these factors
KEEP = (0.85, 1.2)
# least factor on a step, also where it is rejected
LEAST_FACTOR = 0.2
# smallest step over the first one, and largest one over the run, if the scene does not say
SMALLEST, LARGEST = 1e-5, 0.05
# a step shorter by more than this ends early
EARLY = 0.99
# what a restart needs beyond that of other sizes
KEPT = ("worst", "coarse", "shortest", "longest", "total", "lag", "_before", "_after_rejection")
# ratios below it say no more than that steps may grow
NOTHING = 1e-10


@dataclass
class ErrorSize(StepSize):
    """The step size that follows its error, by a proportional and integral controller.

    With the ratio `r` of the error (`StepErrors`) to the tolerance, which is of the order p of the
    scheme in the step, the next step is

        h_next = h (AIM/r)^(kI) (r_before/r)^(kP),   kI = 0.3/p,   kP = 0.4/p

    (K. Gustafsson, ACM Trans. Math. Softw. 17 (1991) 533-554; G. Soederlind, Numer. Algorithms 31
    (2002) 281-310). The part with the ratio before, which a plain controller has not, keeps it from
    steps that alternate. Steps that are nearly as wanted stay: a change costs a factorisation.

    Args:
        t_end: Length of the run, s.
        order: Order of the scheme.
        noise: Error that Newton's method may leave: no smaller one can be requested.
        factor: Of the error, `factor angle^order`, with the equivalent angle of a step.

    Attributes:
        worst: Largest error of an accepted step.
        coarse: Number of those that were accepted with too large an error, being the smallest.
        shortest: Shortest accepted step that did not end early, s; infinite before there is one.
        longest: Longest one, s.
        total: What the errors of all steps may add up to: each has so much per radian, times its
            angle.
        lag: What a spinning body is behind by besides, where each step takes as much of its speed.
    """

    # two steps of the same length in place of a long one and what is left
    least_rest: ClassVar[float] = 1.0
    t_end: float = 1.0
    order: int = 2
    noise: float = 0.0
    factor: float = 1.0
    remembered: ClassVar[tuple[str, ...]] = (*StepSize.remembered, *KEPT)

    def __post_init__(self) -> None:
        """Begin with the scene's step, or a shorter one."""
        super().__post_init__()
        usual = (self.settings.step_error or USUAL) / USUAL
        self.dt = max(min(usual ** (1 / self.order), 1.0) * self.nominal, self.smallest)
        self.worst = self.longest = self.total = self.lag = 0.0
        self.coarse, self.shortest = 0, math.inf
        self._before, self._after_rejection = AIM, False

    @property
    def largest(self) -> float:
        """Largest step, s."""
        return self.settings.max_dt or max(self.nominal, LARGEST * self.t_end)

    @property
    def smallest(self) -> float:
        """Smallest step, s."""
        return self.settings.min_dt or SMALLEST * self.nominal

    @property
    def radians(self) -> float:
        """Rotation that may cost a tolerance: 3 to 4 radians in schemes of higher order, else 1."""
        return float(MORE**self.order) if self.order > 2 else 1.0

    def _ratio(self, error: float) -> float:
        """Ratio of the error of a step to what it may be."""
        assert self.settings.step_error is not None
        return max(error / max(self.settings.step_error / self.radians, self.noise), NOTHING)

    def too_large(self, measured: float | None, dt: float = 0.0) -> bool:
        """Decide whether a step must be repeated with a smaller one, because of its error."""
        return measured is not None and self._ratio(measured) > 1

    def reject(self, dt: float, measured: float | None = None) -> bool:
        """Shrink the step after a failure, or by its error; False if it was the smallest."""
        if not super().reject(dt):
            return False
        self._after_rejection = True
        if measured is not None:
            factor = (AIM / self._ratio(measured)) ** (1 / self.order)
            self.dt = max(min(max(factor, LEAST_FACTOR), KEEP[0]) * dt, self.smallest)
        return True

    def lengthen(self) -> bool:
        """Longer steps would be off by more."""
        return False

    def accept(self, measured: float | None, dt: float = 0.0) -> None:
        """Take the next step by the error of this one and of the one before."""
        self.good += 1
        self._tried = 0.0
        assert measured is not None
        ratio = self._ratio(measured)
        self.worst, self.longest = max(self.worst, measured), max(self.longest, dt)
        self.coarse += measured > (self.settings.step_error or math.inf)
        angle = (measured / self.factor) ** (1 / self.order)
        self.lag += self.total * angle
        self.total += measured * angle
        if dt < EARLY * self.dt and ratio <= 1:
            # it ended early, which says nothing against the step before
            return
        self.shortest = min(self.shortest, dt)
        before, self._before = self._before, ratio
        # where a step was cut by a rejection the next one does not grow again
        most = 1.0 if self._after_rejection else self.settings.growth
        self._after_rejection = False
        if KEEP[0] <= (AIM / ratio) ** (1 / self.order) <= KEEP[1]:
            return
        factor = (AIM / ratio) ** (INTEGRAL / self.order)
        factor *= (before / ratio) ** (PROPORTIONAL / self.order)
        self.dt = self._within(min(max(factor, LEAST_FACTOR), most) * dt)


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
