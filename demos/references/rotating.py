"""Closed forms and Ritz solutions of systems that turn steadily, in a frame that turns along.

Sources: R. V. Southwell and B. S. Gough, "The free transverse vibration of airscrew blades", ARC
R&M 766 (1921), and A. D. Wright, C. E. Smith, R. W. Thresher and J. L. C. Wang, "Vibration modes of
centrifugally stiffened beams", J. Appl. Mech. 49 (1982) 197-202, for beams; H. Lamb and R. V.
Southwell, "The vibrations of a spinning disk", Proc. R. Soc. A 99 (1921) 272-280, for discs.
"""

import numpy as np
from numpy.polynomial import Legendre
from scipy.linalg import eigh

from shellmb.arrays import Floats

# shifted Legendre polynomials times the square of the distance from the clamp
TERMS = 40


def flapping(eta: float, count: int = 3, hub: float = 0.0) -> Floats:
    """Frequencies of a thin cantilever across the plane in which it turns.

    Ritz' method for `int EI w''^2 + T w'^2` over `int m w^2` with the tension
    `T = m Omega^2 ((L^2 - x^2)/2 + r (L - x))`.

    Args:
        eta: Rate times `sqrt(m L^4/(E I))`.
        count: How many.
        hub: Radius `r` of the hub over the length.

    Returns:
        Frequencies times `sqrt(m L^4/(E I))`, ascending.
    """
    points, weights = np.polynomial.legendre.leggauss(2 * TERMS + 4)
    x, weights = (points + 1) / 2, weights / 2
    tension = eta**2 * ((1 - x**2) / 2 + hub * (1 - x))
    basis = [Legendre.basis(k, domain=[0, 1]) for k in range(TERMS)]
    P, dP, ddP = (np.array([p.deriv(n)(x) if n else p(x) for p in basis]) for n in range(3))
    shapes = x**2 * P, 2 * x * P + x**2 * dP, 2 * P + 4 * x * dP + x**2 * ddP

    def gram(order: int, factor: Floats) -> Floats:
        return np.asarray(shapes[order] * (weights * factor) @ shapes[order].T)

    one = np.ones_like(x)
    stiffness = gram(2, one) + gram(1, tension)
    return np.asarray(np.sqrt(eigh(stiffness, gram(0, one), eigvals_only=True)[:count]))


def lagging(eta: float, count: int = 3, hub: float = 0.0) -> Floats:
    """Frequencies in the plane, where the centrifugal force follows: `omega^2 - Omega^2`."""
    return np.asarray(np.sqrt(flapping(eta, count, hub) ** 2 - eta**2))


def spinning_membrane(diameters: int, circles: int, nu: float) -> float:
    """Square of the frequency of a free disc without bending stiffness, over that of the rate.

    The stresses of the rotation are `sigma_r = (3 + nu)/8 rho Omega^2 (a^2 - r^2)` and
    `sigma_t = rho Omega^2 ((3 + nu) a^2 - (1 + 3 nu) r^2)/8`. A deflection
    `r^n cos(n theta) (1 + ...)` with a polynomial of `s` terms in `r^2` ends with the power
    `n + 2 s`, whose coefficient gives `omega^2` (Lamb and Southwell).

    Args:
        diameters: Nodal diameters n.
        circles: Nodal circles s.
        nu: Poisson's ratio.
    """
    power = diameters + 2 * circles
    return (power * (power + 2) * (3 + nu) - diameters**2 * (1 + 3 * nu)) / 8


def sleeping_top(
    rate: float, across: float, along: float, weight: float
) -> tuple[complex, complex]:
    """Eigenvalues of a top that spins upright on its tip, in the frame that turns with it.

    With the tilt `z = x + i y` of its axis in space `A z'' - i C Omega z' - m g l z = 0`; in
    the frame `z = zeta exp(i Omega t)`. One of each conjugate pair is given.

    Args:
        rate: Its spin Omega, rad/s.
        across: Moment of inertia A about the tip across its axis, kg m^2.
        along: That about its axis, C, kg m^2.
        weight: Weight times the height of its centre, m g l, N m.
    """
    root = np.sqrt(complex((along * rate) ** 2 - 4 * across * weight))
    first, second = (1j * (along * rate + sign * root) / (2 * across) for sign in (-1, 1))
    return first - 1j * rate, second - 1j * rate
