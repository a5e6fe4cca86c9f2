"""The reference: compiled forms by DOLFINx, and operations on arrays by NumPy.

Nothing here is of the room around it: no C of ours, no language of FFCx's, no vectors.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import Any

from petsc4py import PETSc

import numpy as np
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.arrays import Floats, Ints
from shellmb.native.assembler import Pairs
from shellmb.native.derivatives import expanded

# `sum a x b` of `sum a b`
AXIAL = np.zeros((3, 3, 3))
AXIAL[[0, 1, 2], [1, 2, 0], [2, 0, 1]], AXIAL[[0, 1, 2], [2, 0, 1], [1, 2, 0]] = 1.0, -1.0
# the plain code of FFCx, in a reasonable time
FLAGS = {"cffi_extra_compile_args": ["-O1", "-g0"]}


def compiled_form(form: Form) -> fem.Form | None:
    """A form compiled by DOLFINx; None for one that is empty.

    Args:
        form: The form.
    """
    form = expanded(form)
    return None if form.empty() else fem.form(form, jit_options=FLAGS)


def compiled_expression(value: Expr, points: Floats) -> fem.Expression:
    """An expression compiled by DOLFINx.

    Args:
        value: The expression.
        points: Where on the reference element it is wanted, shape (n, dimension).
    """
    options: Any = FLAGS
    return fem.Expression(value, points, jit_options=options)


def _parts(ends: Ints, entries: Ints) -> list[Ints]:
    return [entries[a:b] for a, b in itertools.pairwise(ends)]


def _largest(parts: Sequence[Ints], values: Floats, out: Floats) -> None:
    """Largest absolute value of each part, infinite if one is no number."""
    for k, part in enumerate(parts):
        size = np.abs(values[..., part]).max(axis=-1, initial=0.0)
        out[..., k] = np.where(np.isnan(size), np.inf, size)


class _Shares:
    struct = None

    def __init__(
        self, ends: Ints, entries: Ints, weights: tuple[Floats, Floats, Floats], little: float
    ) -> None:
        self._parts = _parts(ends, entries)
        self._weights, self._little = weights, little
        self.table = np.zeros((2, len(weights[0])))

    def fill(self, change: Floats, whole: Floats) -> None:
        """Fill the table."""
        _largest(self._parts, np.stack([change, whole]), self.table)

    def largest(self) -> float:
        """Largest share of what the table holds."""
        if not self.table.sum() < np.inf:
            return np.inf
        (changes, sizes), (units, shares, moves) = self.table, self._weights
        least = np.max(moves * sizes, initial=self._little)
        return float(np.max(shares * changes / np.maximum(units * sizes, least), initial=0.0))


class _PartSizes:
    def __init__(
        self, ends: Ints, entries: Ints, scales: Floats, bounds: Floats, weights: Floats
    ) -> None:
        self._parts = _parts(ends, entries)
        self._scales, self._bounds, self._weights = scales, bounds, weights
        self.table, self.found = np.zeros((2, len(scales))), np.zeros(4)

    def largest(self, values: Floats, out: Floats) -> None:
        """Largest absolute value of each part."""
        _largest(self._parts, values, out)

    def judge(self, x: PETSc.Vec, dx: PETSc.Vec) -> None:
        """Fill table and `found`."""
        self.largest(np.stack([dx.array_r, x.array_r]), self.table)
        self.relate()

    def _relative(self, sizes: Floats, changes: Floats) -> Floats:
        finite = np.where(np.isfinite(changes), changes, 0.0)
        ratio = finite / np.maximum(sizes, self._scales)
        return np.where(np.isfinite(changes), ratio, np.inf)

    def relate(self) -> None:
        """Fill `found` from the table."""
        changes, sizes = self.table
        sizes[:] = self._relative(sizes, changes)
        bounded = np.isfinite(self._bounds)
        moved = (changes[bounded] / self._scales[bounded]).max(initial=0.0)
        most, weighted = (rows.max(initial=0.0) for rows in (sizes, self._weights * sizes))
        self.found[:] = most, moved, np.any(~(changes < self._bounds)), weighted

    def relative(self, sizes: Floats, changes: Floats) -> Floats:
        """Largest relative changes of bounded parts and of others for each row."""
        rows = np.array([self._relative(sizes, row) for row in changes])
        bounded = np.isfinite(self._bounds)
        return np.stack([rows[:, b].max(axis=1, initial=0.0) for b in (bounded, ~bounded)], axis=1)


class _NodeSums:
    def __init__(self, dofs: Ints, reference: Floats, positions: int) -> None:
        self._dofs, self._reference, self._positions = dofs, reference, positions

    def resultants(self, q: Floats, whole: float, forces: Floats, counted: Floats) -> Floats:
        """Force, moment and gross size of forces."""
        at = whole * self._reference + q[:, self._dofs]
        force = counted[self._dofs] * forces[:, self._dofs]
        on_positions = force[:, : self._positions]
        gross = np.linalg.norm(on_positions, axis=2).sum(axis=1)
        moment = np.cross(at, force).sum(axis=1)
        return np.concatenate([on_positions.sum(axis=1), moment, gross[:, None]], axis=1)

    def rotation_sums(self, directors: int, start: Floats, end: Floats, sums: Floats) -> float:
        """Sums of a step, and the largest square of changes."""
        first, last = start[self._dofs], end[self._dofs]
        middle, change = self._reference + (first + last) / 2, last - first
        n = self._positions
        sums[0], sums[1:4], sums[4:7] = n, middle[:n].sum(axis=0), change[:n].sum(axis=0)
        for place, part in ((7, slice(None, n)), (25, slice(n, None))):
            sums[place : place + 9] = (middle[part].T @ middle[part]).ravel()
            sums[place + 9 : place + 18] = (middle[part].T @ change[part]).ravel()
        squares = (change[n:] ** 2).reshape(-1, 3 * directors).sum(axis=1)
        return float(squares.max(initial=0.0))


class Reference:
    """Operations by NumPy."""

    part_sizes, shares, node_sums = _PartSizes, _Shares, _NodeSums

    def turn(self, d: Floats, change: Floats, most: float) -> int:
        """Turn directors by a change of them."""
        far = (change * change).sum(axis=1) > most * most
        moved = d[far] + change[far]
        turned = _turned_vectors if d.shape[1] == 3 else _turned_triples
        d[:] = turned(d, change)
        d[far] = moved
        return int(far.sum())

    def normalise(self, d: Floats) -> None:
        """Bring nearly orthonormal directors to length one and right angles."""
        if d.shape[1] == 3:
            d /= np.sqrt((d * d).sum(axis=1))[:, None]
            return
        v = d.reshape(-1, 3, 3)
        for _ in range(4):
            v = _nearer(v)
        d[:] = v.reshape(d.shape)

    def foresee(self, weights: Floats, past: Floats, to: Floats) -> None:
        """Extrapolate states by polynomials."""
        to[:] = weights @ past

    def foresee_pairs(
        self, weights: tuple[Floats, Floats], past: Floats, pairs: Pairs, dt: float, to: Floats
    ) -> None:
        """Extrapolate values and slopes by polynomials through both."""
        values, slopes, times = pairs
        known = np.concatenate([past[:, values], past[:, slopes] * dt * times])
        to[:, values], to[:, slopes] = weights[0] @ known, weights[1] @ known / times

    def centring(
        self, own: Sequence[Floats], above: Sequence[Floats], below: Sequence[Floats]
    ) -> Callable[[], None]:
        """Make what moves two lists of arrays so that their mean is a third one."""

        def centre() -> None:
            for mean, a, b in zip(own, above, below, strict=True):
                half = 0.5 * (a - b)
                np.add(mean, half, out=a)
                np.subtract(mean, half, out=b)

        return centre

    def rotation(self, sums: Floats, tiny: float) -> tuple[float, float]:
        """Twice the tangent of half the angle of a rotation, and the radius about its axis."""
        count, x, dx = sums[0], sums[1:4], sums[4:7]
        xx, xdx, dd, ddd = sums[7:].reshape(4, 3, 3)
        about, moved = xx - np.outer(x, x) / count, xdx - np.outer(x, dx) / count
        size = np.trace(about) / count
        if not size > 0:
            return 0.0, 0.0
        # of `dr = w x r`
        inertia = _inertia(about) / size + _inertia(dd)
        inertia += tiny * inertia.max() * np.eye(3)
        try:
            spin = np.linalg.solve(inertia, np.einsum("ijk,jk->i", AXIAL, moved / size + ddd))
        except np.linalg.LinAlgError:
            return 0.0, 0.0
        tangent = float(np.linalg.norm(spin))
        if not tangent > 0:
            return 0.0, 0.0
        # of nodes on the axis there may be less than nothing, by round-off
        square = max(float(spin @ _inertia(about) @ spin) / count, 0.0)
        return tangent, float(np.sqrt(square)) / tangent


def _inertia(squares: Floats) -> Floats:
    """`sum (r.r I - r r)` of `sum r r`."""
    return np.asarray(np.trace(squares) * np.eye(3) - squares)


def _turned_vectors(d: Floats, change: Floats) -> Floats:
    """Single directors turned by `r = d x change / 2`."""
    across = change - (d * change).sum(axis=1)[:, None] * d
    quarter = (across * across).sum(axis=1)[:, None] / 4
    out = ((1 - quarter) * d + across) / (1 + quarter)
    return np.asarray(out / np.sqrt((out * out).sum(axis=1))[:, None])


def _turned_triples(d: Floats, change: Floats) -> Floats:
    """Triples of directors turned, each of which sees two thirds of the rotation."""
    v, change = d.reshape(-1, 3, 3), change.reshape(-1, 3, 3)
    r = np.cross(v, change).sum(axis=1)[:, None, :] / 4
    once = np.cross(r, v)
    out = v + 2 / (1 + (r * r).sum(axis=2))[:, :, None] * (once + np.cross(r, once))
    return _nearer(out).reshape(d.shape)


def _nearer(v: Floats) -> Floats:
    """One step of Newton's method from triples to the nearest orthonormal ones."""
    gram = v @ v.transpose(0, 2, 1)
    return np.asarray(1.5 * v - 0.5 * gram @ v)
