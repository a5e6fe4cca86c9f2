"""Energy that small strains about a frame leave out: that of forces on squares of rotations.

Of a strain that is quadratic in the gradients `g_a` of the displacement seen from the frame these
keep the linear part. A force `N_ab` that is there already would work on the rest, which for small
strains is half the product of the rotations in `g_a` and `g_b`. Beside the energy of bending that
is by how much forces along a body change its stiffness (as in the buckling of plates: S. P.
Timoshenko, J. M. Gere, Theory of Elastic Stability, 2nd ed., McGraw-Hill 1961, ch. 9).
"""

import ufl
from ufl.core.expr import Expr

from shellmb.forms.beam import Line
from shellmb.forms.surface import Surface, along


def of_shell(N: Expr, u: Expr, R: Expr, surf: Surface) -> tuple[Expr, Expr, Expr]:
    """Size of it, energy of stretching, and what the squares would have of that, were edges fixed.

    Per area, J/m^2; the last over the membrane stiffness. Where edges follow it is less.

    Args:
        N: Membrane forces 11, 22, 12, shape (3 or more,), N/m.
        u: Displacement, shape (3,), m.
        R: Rotation of the frame, shape (3, 3).
        surf: Reference surface.
    """
    e1, e2 = R * surf.e1, R * surf.e2
    g1, g2 = along(u, surf.e1) + surf.e1 - e1, along(u, surf.e2) + surf.e2 - e2
    normal = ufl.cross(e1, e2)
    t1, t2 = ufl.dot(normal, g1), ufl.dot(normal, g2)
    turn, shear = (ufl.dot(e2, g1) - ufl.dot(e1, g2)) / 2, ufl.dot(e2, g1) + ufl.dot(e1, g2)
    squares = N[0] * (t1**2 + turn**2) + N[1] * (t2**2 + turn**2) + 2 * N[2] * t1 * t2
    stretching = N[0] * ufl.dot(e1, g1) + N[1] * ufl.dot(e2, g2) + N[2] * shear
    return abs(squares) / 2, stretching / 2, (t1**2 + t2**2) ** 2 / 8


def of_beam(N: Expr, u: Expr, R: Expr, line: Line) -> tuple[Expr, Expr, Expr]:
    """Energy of a beam per length, J/m.

    Args:
        N: Forces along the directors, shape (3,), N; the first is that along the line.
        u: Displacement, shape (3,), m.
        R: Rotation of the frame, shape (3, 3).
        line: Reference line.
    """
    t = R * line.t
    g = along(u, line.t) + line.t - t
    stretch = ufl.dot(t, g)
    squares = ufl.dot(g, g) - stretch**2
    return abs(N[0]) * squares / 2, N[0] * stretch / 2, squares**2 / 8
