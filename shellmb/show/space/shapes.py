"""Bodies as they are drawn, curved cells in flat pieces, and their states, from files of a run."""

from dataclasses import dataclass
from functools import cached_property
from math import isqrt
from pathlib import Path
from typing import Any

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.errors import SceneError
from shellmb.files.grids import components, numbers, read_grid
from shellmb.show.fields import REFERENCE, Fields

VERTEX = 1
# displacements that are round-off, relative to positions: a hundred times what a rotation leaves
ROUND_OFF = 1e-13

# pieces along the side of a cell, at most, and in all cells of a body
FINEST, PIECES = 6, 40_000
# points whose hashes differ by less are one
SAME = 1e-9


# corners around each face of a solid cell, in VTK's order, by how many faces it has
SIDES = {
    4: ((0, 1, 3), (1, 2, 3), (2, 0, 3), (0, 2, 1)),
    6: ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7)),
}
NOTHING = np.zeros((0, 3), dtype=np.int64)


@dataclass(frozen=True)
class Pieces:
    """Points on the cells of a body, and the pieces between them.

    Attributes:
        nodes: Nodes that each point lies between, shape (m, k).
        weights: Their weights there, shape (m, k).
        faces: Points of flat pieces of a surface, shape (f, 3 or 4).
        outlines: Points around each element of it, the first one again at the end, shape (e, j).
        lines: Points along each element of a line, shape (l, j).
    """

    nodes: Ints
    weights: Floats
    faces: Ints
    outlines: Ints
    lines: Ints

    def at(self, values: Floats) -> Floats:
        """Values at the points, shape (m, ...), from those at the nodes, shape (n, ...)."""
        return np.asarray(np.einsum("mk,mk...->m...", self.weights, values[self.nodes]))

    @property
    def border(self) -> Ints:
        """Segments of the boundary of the surface, shape (s, 2)."""
        return once(np.stack([self.outlines[:, :-1], self.outlines[:, 1:]], axis=-1).reshape(-1, 2))


class Slab:
    """A surface with a thickness: its pieces on both sides, and a rim between them.

    Args:
        fine: Its pieces.
        half: Half of its thickness.

    Attributes:
        faces: Corners of flat pieces, shape (f, 3 or 4).
        outlines: Points around each cell, closed, on both sides.
    """

    def __init__(self, fine: Pieces, half: float) -> None:
        self._fine, self._half = fine, half
        top, count = fine.faces, len(fine.nodes)
        edges = np.stack([top, np.roll(top, -1, axis=1)], axis=-1).reshape(-1, 2)
        # the rim has points of its own: it is no part of a smooth shading of the sides
        self._rim, ends = np.unique(once(edges), return_inverse=True)
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


def once(rows: Ints) -> Ints:
    """Sides or faces that are there only once, however they are turned."""
    _, first, counts = np.unique(
        np.sort(rows, axis=1), axis=0, return_index=True, return_counts=True
    )
    return np.asarray(rows[np.sort(first[counts == 1])])


def pieces_of(cells: Ints, kind: Any, reference: Floats) -> Pieces:
    """The pieces of a body: many of curved cells, faces between the corners of solid ones.

    Args:
        cells: Nodes of the cells in the order of VTK, shape (c, k).
        kind: One of the cells, as VTK has it; None: there are none.
        reference: Positions of all nodes, shape (n, 3).
    """
    every = np.arange(len(reference))[:, None]
    if kind is None:
        return Pieces(every, np.ones(every.shape), NOTHING, NOTHING, NOTHING)
    dim = kind.GetCellDimension()
    if dim == 3:
        around = np.array(SIDES[kind.GetNumberOfFaces()])
        faces = once(cells[:, around].reshape(-1, around.shape[1]))
        outlines = np.hstack([faces, faces[:, :1]])
        return Pieces(every, np.ones(every.shape), faces, outlines, NOTHING)
    places = np.array(kind.GetParametricCoords()).reshape(-1, 3)
    degree = int((places[:, 1:] == 0).all(axis=1).sum()) - 1
    # what is flat needs no more pieces
    side = 1 if degree == 1 else max(degree, min(FINEST, isqrt(PIECES // len(cells))))
    points, pieces, around = lattice(side, kind.GetNumberOfEdges() if dim == 2 else 2)
    weights = np.zeros((len(points), cells.shape[1]))
    for row, point in zip(weights, points.tolist(), strict=True):
        found = row.tolist()
        kind.InterpolateFunctions(point, found)
        row[:] = found
    nodes, weights = np.repeat(cells, len(points), axis=0), np.tile(weights, (len(cells), 1))
    # points on a side that cells share are one: shading goes on across it
    hashed = np.random.default_rng(0).random((len(reference), 2))
    keys = np.round(np.einsum("mk,mkd->md", weights, hashed[nodes]) / SAME)
    _, first, number = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    table, nodes, weights = number.reshape(len(cells), -1), nodes[first], weights[first]
    if dim == 1:
        return Pieces(nodes, weights, NOTHING, NOTHING, table)
    faces = table[:, pieces].reshape(-1, pieces.shape[1])
    return Pieces(nodes, weights, faces, table[:, around], NOTHING)


def lattice(side: int, corners: int) -> tuple[Floats, Ints, Ints]:
    """Points of a regular lattice on a reference cell, the pieces between them, and those around.

    Args:
        side: Pieces along a side.
        corners: Corners of the cell; 2: a line.

    Returns:
        Places of the points, shape (m, 3), pieces, shape (p, 3 or 4), and points around the cell,
        the first one again at the end.
    """
    i, j = np.indices((side + 1, side + 1 if corners > 2 else 1))
    inside = (i + j <= side) | (corners == 4)
    node = np.where(inside, np.cumsum(inside).reshape(i.shape) - 1, -1)
    points = np.stack([i[inside], j[inside], 0 * i[inside]], axis=1) / side
    if corners == 2:
        return points, NOTHING, node[:, 0]
    pieces = np.stack([node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]], axis=-1)
    pieces, up = pieces.reshape(-1, 4), np.arange(side)
    sides = [node[up, 0], node[side, up], node[side - up, side], node[0, side - up]]
    if corners == 3:
        pieces = np.concatenate([pieces[:, [0, 1, 3]], pieces[:, [1, 2, 3]]])
        pieces = pieces[(pieces >= 0).all(axis=1)]
        sides = [node[up, 0], node[side - up, up], node[0, side - up]]
    return points, pieces, np.array([*np.concatenate(sides), node[0, 0]])


@dataclass(frozen=True)
class Shape:
    """A body, or all joints or rigid bodies, as it is drawn.

    Attributes:
        name: Its name.
        reference: Positions of its nodes, shape (n, 3).
        dots: Nodes that are marked.
        cells: Nodes of its cells in the order of VTK, shape (c, k).
        kind: One of these cells, as VTK has it; None: there are none.
        thickness: The largest thickness of a shell, or size of a beam's cross-section; 0: none.
    """

    name: str
    reference: Floats
    dots: Ints
    cells: Ints
    kind: Any = None
    thickness: float = 0.0

    def marked(self, values: Floats) -> Floats:
        """Values at the nodes that are marked, from those at all nodes."""
        return np.asarray(values[self.dots])

    @cached_property
    def fine(self) -> Pieces:
        """Flat pieces, outlines of elements and lines."""
        return pieces_of(self.cells, self.kind, self.reference)


def shape_of(fields: Fields, name: str) -> Shape:
    """The shape of a body from the file of its first state.

    Args:
        fields: The fields of a run.
        name: The body.
    """
    first_file = next(iter(fields.states(name)))
    grid = read_grid(first_file)
    point_data = grid.GetPointData()
    if point_data.GetArray(REFERENCE) is None:
        raise SceneError(f"{first_file} is damaged (it has no {REFERENCE})")
    reference = numbers(point_data.GetArray(REFERENCE))
    types, cells = numbers(grid.GetCellTypes()), grid.GetCells()
    starts = numbers(cells.GetOffsetsArray())[:-1].astype(np.int64)
    nodes = numbers(cells.GetConnectivityArray()).astype(np.int64)
    dots = nodes[starts[types == VERTEX]]
    table, kind = np.zeros((0, 1), dtype=np.int64), None
    for first in np.flatnonzero(types != VERTEX)[:1]:
        kind, alike = grid.GetCell(int(first)), starts[types == types[first]]
        table = nodes[alike[:, None] + np.arange(kind.GetNumberOfPoints())]
    data = grid.GetCellData()
    # of beams the diameter, of shells the thickness
    sizes = [a for a in map(data.GetArray, ("size", "thickness")) if a is not None]
    thickness = float(numbers(sizes[0]).max()) if sizes else 0.0
    return Shape(name, reference, dots, table, kind, thickness)


@dataclass(frozen=True)
class State:
    """Values at the nodes of a body in one state.

    Args:
        t: Its time, or number of the mode.
        position: Positions, shape (n, 3).
        arrays: Values by the name of the field, shape (n,) or (n, k).
        components: Names of the components of each field, none of a scalar.
    """

    t: float
    position: Floats
    arrays: dict[str, Floats]
    components: dict[str, tuple[str, ...]]


def read_state(file: Path, t: float) -> State:
    """A state of a body.

    Args:
        file: Its file.
        t: Its time.
    """
    grid = read_grid(file)
    data = grid.GetPointData()
    # texts are no such arrays
    every: list[Any] = [data.GetArray(k) for k in range(data.GetNumberOfArrays())]
    named = {a.GetName(): a for a in every if a is not None and a.GetName() != REFERENCE}
    arrays = {name: numbers(array).copy() for name, array in named.items()}
    parts = {name: components(array) for name, array in named.items()}
    return State(t, numbers(grid.GetPoints().GetData()).copy(), arrays, parts)


def deformation(reference: Floats, position: Floats) -> Floats:
    """Sizes of displacements without the rigid-body motion that fits them best, shape (n,).

    What is round-off of positions is zero. The rotation is that of W. Kabsch, Acta Cryst. A32
    (1976) 922.

    Args:
        reference: Nodes in the reference, shape (n, 3).
        position: Where they are.
    """
    X, x = reference - reference.mean(axis=0), position - position.mean(axis=0)
    U, _, Vt = np.linalg.svd(X.T @ x)
    turn = np.diag([1.0, 1.0, float(np.sign(np.linalg.det(U @ Vt))) or 1.0])
    found = np.linalg.norm(x - X @ (U @ turn @ Vt), axis=1)
    far = max(float(np.abs(places).max()) for places in (reference, position))
    return np.where(found > ROUND_OFF * far, found, 0.0)
