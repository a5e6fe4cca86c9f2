"""Unit vectors and orthonormal triples at nodes: their tangent spaces and finite updates.

A node carries one director `d = D + w` (a shell) or three (a frame), and multipliers that keep
`d_k . d_l = delta_kl`. With `C(d)` the derivative of these constraints at the directors `d`:

* forces are taken where constraint forces vanish: columns of `Y` span the null space of `C(d_m)`
  at the mean directors `d_m` of the sub-interval (`Q_m` and its like in the paper, eqs. 27, B5);
* increments are tangent at the directors themselves: columns of `Z` span the null space of `C(d)`;
* the finite update rotates by the Rodrigues parameters `r = theta/2` (appendices A and B), so that
  lengths and angles are exact.
"""

import math

import numpy as np

from shellmb.arrays import Floats

# singular values of constraints below this, of directors of unit length, are none
DEPENDENT = 1e-8
# pairs of directors in the order of the multipliers, by number of directors
PAIRS = {1: ((0, 0),), 3: ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))}


def _rows(k: int) -> Floats:
    """Derivatives of the constraints of `k` directors by these, shape (3 k, c 3 k)."""
    found = np.zeros((k, 3, len(PAIRS[k]), k, 3))
    for row, (a, b) in enumerate(PAIRS[k]):
        found[b, :, row, a, :] = found[a, :, row, b, :] = np.eye(3)
    return found.reshape(3 * k, -1)


ROWS = {3 * k: _rows(k) for k in PAIRS}


def constraint(d: Floats) -> Floats:
    """Derivative of the constraints.

    Args:
        d: Directors, shape (n, 3 k) with k = 1 or 3.

    Returns:
        `C`, shape (n, c, 3 k) with c = 1 or 6.
    """
    size = d.shape[1]
    return (d @ ROWS[size]).reshape(len(d), len(PAIRS[size // 3]), size)


def violation(d: Floats) -> Floats:
    """Values of the constraints, halves of squares as their derivatives are, shape (n, c)."""
    k = d.shape[1] // 3
    v = d.reshape(-1, k, 3)
    rows = [(v[:, a] * v[:, b]).sum(axis=1) - (a == b) for a, b in PAIRS[k]]
    halves = np.array([0.5 if a == b else 1.0 for a, b in PAIRS[k]])
    return np.stack(rows, axis=1) * halves


def null_space(rows: Floats, size: int) -> Floats:
    """Vectors that the rows of single nodes do not see, however dependent the rows are.

    Args:
        rows: Shape (r, 3 k).
        size: Number of vectors, the same at all states.

    Returns:
        Orthonormal columns, shape (3 k, size).
    """
    if not np.all(np.isfinite(rows)):
        return np.full((rows.shape[1], size), np.nan)
    return np.asarray(np.linalg.svd(rows)[2][rows.shape[1] - size :].T)


def pseudo_inverse(C: Floats) -> Floats:
    """`C^T (C C^T)^-1`, shape (n, 3 k, c), for constraints that are independent."""
    if C.shape[1] == 1:
        row = C[:, 0, :]
        return np.asarray((row / (row * row).sum(axis=1)[:, None])[:, :, None])
    Ct = C.transpose(0, 2, 1)
    return np.asarray(Ct @ _inverse(C @ Ct))


def any_pseudo_inverse(rows: Floats) -> Floats:
    """Pseudo-inverse of constraints of one node, shape (c, m), which may depend on one another."""
    if not np.all(np.isfinite(rows)):
        return np.full(rows.T.shape, np.nan)
    return np.asarray(np.linalg.pinv(rows, rcond=DEPENDENT))


def _inverse(matrices: Floats) -> Floats:
    """Inverses; NaN if one has none.

    Directors of an iterate far away may depend on one another. The convergence test sees a NaN on
    every rank, and an exception would be seen on one.
    """
    try:
        return np.asarray(np.linalg.inv(matrices))
    except np.linalg.LinAlgError:
        return np.full(matrices.shape, np.nan)


def rotated(d: Floats, change: Floats, most: float = math.inf) -> tuple[Floats, bool]:
    """Directors after a finite rotation that agrees with a change of them to first order.

    Args:
        d: Orthonormal directors, shape (n, 3 k).
        change: Their change, shape (n, 3 k); what is not tangent is ignored.
        most: Size of a change beyond which a node takes it as it is.

    Returns:
        Directors, shape (n, 3 k), orthonormal but for those; whether there are any of those.
    """
    far = np.vecdot(change, change) > most * most
    out = (_turned_vectors if d.shape[1] == 3 else _turned_triples)(d, change)
    if some := bool(far.any()):
        out[far] = d[far] + change[far]
    return out, some


def orthonormal(d: Floats) -> Floats:
    """Orthonormal directors near given ones, by four steps of Newton's method if they are triples.

    Args:
        d: Directors, shape (n, 3 k).

    Returns:
        Shape (n, 3 k).
    """
    if d.shape[1] == 3:
        return np.asarray(d / np.sqrt((d * d).sum(axis=1))[:, None])
    v = d.reshape(-1, 3, 3)
    for _ in range(4):
        v = _nearer(v)
    return v.reshape(d.shape)


def _turned_vectors(d: Floats, change: Floats) -> Floats:
    """Single directors turned by `r = d x change / 2`."""
    across = change - (d * change).sum(axis=1)[:, None] * d
    quarter = (across * across).sum(axis=1)[:, None] / 4
    out = ((1 - quarter) * d + across) / (1 + quarter)
    return np.asarray(out / np.sqrt((out * out).sum(axis=1))[:, None])


def _turned_triples(d: Floats, change: Floats) -> Floats:
    """Triples of directors turned, each of which sees two thirds of the rotation."""
    v = d.reshape(-1, 3, 3)
    twice = v.transpose(0, 2, 1) @ change.reshape(-1, 3, 3)
    # rows times this are `r x` them: matrices take a tenth of the time of products of vectors
    r = (twice - twice.transpose(0, 2, 1)) / 4
    once = v @ r
    square = (r * r).sum(axis=(1, 2)) / 2
    out = v + (2 / (1 + square))[:, None, None] * (once + once @ r)
    return _nearer(out).reshape(d.shape)


def _nearer(v: Floats) -> Floats:
    """One step of Newton's method from triples to the nearest orthonormal ones."""
    gram = v @ v.transpose(0, 2, 1)
    return np.asarray(1.5 * v - 0.5 * gram @ v)
