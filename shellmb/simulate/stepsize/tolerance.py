"""Size of the time step that follows its error, by a proportional and integral controller.

With the ratio `r` of the error (`errors`) to the tolerance, which is of the order p of the scheme
in the step, the next step is

    h_next = h (AIM/r)^(kI) (r_before/r)^(kP),   kI = 0.3/p,   kP = 0.4/p

(K. Gustafsson, ACM Trans. Math. Softw. 17 (1991) 533-554; G. Soederlind, Numer. Algorithms 31
(2002) 281-310). The part with the ratio before, which a plain controller has not, keeps it from
steps that alternate. Steps that are nearly as wanted stay: a change costs a factorisation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar

from shellmb.simulate.stepsize.control import StepSize

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
LEAST = 0.2
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
    """The step size.

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
    worst: float = field(default=0.0, init=False)
    coarse: int = field(default=0, init=False)
    shortest: float = field(default=math.inf, init=False)
    longest: float = field(default=0.0, init=False)
    total: float = field(default=0.0, init=False)
    lag: float = field(default=0.0, init=False)
    remembered: ClassVar[tuple[str, ...]] = (*StepSize.remembered, *KEPT)

    def __post_init__(self) -> None:
        """Begin with the scene's step, or a shorter one."""
        super().__post_init__()
        usual = (self.settings.step_error or USUAL) / USUAL
        self.dt = max(min(usual ** (1 / self.order), 1.0) * self.nominal, self.smallest)
        self._before = AIM
        self._after_rejection = False

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
            self.dt = max(min(max(factor, LEAST), KEEP[0]) * dt, self.smallest)
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
        self.dt = min(max(min(max(factor, LEAST), most) * dt, self.smallest), self.largest)
