"""Constraints between single nodes; all at most quadratic, so the mid-point gradient is exact.

`g(q_b) - g(q_a) = Dg(q_m)[q_b - q_a]` holds for each of them, hence their multipliers do no work.
"""

import ufl
from ufl.core.expr import Expr


def locked_kink(d1: Expr, d2: Expr, reference: Expr) -> Expr:
    """Two smooth parts of a shell keep the angle between their directors at a common edge.

    The two directors have four parameters, the rotation of the kinked edge three: one constraint.

    Args:
        d1: Director of the first part, shape (3,).
        d2: Director of the second part, shape (3,).
        reference: Value of `d1 . d2` in the reference configuration.
    """
    return ufl.dot(d1, d2) - reference


def in_plane(q: Expr, normal: Expr) -> Expr:
    """A nodal vector (displacement, director change) stays in the plane with the given normal."""
    return ufl.dot(q, normal)
