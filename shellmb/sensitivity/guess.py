"""First guess of derivatives of a step: those of the steps before it, extrapolated."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from shellmb.simulate.predictor import weights

Floats = npt.NDArray[np.float64]

# derivatives of so many steps are kept: polynomials of degree 0, 1, 2, 3 in time
STATES = 4
# share of the last error in the mean that tells which degree does best
MEMORY = 0.5


class Guess:
    """Extrapolates the derivatives of unknowns by the degree that did best so far."""

    def __init__(self) -> None:
        self._past: list[Floats] = []
        self._times: list[float] = []
        self._errors: list[float] = []

    def next(self, size: int, dt: float) -> Floats:
        """Derivatives at the end of a step.

        Args:
            size: How many.
            dt: Its length, s.
        """
        if not self._past:
            self._made = np.zeros((1, size))
            return self._made[0]
        times = tuple(t / dt for t in self._times)
        self._made = weights(times) @ np.array(self._past)
        known = self._errors[: len(self._made)]
        return np.asarray(self._made[known.index(min(known)) if known else 0])

    def found(self, derivatives: Floats, weight: Floats, dt: float) -> None:
        """Remember those of the step.

        Args:
            derivatives: They.
            weight: One over the size of each unknown.
            dt: Length of the step, s.
        """
        wrong = np.abs((self._made - derivatives) * weight).max(axis=1, initial=0.0).tolist()
        if self._past:
            old = self._errors
            mean = [MEMORY * e + (1 - MEMORY) * b for e, b in zip(wrong, old, strict=False)]
            self._errors = [*mean, *wrong[len(old) :]]
        self._past = [derivatives.copy(), *self._past[: STATES - 1]]
        self._times = [0.0, *(t - dt for t in self._times)][:STATES]
