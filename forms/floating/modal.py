"""A body in modes about a floating frame: where its points are, and the energy of its modes.

==========  ==================================================================  ======
symbol      name                                                                unit
==========  ==================================================================  ======
`eta_k`     amplitudes of the modes                                             m
`d_a`       directors of the floating frame, along the scene's axes at rest     -
`z_r`       points that carry the inertia of the modes (`model.reduced.data`)   m
`Q_rka`     where they are per amplitude, along the directors                   -
`A_a`       arm from the frame to an interface, along the directors             m
`e_a`       vectors of an interface's frame, along the scene's axes at rest     -
==========  ==================================================================  ======
"""

from collections.abc import Sequence

import ufl
from ufl.core.expr import Expr

from shellmb.forms.frame import ACROSS, Vectors, vectors
from shellmb.forms.loads import follower_frame_force, follower_frame_moment


def components(table: Expr, first: int, eta: Sequence[Expr]) -> list[Expr]:
    """Three sums over the modes, with the coefficients `table[first + K a + k]`."""
    K = len(eta)
    return [
        sum((table[first + K * a + k] * eta[k] for k in range(1, K)), table[first + K * a] * eta[0])
        for a in range(3)
    ]


def unit_vectors(w: Vectors) -> Vectors:
    """Directors from their changes, where they are the scene's axes at rest."""
    return tuple(ufl.as_vector([float(a == i) + w[a][i] for i in range(3)]) for a in range(3))


def carried(A: Expr, s: Expr, w: Vectors) -> Expr:
    """Change of a vector that is `A_a + s_a` along the directors and was `A` at rest, shape (3,).

    Args:
        A: Its components at rest.
        s: Their changes by the modes.
        w: Changes of the directors.
    """
    sums = [(A[a] + s[a]) * w[a] for a in range(3)]
    return s + sums[0] + sums[1] + sums[2]


def seen_apart(z: Expr, parts: Sequence[Expr], w: Vectors) -> Expr:
    """`d_a . z - z_a`: a vector has these components along the directors, shape (3,).

    Written as scalars that no rotation changes, so that their forces have no moment, as the step's
    chords have them, either.

    Args:
        z: The vector.
        parts: Its components.
        w: Changes of the directors.
    """
    return ufl.as_vector([z[a] + ufl.dot(z, w[a]) - parts[a] for a in range(3)])


def held_apart(gap: Expr, arm: Sequence[Expr], shift: Sequence[Expr], w: Vectors) -> Expr:
    """Offset of the arm to an interface, `A_a + shift_a`; m.

    Args:
        gap: Displacement of the interface less that of the frame.
        arm: `A_a`.
        shift: Displacements by the modes, along the directors.
        w: Changes of the directors: written in them nothing cancels.
    """
    A = ufl.as_vector(arm)
    return seen_apart(gap, shift, w) + ufl.as_vector([ufl.dot(A, w[a]) for a in range(3)])


def turned_apart(turn: Sequence[Expr], w: Vectors, v: Vectors) -> Expr:
    """Rotation of an interface relative to that of the modes, shape (3,).

    The skew part of `e_a . d_b` is the sine of the angle between both frames times its axis. It is
    the rotation by the modes, which is small: the error is a sixth of its third power.

    Args:
        turn: Rotation by the modes about the directors, rad.
        w: Changes of the directors.
        v: Changes of the interface's vectors.
    """
    rows = []
    for a, (b, c) in enumerate(ACROSS):
        # in the changes, because both products begin as zero
        one = w[c][b] + v[b][c] + ufl.dot(v[b], w[c])
        other = w[b][c] + v[c][b] + ufl.dot(v[c], w[b])
        rows.append((one - other) / 2 - turn[a])
    return ufl.as_vector(rows)


def frame_work(P: Sequence[Expr], T: Sequence[Expr], d: Vectors, du: Expr, dw: Expr) -> Expr:
    """Virtual work of a force and a moment on the floating frame.

    Args:
        P: Force along the directors, N.
        T: Moment along them, N m.
        d: The directors.
        du: Variation of the frame's place.
        dw: Variations of the directors, shape (9,).
    """
    force = follower_frame_force(ufl.as_vector(P), d, du)
    return force + follower_frame_moment(ufl.as_vector(T), d, vectors(dw))


def coupled_momentum(m: Expr, c: Sequence[Expr], z: Expr, w: Vectors) -> tuple[Expr, Vectors]:
    """Momenta of a point and of the directors, for the velocities `z` and `w`, shapes (3,).

    Args:
        m: Mass of the point, kg.
        c: Products of inertia with the directors, kg m.
        z: Velocity of the point.
        w: Velocities of the directors.
    """
    point = m * z + c[0] * w[0] + c[1] * w[1] + c[2] * w[2]
    return point, tuple(part * z for part in c)
