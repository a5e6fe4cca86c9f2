"""Planar linkages with one freedom: their equation of motion, integrated by SciPy.

Nothing is shared with a formulation in directors and multipliers. The angle of the crank is the
only unknown, `M(a) a'' + M'(a) a'^2 / 2 + V'(a) = 0`, and a complex step derives M and V exactly.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from shellmb.arrays import Floats

STEP, TOLERANCE, GRAVITY = 1e-30, 1e-12, 9.81
# points as complex numbers are of no use to complex steps: vectors are pairs
type Pair = tuple[Any, Any]


@dataclass(frozen=True)
class Bar:
    """A homogeneous thin bar at an angle of the crank.

    Args:
        mass: Its mass, kg.
        length: Its length, m.
        centre: Its centre, m.
        moved: Derivative of the centre by the angle of the crank, m.
        turned: Derivative of its angle by that.
    """

    mass: float
    length: float
    centre: Pair
    moved: Pair
    turned: Any


def fall(bars: Callable[[Any], list[Bar]], angle: float, time: Floats) -> Floats:
    """Angles of the crank of a linkage that is let go, shape (n,), rad.

    Args:
        bars: The bars at an angle of the crank; gravity acts along -y.
        angle: Angle at the start, rad.
        time: Instants, s.
    """

    def inertia(a: Any) -> Any:
        return sum(
            b.mass * (b.moved[0] ** 2 + b.moved[1] ** 2 + b.length**2 * b.turned**2 / 12)
            for b in bars(a)
        )

    def potential(a: Any) -> Any:
        return sum(b.mass * GRAVITY * b.centre[1] for b in bars(a))

    def slope(function: Callable[[Any], Any], a: float) -> float:
        return float(np.imag(function(a + STEP * 1j)) / STEP)

    def rates(_: float, y: Floats) -> Floats:
        a, rate = y
        force = -slope(inertia, a) * rate**2 / 2 - slope(potential, a)
        return np.array([rate, force / float(np.real(inertia(a)))])

    found = solve_ivp(
        rates,
        (0.0, time[-1]),
        [angle, 0.0],
        method="DOP853",
        t_eval=time,
        rtol=TOLERANCE,
        atol=TOLERANCE,
    )
    return np.asarray(found.y[0])


@dataclass(frozen=True)
class CrankAndCoupler:
    """A slider-crank, its slider a point mass on the x axis behind the crank.

    Args:
        crank: Length of the crank, m.
        coupler: Length of the coupler, m.
        masses: Of crank, coupler and slider, kg.
    """

    crank: float = 0.2
    coupler: float = 0.4
    masses: tuple[float, float, float] = (1.0, 1.0, 0.5)

    def points(self, a: Any) -> tuple[Pair, Pair]:
        """The pin and the slider at an angle of the crank, m."""
        r, length = self.crank, self.coupler
        x, y = r * np.cos(a), r * np.sin(a)
        return (x, y), (x + np.sqrt(length**2 - y**2), 0.0 * x)

    def bars(self, a: Any) -> list[Bar]:
        """Crank, coupler and slider."""
        r, length = self.crank, self.coupler
        (x, y), (s, _) = self.points(a)
        turned = -x / (s - x)
        # s = x + sqrt(l^2 - y^2), and the coupler's angle is that of (s - x, -y)
        slid = -y + y * turned
        one, two, three = self.masses
        return [
            Bar(one, r, (x / 2, y / 2), (-y / 2, x / 2), 1.0),
            Bar(two, length, ((x + s) / 2, y / 2), ((slid - y) / 2, x / 2), turned),
            Bar(three, 0.0, (s, 0.0 * s), (slid, 0.0), 0.0),
        ]


@dataclass(frozen=True)
class FourBar:
    """Crank from the origin, coupler, and a rocker on the x axis.

    Args:
        crank: Length of the crank, m.
        coupler: Length of the coupler, m.
        rocker: Length of the rocker, m.
        base: Distance of both bearings, m.
        masses: Of crank, coupler and rocker, kg.
    """

    crank: float = 0.2
    coupler: float = 0.4
    rocker: float = 0.3
    base: float = 0.4
    masses: tuple[float, float, float] = (1.0, 2.0, 1.5)

    def points(self, a: Any) -> tuple[Pair, Pair]:
        """Both ends of the coupler, m; the rocker above the base where the crank is at zero."""
        x, y = self.crank * np.cos(a), self.crank * np.sin(a)
        along = (self.base - x, -y)
        square = along[0] ** 2 + along[1] ** 2
        part = (self.coupler**2 - self.rocker**2 + square) / (2 * square)
        off = np.sqrt(self.coupler**2 / square - part**2)
        return (x, y), (
            x + part * along[0] - off * along[1],
            y + part * along[1] + off * along[0],
        )

    def bars(self, a: Any) -> list[Bar]:
        """Crank, coupler and rocker."""
        (x, y), (u, v) = self.points(a)
        coupler, rocker = (u - x, v - y), (u - self.base, v)

        def across(one: Pair, two: Pair) -> Any:
            """Product of a vector turned by a quarter with another one."""
            return -one[1] * two[0] + one[0] * two[1]

        turned = -across((x, y), rocker) / across(coupler, rocker)
        swung = across((x, y), coupler) / across(rocker, coupler)
        moved = (-swung * rocker[1], swung * rocker[0])
        one, two, three = self.masses
        return [
            Bar(one, self.crank, (x / 2, y / 2), (-y / 2, x / 2), 1.0),
            Bar(
                two,
                self.coupler,
                ((x + u) / 2, (y + v) / 2),
                ((moved[0] - y) / 2, (moved[1] + x) / 2),
                turned,
            ),
            Bar(
                three,
                self.rocker,
                ((self.base + u) / 2, v / 2),
                (moved[0] / 2, moved[1] / 2),
                swung,
            ),
        ]
