"""Isotropic plates: rectangles on simple supports, and circles, under uniform and point loads.

Reissner-Mindlin theory with hard simple supports (the tangential rotation vanishes along the
edge). The thin plate is the same formula with `shear_correction=math.inf`.

Sources: Timoshenko & Woinowsky-Krieger, Theory of Plates and Shells, 2nd ed. (1959), for thin
plates; Mindlin, J. Appl. Mech. 18 (1951) 31-38, for shear and rotary inertia.
"""

import math
from dataclasses import dataclass

import numpy as np

from shellmb.arrays import Floats

# The double series are summed over odd numbers below this. Their terms alternate, the slowest
# (shear deflection, moments) fall like n^-3: what is left out is below 1e-9 of the sum.
TERMS = 1000
# Single series of positive terms falling like n^-3: 1e-11 of the sum is left out.
LONG = 200_000


@dataclass(frozen=True)
class Plate:
    """An isotropic plate of constant thickness.

    Args:
        E: Young's modulus, Pa.
        nu: Poisson's ratio.
        thickness: Thickness h, m.
        density: Mass per volume, kg/m^3.
        shear_correction: Shear correction factor kappa; `math.inf` for the thin plate.
    """

    E: float
    nu: float
    thickness: float
    density: float = 0.0
    shear_correction: float = 5 / 6

    @property
    def bending(self) -> float:
        """Bending stiffness `D = E h^3 / (12 (1 - nu^2))`, N m."""
        return self.E * self.thickness**3 / (12 * (1 - self.nu**2))

    @property
    def shear(self) -> float:
        """Transverse shear stiffness `kappa G h`, N/m; infinite for the thin plate."""
        return self.shear_correction * self.E / (2 * (1 + self.nu)) * self.thickness


def double_series(a: float, b: float) -> tuple[Floats, Floats, Floats]:
    """Wave numbers `pi m / a`, `pi n / b`, and `sin sin / (m n)` at the centre, odd m and n."""
    odd = np.arange(1.0, TERMS, 2.0)
    m, n = np.meshgrid(odd, odd, indexing="ij")
    sign = np.where((m + n) % 4 == 2, 1.0, -1.0)
    return math.pi * m / a, math.pi * n / b, sign / (m * n)


def rectangle_uniform_deflection(plate: Plate, a: float, b: float, q: float) -> float:
    """Centre deflection of a simply supported rectangle under a uniform load.

    Navier's double series (Timoshenko art. 30), with the deflection by shear added.

    Args:
        plate: The plate.
        a: Length of the first side, m.
        b: Length of the second side, m.
        q: Load per area, Pa.

    Returns:
        Deflection, m.
    """
    alpha, beta, weight = double_series(a, b)
    k2 = alpha**2 + beta**2
    terms = weight / k2 * (1 / (plate.bending * k2) + 1 / plate.shear)
    return float(16 * q / math.pi**2 * terms.sum())


def rectangle_point_deflection(plate: Plate, a: float, b: float, force: float) -> float:
    """Deflection under a point force at the centre of a simply supported thin rectangle.

    Levy's single series (Timoshenko art. 34). With shear the deflection under the force is
    infinite, so that there is no such value for a thick plate.

    Args:
        plate: The plate; its shear stiffness is not used.
        a: Length of the first side, m.
        b: Length of the second side, m.
        force: Point force, N.

    Returns:
        Deflection, m.
    """
    m = np.arange(1.0, LONG, 2.0)
    s = np.pi * m * b / (2 * a)
    # beyond 300 cosh overflows, and the quotient is zero to all digits long before
    quotient = s / np.cosh(np.minimum(s, 300.0)) ** 2
    terms = (np.tanh(s) - quotient) / m**3
    return float(force * a**2 / (2 * math.pi**3 * plate.bending) * terms.sum())


def circle_uniform_deflection(
    plate: Plate, radius: float, q: float, clamped: bool, r: float = 0.0
) -> float:
    """Deflection of a clamped or simply supported circle under a uniform load.

    Timoshenko arts. 16 and 20; shear adds `q (a^2 - r^2) / (4 kappa G h)` in both cases.

    Args:
        plate: The plate.
        radius: Radius a, m.
        q: Load per area, Pa.
        clamped: Whether the edge is clamped; else it is simply supported.
        r: Distance from the centre at which the deflection is taken, m.

    Returns:
        Deflection, m.
    """
    inner = radius**2 - r**2
    factor = 1.0 if clamped else (5 + plate.nu) / (1 + plate.nu)
    by_bending = q * inner * (factor * radius**2 - r**2) / (64 * plate.bending)
    return by_bending + q * inner / (4 * plate.shear)


def circle_point_deflection(
    plate: Plate, radius: float, force: float, clamped: bool, r: float = 0.0
) -> float:
    """Deflection of a thin circular plate under a point force at its centre.

    Timoshenko art. 19. With shear the deflection under the force is infinite.

    Args:
        plate: The plate; its shear stiffness is not used.
        radius: Radius a, m.
        force: Point force, N.
        clamped: Whether the edge is clamped; else it is simply supported.
        r: Distance from the centre at which the deflection is taken, m.

    Returns:
        Deflection, m.
    """
    factor = 1.0 if clamped else (3 + plate.nu) / (1 + plate.nu)
    # r^2 log(r) tends to zero at the force
    logarithm = 2 * r**2 * math.log(r / radius) if r > 0 else 0.0
    shape = factor * (radius**2 - r**2) + logarithm
    return force * shape / (16 * math.pi * plate.bending)
