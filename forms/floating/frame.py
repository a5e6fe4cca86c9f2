"""A floating frame: directors of a whole body, what ties them to it, and the energy left out.

Of a body whose strains and rotations are small relative to a frame, the frame is the rotation that
its material turns by in the mean: where it sees no mean rotation,

    skew of  int sum_p (d_a . p) (E_b . P) dA = 0,                                           (FF1)

`P` being orthonormal vectors of the material (tangents and directors) and `p` where they are now.
That is the rotation by which `int sum_p |p - R P|^2 dA` is least: what a theory of small rotations
leaves out is of second order in just these differences. Mean axes that make displacements least
(B. Fraeijs de Veubeke, Int. J. Eng. Sci. 14 (1976) 895-913) see larger rotations in the mean.

(FF1) and the lengths and angles of the frame are quadratic in the unknowns and unchanged by
rotations: all schemes treat them as they treat joints. The frame has no mass and needs no place.

===========  ==========================================================  =====
symbol       name                                                        unit
===========  ==========================================================  =====
`d_a`        directors of the frame, the scene's axes `E_a` at rest      -
`f_a`        their changes, `d_a = E_a + f_a`, in the state "frame"      -
`R`          rotation of the frame, `R V = V + f_a V_a`                  -
===========  ==========================================================  =====

Energy that small strains about a frame leave out: that of forces on squares of rotations.

Of a strain that is quadratic in the gradients `g_a` of the displacement seen from the frame these
keep the linear part. A force `N_ab` that is there already would work on the rest, which for small
strains is half the product of the rotations in `g_a` and `g_b`. Beside the energy of bending that
is by how much forces along a body change its stiffness (as in the buckling of plates: S. P.
Timoshenko, J. M. Gere, Theory of Elastic Stability, 2nd ed., McGraw-Hill 1961, ch. 9).
"""

from collections.abc import Sequence

import ufl
from ufl.core.expr import Expr

from shellmb.forms.beam import Line
from shellmb.forms.frame import ACROSS, Vectors, orthonormality, vectors
from shellmb.forms.shell import Surface, along

# displacement, changes of directors and changes of the frame's directors of a state
Moved = tuple[Expr, Expr, Expr]
# a material vector at rest and its change
Turned = tuple[Expr, Expr]


def carried(f: Vectors, V: Expr) -> Expr:
    """Change `R V - V` of a vector that turns with the frame, shape (3,)."""
    return V[0] * f[0] + V[1] * f[1] + V[2] * f[2]


def mean_turn(f: Vectors, turned: Sequence[Turned]) -> list[Expr]:
    """Density of twice the mean rotation that the frame sees, eq. (FF1), three components.

    Args:
        f: Changes of the frame's directors.
        turned: Material vectors with their changes.
    """

    def seen(a: int, b: int) -> Expr:
        """Change of `(d_a . p) P_b`, summed."""
        parts = [(p[a] + ufl.dot(P, f[a]) + ufl.dot(p, f[a])) * P[b] for P, p in turned]
        return sum(parts[1:], parts[0])

    return [seen(a, b) - seen(b, a) for a, b in ACROSS]


def frame_constraints(frame: Expr, turned: Sequence[Turned]) -> Expr:
    """Densities whose integrals vanish: lengths and angles of the frame, and (FF1), shape (9,).

    Args:
        frame: Changes of the directors one after the other, shape (9,).
        turned: Material vectors with their changes.
    """
    axes = ufl.as_vector([float(a == b) for a in range(3) for b in range(3)])
    return ufl.as_vector([*orthonormality(frame, axes), *mean_turn(vectors(frame), turned)])


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
