"""First guess of derivatives of a step: those of the two steps before it, extrapolated."""

from __future__ import annotations

import numpy as np

from shellmb.arrays import Floats


class Predictor:
    """Extrapolates the derivatives of unknowns along a line.

    Derivatives of motions are so known to a tenth. Those of forces are not at all, as they vibrate,
    whatever the degree: the degree that did best so far saves no iteration beside this one (EP, ED,
    EP4 with 6x2 elements; with 32x32 it takes 4.85 in place of 4.7 of EP).
    """

    def __init__(self) -> None:
        self._past: list[tuple[Floats, float]] = []

    def next(self, size: int, dt: float) -> Floats:
        """Derivatives at the end of a step.

        Args:
            size: How many.
            dt: Its length, s.
        """
        if not self._past:
            return np.zeros(size)
        (last, length), (before, _) = self._past[0], self._past[-1]
        return np.asarray(last + (dt / length) * (last - before))

    def found(self, derivatives: Floats, dt: float) -> None:
        """Remember those of the step.

        Args:
            derivatives: They.
            dt: Length of the step, s.
        """
        self._past = [(derivatives, dt), *self._past[:1]]
