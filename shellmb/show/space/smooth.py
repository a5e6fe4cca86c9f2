"""Curved cells as many small flat pieces: positions and values between nodes as the cells say."""

from __future__ import annotations

from dataclasses import dataclass
from math import isqrt

import numpy as np
import numpy.typing as npt

from shellmb.observers.files.grid import lattice
from shellmb.show.space.shapes import Shape

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

# pieces along the side of a cell, at most, and in all cells of a body
FINEST, PIECES = 6, 40_000
# points whose hashes differ by less are one
SAME = 1e-9


@dataclass(frozen=True)
class Smooth:
    """Points on the cells of a body, and the pieces between them.

    Args:
        nodes: Nodes of the cell of each point, shape (m, k).
        weights: Their weights, shape (m, k).
        faces: Corners of flat pieces, numbers of points, shape (f, 3 or 4).
        outlines: Points around each cell, closed, shape (c, l).
        lines: Points along each line, shape (l, s).
    """

    nodes: Ints
    weights: Floats
    faces: Ints
    outlines: Ints
    lines: Ints

    def at(self, values: Floats) -> Floats:
        """Values at the points, shape (m, ...), from those at the nodes, shape (n, ...)."""
        return np.asarray(np.einsum("mk,mk...->m...", self.weights, values[self.nodes]))


def smooth(shape: Shape) -> Smooth:
    """The finer pieces of a body; those between its nodes where its cells are of no known kind."""
    places, cells = shape.places, shape.cells
    basis = _basis(places)
    if not len(cells) or basis is None:
        every = np.arange(len(shape.reference))[:, None]
        return Smooth(every, np.ones(every.shape), shape.faces, shape.outlines, shape.lines)
    side = min(FINEST, isqrt(PIECES // len(cells)))
    side = max(side, int(basis.max()))
    fine = _fine(places, side)
    weights = _monomials(fine, basis) @ np.linalg.inv(_monomials(places, basis))
    nodes = np.repeat(cells, len(fine), axis=0)
    weights = np.tile(weights, (len(cells), 1))
    # points on a side that cells share are one: shading goes on across it
    hashed = np.random.default_rng(0).random((len(shape.reference), 2))
    keys = np.round(np.einsum("mk,mkd->md", weights, hashed[nodes]) / SAME)
    _, first, number = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    table = number.reshape(len(cells), len(fine))
    nothing = np.zeros((0, 3), dtype=np.int64)
    if places.shape[1] == 1:
        return Smooth(nodes[first], weights[first], nothing, nothing, table)
    pieces, around = lattice(fine)
    faces = table[:, pieces].reshape(-1, pieces.shape[1])
    return Smooth(nodes[first], weights[first], faces, table[:, around], nothing[:, :2])


def _basis(places: Floats) -> Ints | None:
    """Exponents of the monomials of a Lagrange cell, shape (k, dim); None if it is of no kind."""
    count, dim = places.shape
    if dim == 1:
        return np.arange(count)[:, None]
    side = isqrt(count)
    if side**2 == count and side > 1:
        i, j = np.indices((side, side)).reshape(2, -1)
        return np.stack([i, j], axis=1)
    degree = next((d for d in range(1, 10) if (d + 1) * (d + 2) == 2 * count), None)
    if degree is None:
        return None
    return np.array([(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)])


def _monomials(x: Floats, basis: Ints) -> Floats:
    """Shape (points, monomials)."""
    return np.asarray(np.prod(x[:, None, :] ** basis[None], axis=2))


def _fine(places: Floats, side: int) -> Floats:
    """Points of a finer lattice on the reference cell, shape (m, dim)."""
    steps = np.arange(side + 1) / side
    if places.shape[1] == 1:
        return steps[:, None]
    x = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    quad = (places.sum(axis=1) > 1.5).any()
    return x if quad else x[x.sum(axis=1) < 1 + 1e-9]
