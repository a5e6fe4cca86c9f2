"""Points that cross triangles on straight paths between two states.

A point and the vertices of a triangle that move along straight lines, all at once, are in a plane
where a cubic in time is zero. It is found in Bernstein's form: where all four coefficients have one
sign it has no zero, and nearly all pairs are done with.
"""

from __future__ import annotations

import itertools

import numpy as np

from shellmb.arrays import Floats, Ints

# halvings of an interval in which the cubic changes its sign: to round-off
HALVINGS = 53


def crossings(y: tuple[Floats, Floats], v: tuple[Floats, Floats]) -> tuple[Ints, Floats]:
    """Moments at which points cross the planes of triangles, within these or beside them.

    Args:
        y: Positions of points at both states, shape (n, 3) each, m.
        v: Vertices of triangles, shape (n, 3, 3) each, m.

    Returns:
        Numbers of the pairs, which may repeat, shape (m,), and parts of the way, shape (m,).
    """
    whole = _bernstein(y, v)
    pairs = np.flatnonzero((whole.min(axis=0) < 0) & (whole.max(axis=0) > 0))
    b = whole[:, pairs]
    ends = _between_extremes(b)
    found, when = [pairs[:0]], [np.zeros(0)]
    for first, last in itertools.pairwise(ends):
        begins = _value(b, first)
        here = np.flatnonzero(begins * _value(b, last) < 0)
        low, high, rises = first[here], last[here], begins[here] < 0
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            before = (_value(b[:, here], middle) < 0) == rises
            low, high = np.where(before, middle, low), np.where(before, high, middle)
        found.append(pairs[here])
        when.append((low + high) / 2)
    return np.concatenate(found), np.concatenate(when)


def _bernstein(y: tuple[Floats, Floats], v: tuple[Floats, Floats]) -> Floats:
    """Coefficients of six times the volume over the way, shape (4, n)."""
    one, two, away = (
        [x[:, 1] - x[:, 0] for x in v],
        [x[:, 2] - x[:, 0] for x in v],
        [point - x[:, 0] for point, x in zip(y, v, strict=True)],
    )
    found = np.zeros((4, len(y[0])))
    for i, j in itertools.product(range(2), repeat=2):
        normal = np.cross(one[i], two[j])
        for k in range(2):
            found[i + j + k] += np.vecdot(normal, away[k])
    found[1:3] /= 3
    return found


def _value(b: Floats, t: Floats) -> Floats:
    """Value of the cubic at parts of the way, shape (n,)."""
    s = 1 - t
    return np.asarray(((b[0] * s + 3 * b[1] * t) * s + 3 * b[2] * t * t) * s + b[3] * t**3)


def _between_extremes(b: Floats) -> list[Floats]:
    """Ends of intervals without extremes, from 0 to 1, shape (n,) each."""
    d = np.diff(b, axis=0)
    # of the derivative d0 s^2 + 2 d1 s t + d2 t^2
    half, constant, square = d[1] - d[0], d[0], d[0] - 2 * d[1] + d[2]
    root = np.sqrt(np.maximum(half**2 - square * constant, 0.0))
    q = -(half + np.where(half < 0, -root, root))
    with np.errstate(divide="ignore", invalid="ignore"):
        extremes = np.stack([q / square, constant / q])
    inner = np.sort(np.clip(np.nan_to_num(extremes, nan=0.0), 0.0, 1.0), axis=0)
    return [np.zeros(b.shape[1]), *inner, np.ones(b.shape[1])]
