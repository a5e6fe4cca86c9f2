"""Solutions of bundled scenes that are not ours: minimal coordinates, no forms, no constraints."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from shellmb.accuracy.studies.quantity import Quantity
from shellmb.arrays import Floats
from shellmb.demos import heavy_top, slider_crank

# points of a curve
POINTS = 2001


@dataclass(frozen=True)
class Solution:
    """A solution that is not ours: in closed form, or by another integrator of other equations.

    Args:
        source: What it is, in words.
        end: Time at the end, s.
        curve: Values of a column of the history at ascending times.
        uncertainty: How well it is known, relative.
    """

    source: str
    end: float
    curve: Callable[[str, Floats], Floats]
    uncertainty: float

    def take(self, quantity: Quantity) -> dict[str, Any]:
        """Record of it."""
        t = np.linspace(0.0, self.end, POINTS)
        return quantity.of_curve(t, self.curve(quantity.name, t))


def crank_torque(end: float) -> Solution:
    """Driving torque of the rigid slider-crank, by the dynamics of one degree of freedom.

    Args:
        end: Time at the end, s.
    """
    crank = slider_crank.scene().rigid_bodies[0]
    # a rod of some thickness, which is 7e-4 of the torque
    inertia = crank.inertia_tensor[2, 2] + crank.mass * np.dot(crank.position, crank.position)
    ideal = replace(slider_crank.IDEAL, crank_inertia=float(inertia))

    def curve(name: str, t: Floats) -> Floats:
        driven = slider_crank.crank(t)  # type: ignore[no-untyped-call]
        return np.asarray(ideal.motion(*driven).torque)

    return Solution("the mechanism in closed form", end, curve, uncertainty=1e-12)


def top_center(end: float) -> Solution:
    """Centre of the heavy top, by its equations of motion in quaternions.

    Args:
        end: Time at the end, s.
    """

    def curve(name: str, t: Floats) -> Floats:
        return np.asarray(heavy_top.exact(t.tolist())[:, "xyz".index(name)])

    # of an integration to 1e-13; half its steps agree to this
    return Solution("quaternions by scipy's DOP853", end, curve, uncertainty=1e-9)
