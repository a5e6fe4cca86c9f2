"""Springs, dampers and motors on a scalar coordinate of a mechanism.

All are written in the coordinate `x` itself, an unknown of the model, so that their virtual work is
`force dx`. The average force of a spring over a sub-interval is an exact discrete gradient of its
energy (eq. 21), with the jump of eq. (32).

==========  =====================================================  ============
symbol      name                                                   unit
==========  =====================================================  ============
`x`         coordinate                                             rad or m
`U`         energy of a spring as a function of its extension      J
`k`         stiffness of a linear one                              N m or N/m
`beta`      share of the jump of the force, eq. (32)               -
==========  =====================================================  ============
"""

from collections.abc import Callable

import ufl
from ufl.core.expr import Expr

from .discrete import gradient, stress_average

Potential = Callable[[Expr], Expr]

# Gauss points on [-1, 1] with their weights: the mean slope of a polynomial of degree 8 is exact
GAUSS = (
    (-0.8611363115940526, 0.1739274225687269),
    (-0.3399810435848563, 0.3260725774312731),
    (0.3399810435848563, 0.3260725774312731),
    (0.8611363115940526, 0.1739274225687269),
)

# An increment below this part of the coordinate's size is left to Gauss' rule: its error, of the
# ninth order, is below round-off, while the quotient of two differences would lose digits.
SMALL_INCREMENT = 1e-4


def linear_potential(k: Expr) -> Potential:
    """Energy of a linear spring of stiffness `k`."""
    return lambda e: k * e**2 / 2


def linear_force(k: Expr, a: Expr, b: Expr, beta: Expr | float) -> Expr:
    """Average force of a linear spring between the extensions `a` and `b`."""
    return stress_average(k * a, k * b, beta)


def linear_jump(k: Expr, a: Expr, b: Expr) -> Expr:
    """Elastic part of `c^2`, eq. (34)."""
    return k * (b - a) ** 2 / 2


def slope(U: Potential, e: Expr) -> Expr:
    """Force `U'(e)`."""
    return gradient(lambda v: ufl.as_ufl(U(v)), e)


def mean_slope(U: Potential, a: Expr, b: Expr, size: Expr) -> Expr:
    """Discrete gradient: `mean_slope (b - a) = U(b) - U(a)`.

    Args:
        U: Energy.
        a: Extension at the start.
        b: Extension at the end.
        size: Size of the coordinate, of the same unit.
    """
    small = ufl.lt(abs(b - a), SMALL_INCREMENT * size)
    middle, half = (a + b) / 2, (b - a) / 2
    gauss = sum((w * slope(U, middle + g * half) for g, w in GAUSS), start=0 * a)
    quotient = (ufl.as_ufl(U(b)) - ufl.as_ufl(U(a))) / ufl.conditional(small, size, b - a)
    return ufl.conditional(small, gauss, quotient)


def spring_force(U: Potential, a: Expr, b: Expr, beta: Expr | float, size: Expr) -> Expr:
    """Average force of a spring between the extensions `a` and `b`, eqs. (21), (32)."""
    return mean_slope(U, a, b, size) + beta * (slope(U, b) - slope(U, a)) / 2


def spring_jump(U: Potential, a: Expr, b: Expr) -> Expr:
    """Half the work of the force jump on the jump of the extension, eq. (34)."""
    return (slope(U, b) - slope(U, a)) * (b - a) / 2
