"""The penalty of a contact in numbers, with its derivatives by the distance (`forms.contact`)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from shellmb.arrays import Floats, Ints


class Penalty(NamedTuple):
    """Energy of a penetration, of a distance.

    Args:
        reach: Distance at which contact begins, m.
        stiffness: Stiffness of each point, shape (n,), N/m.
        smoothing: Penetration over which the stiffness sets in, m; 0: at once.
    """

    reach: float
    stiffness: Floats
    smoothing: float

    def only(self, which: Ints) -> Penalty:
        """Law of some of the points."""
        return self._replace(stiffness=self.stiffness[which])

    def __call__(self, g: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Energy and three derivatives at distances, shape (n, ...) each."""
        k = self.stiffness.reshape(-1, *(1,) * (g.ndim - 1))
        p, s = self.reach - g, self.smoothing
        rising = (p > 0) & (p < s)
        size = s or 1.0
        energy = k * np.where(rising, p**3 / (6 * size), ((p - s / 2) ** 2 + s**2 / 12) / 2)
        force = k * np.where(rising, p**2 / (2 * size), p - s / 2)
        slope = k * np.where(rising, p / size, 1.0)
        bend = k * np.where(rising, 1 / size, 0.0)
        touches = np.where(p > 0, 1.0, 0.0)
        return touches * energy, -touches * force, touches * slope, -touches * bend
