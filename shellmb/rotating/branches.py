"""Branches of a Campbell diagram: which mode at one rate is which at the next, by shape."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from petsc4py import PETSc

import numpy as np
from scipy.optimize import linear_sum_assignment

from shellmb.arrays import Floats, Ints
from shellmb.rotating.modes import RotatingModes
from shellmb.rotating.quadratic import Pair

# modes whose frequencies differ by less, relatively or of the largest one, may be mixed at will
EQUAL, NONE = 1e-4, 1e-6
# shapes with less in common than this are different modes; of a double eigenvalue that splits into
# a forward and a backward wave each has one half in common with both
SAME = 0.3


def assurance(first: Sequence[Pair], second: Sequence[Pair], mass: PETSc.Mat) -> Floats:
    """Modal assurance criterion `|v^H M w|^2/((v^H M v)(w^H M w))` of all pairs of modes.

    Where `w` turns the other way the larger one of `w` and its conjugate counts: a backward wave
    whose frequency passes zero is listed as a forward one.

    Args:
        first: Modes at one rate.
        second: Modes at another.
        mass: Mass matrix.

    Returns:
        Shape (first, second), from 0 to 1.
    """

    def times(pair: Pair) -> tuple[PETSc.Vec, PETSc.Vec]:
        found = []
        for vector in (pair.real, pair.imaginary):
            y = mass.createVecLeft()
            mass.mult(vector, y)
            found.append(y)
        return found[0], found[1]

    def inner(v: Pair, y: tuple[PETSc.Vec, PETSc.Vec], sign: float) -> complex:
        a, b = y
        real = v.real.dot(a) + sign * v.imaginary.dot(b)
        return complex(real, sign * v.real.dot(b) - v.imaginary.dot(a))

    columns = [times(w) for w in second]
    own, other = (np.array([abs(inner(p, times(p), 1.0)) for p in of]) for of in (first, second))
    rows = [
        [max(abs(inner(v, y, 1.0)), abs(inner(v, y, -1.0))) ** 2 for y in columns] for v in first
    ]
    return np.array(rows) / np.outer(own, other)


def _mixed(alike: Floats, first: Floats, second: Floats) -> Floats:
    """Share of one group of equal frequencies in another, for all modes of both, from 0 to 1.

    Any mixture of modes with equal frequencies is a mode: each alone may have little in common with
    each of the same modes at the next rate.

    Args:
        alike: What single modes have in common, shape (first, second).
        first: Frequencies at one rate.
        second: Frequencies at another.
    """
    own, other = (_equal(omega) for omega in (first, second))
    sizes = np.minimum(own.sum(axis=1)[:, None], other.sum(axis=1)[None])
    return np.asarray(np.minimum(own @ alike @ other / sizes, 1.0))


def _equal(omega: Floats) -> Floats:
    """Pairs of equal frequencies: 1, of others 0, shape (n, n)."""
    size = np.abs(omega)
    gaps = np.abs(omega[:, None] - omega[None])
    bound = EQUAL * np.minimum(size[:, None], size[None]) + NONE * size.max(initial=0.0)
    return np.asarray(gaps <= bound, dtype=float)


def track(found: Sequence[RotatingModes], mass: PETSc.Mat) -> Ints:
    """Branches through modes at ascending rates.

    Args:
        found: Modes at each rate.
        mass: Mass matrix.

    Returns:
        Number of the mode from 0, or -1 where the branch has none, shape (rates, branches).
    """
    branches: list[list[int]] = [[k] for k in range(len(found[0].values))]
    for step, (before, after) in enumerate(pairwise(found), start=1):
        alike = assurance(before.pairs, after.pairs, mass)
        same = _mixed(alike, before.omega, after.omega)
        # of shapes that are equally like the nearest frequency decides
        gaps = np.abs(before.omega[:, None] - after.omega[None])
        cost = same + 1e-2 * alike - 1e-3 * gaps / max(float(gaps.max()), 1e-300)
        rows, columns = linear_sum_assignment(-cost)
        follows = {int(r): int(c) for r, c in zip(rows, columns, strict=True) if same[r, c] > SAME}
        for branch in branches:
            branch.append(follows.get(branch[-1], -1))
        new = set(range(len(after.values))) - set(follows.values())
        branches += [[-1] * step + [k] for k in sorted(new)]
    return np.array(branches).T
