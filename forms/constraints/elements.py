"""Springs, dampers and motors on a scalar coordinate of a mechanism.

All are written in the coordinate `x` itself, an unknown of the model, so that their virtual work is
`force dx`. Those of a spring with an energy of any form are in `forms.steps.potentials`.

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
from ufl.algorithms.ad import expand_derivatives
from ufl.core.expr import Expr

from shellmb.forms.steps.discrete import gradient

Potential = Callable[[Expr], Expr]

# Gauss points on [-1, 1] with their weights: the mean slope of a polynomial of degree 8 is exact
GAUSS = (
    (-0.8611363115940526, 0.1739274225687269),
    (-0.3399810435848563, 0.3260725774312731),
    (0.3399810435848563, 0.3260725774312731),
    (0.8611363115940526, 0.1739274225687269),
)

# An increment below this part of the coordinate's size is left to Gauss' rule: its error, of the
# ninth order, is below round-off, while a correction by differences of energies would lose digits.
SMALL_INCREMENT = 1e-4


def linear_potential(k: Expr) -> Potential:
    """Energy of a linear spring of stiffness `k`."""
    return lambda e: k * e**2 / 2


def linear_stiffness(k: Expr) -> Expr:
    """Second derivative of the energy of a linear spring."""
    U = linear_potential(k)
    return expand_derivatives(slope(lambda e: slope(U, e), ufl.as_ufl(1.0)))


def slope(U: Potential, e: Expr) -> Expr:
    """Force `U'(e)`."""
    return gradient(lambda v: ufl.as_ufl(U(v)), e)


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
