"""Springs, dampers and motors on a scalar coordinate of a mechanism.

All are written in the coordinate `x` itself, an unknown of the model, so that their virtual work is
`force dx`. The average force of a spring over a sub-interval is an exact discrete gradient of its
energy (eq. 21), with the jump of eq. (32) where the energy is convex: what is concave would gain.

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
from typing import NamedTuple

import ufl
from ufl.core.expr import Expr

from shellmb.forms.steps.discrete import gradient, stress_average

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
    U = linear_potential(k)
    return stress_average(slope(U, a), slope(U, b), beta)


def linear_jump(k: Expr, a: Expr, b: Expr) -> Expr:
    """Elastic part of `c^2`, eq. (34)."""
    return linear_potential(k)(b - a)


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
    return mean_slope(U, a, b, size) + beta * force_jump(U, a, b) / 2


def spring_jump(U: Potential, a: Expr, b: Expr) -> Expr:
    """Half the work of the force jump on the jump of the extension, eq. (34)."""
    return force_jump(U, a, b) * (b - a) / 2


def force_jump(U: Potential, a: Expr, b: Expr) -> Expr:
    """Change of the force that dissipates; nothing where the energy is concave: it would give."""
    change = slope(U, b) - slope(U, a)
    return ufl.conditional(ufl.gt(change * (b - a), 0), change, 0 * change)


class Stretch(NamedTuple):
    """Extension of a spring over a step that is quadratic in time (`forms.steps.path`).

    Args:
        start: At the start.
        chord: Its change.
        bow: `e_i + e_f - 2 <e>`, twice the bow of the path.
    """

    start: Expr
    chord: Expr
    bow: Expr


def linear_forces(k: Expr, e: Stretch, alpha: Expr) -> tuple[Expr, Expr]:
    """Force of a linear spring, `S_0 + S_1 P1` of eq. (Q3)."""
    U, mean = linear_potential(k), e.start + (e.chord - e.bow) / 2
    return slope(U, mean), slope(U, (e.chord + alpha * e.bow) / 2)


def spring_forces(U: Potential, e: Stretch, alpha: Expr, size: Expr) -> tuple[Expr, Expr]:
    """Forces of any spring over a step, with which the energy law (Q5) is exact.

    The slopes along the path, projected on linear functions of time, and the small correction that
    makes their work the change of the energy.

    Args:
        U: Energy.
        e: Extension.
        alpha: Dissipation.
        size: Size of the coordinate.
    """
    first, second = 0 * e.start, 0 * e.start
    for g, weight in GAUSS:
        tau = (1 + g) / 2
        force = slope(U, e.start + tau * e.chord + 3 * (tau**2 - tau) * e.bow)
        first, second = first + weight * force, second + 3 * g * weight * force
    energy = ufl.as_ufl(U(e.start + e.chord)) - ufl.as_ufl(U(e.start))
    defect = energy - first * e.chord - second * e.bow
    ratio = defect / (e.chord**2 + e.bow**2 + (SMALL_INCREMENT**2 * size) ** 2)
    damping = alpha / 2 * stiffness(U, e) * e.bow
    return first + ratio * e.chord, second + ratio * e.bow + damping


def stiffness(U: Potential, e: Stretch) -> Expr:
    """Stiffness by which the dissipation of a spring is measured, where it is positive."""
    middle = ufl.variable(e.start + e.chord / 2)
    k = ufl.diff(ufl.diff(ufl.as_ufl(U(middle)), middle), middle)
    return ufl.conditional(ufl.gt(k, 0), k, 0 * e.start)
