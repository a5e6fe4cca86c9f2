"""Size of the time step: halved where Newton fails or the jump is too large, then grown back."""

import math
from dataclasses import dataclass
from typing import ClassVar

from shellmb.restart import Restartable
from shellmb.scene import StepControl

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
        if self.settings.jump_tolerance is not None and measured is not None:
            self._follow(measured)
        elif self.good >= self.settings.patience and self.dt < self.largest:
            self.dt = min(self.settings.growth * self.dt, self.largest)
            self.good = 0

    def _follow(self, jump: float) -> None:
        tolerance = self.settings.jump_tolerance
        assert tolerance is not None
        factor = SAFETY * (tolerance / max(jump, 1e-300)) ** (1 / JUMP_ORDER)
        factor = min(self.settings.growth, max(self.settings.shrink, factor))
        self.dt = min(max(factor * self.dt, self.smallest), self.largest)

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
