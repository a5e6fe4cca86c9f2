"""Curved cells as many small flat pieces: positions and values between nodes as the cells say."""

from __future__ import annotations

from dataclasses import dataclass
from math import isqrt

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.show.space.shapes import Shape, lattice

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


class Slab:
    """A surface with a thickness: its pieces on both sides, and a rim between them.

    Args:
        fine: Its pieces.
        half: Half of its thickness.

    Attributes:
        faces: Corners of flat pieces, shape (f, 3 or 4).
        outlines: Points around each cell, closed, on both sides.
    """

    def __init__(self, fine: Smooth, half: float) -> None:
        self._fine, self._half = fine, half
        top, count = fine.faces, len(fine.nodes)
        edges = np.stack([top, np.roll(top, -1, axis=1)], axis=-1).reshape(-1, 2)
        _, first, times = np.unique(
            np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True
        )
        # the rim has points of its own: it is no part of a smooth shading of the sides
        self._rim, ends = np.unique(edges[first[times == 1]], return_inverse=True)
        a, b = 2 * count + ends.reshape(-1, 2).T
        c, d = b + len(self._rim), a + len(self._rim)
        quads = np.stack([a, d, c, b], axis=1)
        if top.shape[1] == 3:
            quads = np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]])
        self.faces = np.concatenate([top, count + top[:, ::-1], quads]).astype(int)
        self.outlines = np.concatenate([fine.outlines, count + fine.outlines])

    def at(self, values: Floats) -> Floats:
        """Values at the points from those at the nodes, shape (n, ...)."""
        return self._all(*[self._fine.at(values)] * 2)

    def place(self, x: Floats) -> Floats:
        """Points from the positions of the nodes, shape (n, 3)."""
        middle = self._fine.at(x)
        corners = middle[self._fine.faces]
        across = np.cross(corners[:, 2] - corners[:, 0], corners[:, -1] - corners[:, 1])
        normals = np.zeros_like(middle)
        for corner in self._fine.faces.T:
            np.add.at(normals, corner, across)
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        shift = self._half * normals / np.where(lengths > 0, lengths, 1.0)
        return self._all(middle + shift, middle - shift)

    def _all(self, top: Floats, bottom: Floats) -> Floats:
        return np.concatenate([top, bottom, top[self._rim], bottom[self._rim]])


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
