"""Frame nodes: a position and three orthonormal directors, for beams and rigid bodies alike.

Unknowns are the displacement `u` and the changes `w = (w1, w2, w3)` of the directors, so that
`x = X + u` and `d_k = D_k + w_k`. Everything is at most quadratic in them.

===========  ==================================================  ==============  ==========
symbol       name                                                unit            equation
===========  ==================================================  ==============  ==========
`d_k`        directors of the frame, `e_i` of the paper          -               (35)
`m`          mass (of a body; of a beam per length)              kg, kg/m
`s_k`        first moments of the mass along the directors       kg m, kg        (16)
`J_kl`       second moments (Euler's inertia tensor)             kg m^2, kg m    (16)
===========  ==================================================  ==============  ==========
"""

from collections.abc import Sequence
from typing import NamedTuple

import ufl
from ufl.core.expr import Expr

Vectors = tuple[Expr, ...]

# pairs of directors in the order of the six multipliers
PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))

# pairs of axes across each axis
ACROSS = ((1, 2), (2, 0), (0, 1))


def vectors(w: Expr) -> Vectors:
    """The three vectors in an expression of shape (9,)."""
    return tuple(ufl.as_vector([w[3 * k], w[3 * k + 1], w[3 * k + 2]]) for k in range(3))


def spin(d: Sequence[Expr], dd: Sequence[Expr]) -> list[Expr]:
    """Rotation `r` in the changes `dd_k = r x d_k` of three directors: `r . (d_a x d_b)`.

    For the pairs across each axis, so that it is `r . d_c`; of directors that are not orthonormal
    these are the components along them, times their volume.

    Args:
        d: The directors.
        dd: Their changes.
    """
    return [(ufl.dot(dd[a], d[b]) - ufl.dot(dd[b], d[a])) / 2 for a, b in ACROSS]


def orthonormality(w: Expr, D: Expr) -> Expr:
    """Half of `d_k.d_k - 1`, and `d_k.d_l`, in the order of `PAIRS`, shape (6,).

    Written in the change `w` of an orthonormal frame `D`, so that nothing cancels.
    """
    W, R = vectors(w), vectors(D)
    rows = []
    for k, m in PAIRS:
        if k == m:
            rows.append(ufl.dot(R[k], W[k]) + ufl.dot(W[k], W[k]) / 2)
        else:
            rows.append(ufl.dot(R[k], W[m]) + ufl.dot(W[k], R[m]) + ufl.dot(W[k], W[m]))
    return ufl.as_vector(rows)


class FrameMass(NamedTuple):
    """Mass of a frame node; None where an effect is left out.

    Args:
        m: Mass, kg (per length for a beam); None where only moments are meant.
        s: First moment along each director, kg m.
        J: Second moments by pairs of directors, in the order of `PAIRS`, kg m^2.
    """

    m: Expr | None
    s: tuple[Expr | None, ...] = (None, None, None)
    J: tuple[Expr | None, ...] = (None,) * 6


def momenta(v: Expr, dw: Expr, mass: FrameMass) -> tuple[Expr, Vectors]:
    """Linear momentum `h` and the momenta `g_k` of the directors, shapes (3,), as in eq. (16).

    Args:
        v: Velocity, shape (3,), m/s.
        dw: Velocities of the directors, shape (9,), 1/s.
        mass: Mass coefficients.
    """
    W = vectors(dw)
    h = 0 * v if mass.m is None else mass.m * v
    g = [0 * v, 0 * v, 0 * v]
    for k, s in enumerate(mass.s):
        if s is not None:
            h, g[k] = h + s * W[k], g[k] + s * v
    for (k, m), J in zip(PAIRS, mass.J, strict=True):
        if J is not None:
            g[k] = g[k] + J * W[m]
            if k != m:
                g[m] = g[m] + J * W[k]
    return h, tuple(g)


def momentum_work(v: Expr, dw: Expr, mass: FrameMass, dv: Expr, ddw: Expr) -> Expr:
    """`h.dv + g_k.dd_k`: virtual work of inertia forces, or twice the kinetic energy."""
    h, g = momenta(v, dw, mass)
    return ufl.dot(h, dv) + sum(ufl.dot(gk, Dk) for gk, Dk in zip(g, vectors(ddw), strict=True))
