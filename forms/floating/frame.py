"""A floating frame: directors that are the same all over a body, and what ties them to it.

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
"""

from collections.abc import Sequence

import ufl
from ufl.core.expr import Expr

from shellmb.forms.frame import ACROSS, Vectors, orthonormality, vectors

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
