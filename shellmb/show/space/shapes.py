"""Drawn parts of a body: flat pieces, outlines of elements, lines and dots, by its nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.errors import SceneError
from shellmb.files.grids import components, numbers, read_grid
from shellmb.show.fields import REFERENCE, Fields

VERTEX, LINE = 1, 3
# corners around each face of a solid cell, in VTK's order, by how many faces it has
SIDES = {
    4: ((0, 1, 3), (1, 2, 3), (2, 0, 3), (0, 2, 1)),
    6: ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7)),
}
# displacements that are round-off, relative to positions: a hundred times what a rotation leaves
ROUND_OFF = 1e-13


@dataclass(frozen=True)
class Shape:
    """A body, or all joints or rigid bodies, as it is drawn.

    Args:
        name: Its name.
        reference: Nodes in the reference, shape (n, 3).
        faces: Corners of flat pieces, shape (f, 3 or 4).
        outlines: Nodes around each element, closed, shape (c, k).
        lines: Nodes along each line, shape (l, k).
        dots: Nodes that are marked, shape (d,).
        cells: Nodes of each element, shape (c, k), of those that are drawn as faces or lines.
        places: Where these nodes are on the reference cell, shape (k, 1 or 2).
        thickness: Diameter of the lines, thickness of the faces; 0: not known.
    """

    name: str
    reference: Floats
    faces: Ints
    outlines: Ints
    lines: Ints
    dots: Ints
    cells: Ints = field(default_factory=lambda: np.zeros((0, 1), dtype=np.int64))
    places: Floats = field(default_factory=lambda: np.zeros((0, 1)))
    thickness: float = 0.0

    def marked(self, values: Floats) -> Floats:
        """Values at the nodes that are marked, from those at all nodes."""
        return np.asarray(values[self.dots])

    @property
    def border(self) -> Ints:
        """Segments of the boundary of the surface, shape (s, 2)."""
        ends = np.stack([self.outlines[:, :-1], self.outlines[:, 1:]], axis=-1).reshape(-1, 2)
        pairs, counts = np.unique(np.sort(ends, axis=1), axis=0, return_counts=True)
        return np.asarray(pairs[counts == 1])


def shape_of(fields: Fields, name: str) -> Shape:
    """The shape of a body from the file of its first state.

    Args:
        fields: The fields.
        name: Name of the body.
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
    first = next(iter(np.flatnonzero(types != VERTEX)), None)
    nothing = np.zeros((0, 3), dtype=np.int64)
    faces, outlines, lines = nothing, nothing, nothing[:, :2]
    table, places = nothing[:, :1], np.zeros((0, 1))
    if first is not None:
        cell = grid.GetCell(int(first))
        alike = starts[types == types[first]]
        table = nodes[alike[:, None] + np.arange(cell.GetNumberOfPoints())]
        points = np.array(cell.GetParametricCoords()).reshape(-1, 3)
        places = points[:, : cell.GetCellDimension()]
        if cell.GetCellDimension() == 1:
            # the ends come first, as everywhere in VTK
            lines = table if types[first] == LINE else table[:, np.argsort(points[:, 0])]
        elif cell.GetCellDimension() == 3:
            faces = outside(table, SIDES[cell.GetNumberOfFaces()])
            outlines = np.hstack([faces, faces[:, :1]])
            # its pieces are those between corners
            table, places = nothing[:, :1], np.zeros((0, 1))
        else:
            pieces, around = lattice(places)
            faces = table[:, pieces].reshape(-1, pieces.shape[1])
            outlines = table[:, around]
    data = grid.GetCellData()
    # of beams the diameter, of shells the thickness
    sizes = [a for a in map(data.GetArray, ("size", "thickness")) if a is not None]
    thickness = float(numbers(sizes[0]).max()) if sizes else 0.0
    return Shape(name, reference, faces, outlines, lines, dots, table, places, thickness)


def lattice(points: Floats) -> tuple[Ints, Ints]:
    """Flat pieces of a Lagrange cell and the nodes around it, by the positions of its nodes.

    Args:
        points: Reference positions of the nodes, shape (n, 2).

    Returns:
        Pieces, shape (p, 3 or 4), and the closed way around, shape (k,).
    """
    i, j = (np.unique(np.round(x, 6), return_inverse=True)[1] for x in points.T)
    k = int(i.max())
    node = np.full((k + 1, k + 1), -1)
    node[i, j] = np.arange(len(points))
    pieces = np.stack([node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]], axis=-1)
    pieces, side = pieces.reshape(-1, 4), np.arange(k)
    sides = [node[side, 0], node[k, side], node[k - side, k], node[0, k - side]]
    if node[k, k] < 0:
        pieces = np.concatenate([pieces[:, [0, 1, 3]], pieces[:, [1, 2, 3]]])
        pieces = pieces[(pieces >= 0).all(axis=1)]
        sides = [node[side, 0], node[k - side, side], node[0, k - side]]
    return pieces, np.array([*np.concatenate(sides), node[0, 0]])


def outside(cells: Ints, sides: Sequence[Sequence[int]]) -> Ints:
    """Faces of solid cells that belong to one of them only, shape (f, 3 or 4).

    Args:
        cells: Nodes of each cell, the corners first, shape (c, k).
        sides: Corners around each face of a cell.
    """
    every = cells[:, np.array(sides)].reshape(-1, len(sides[0]))
    _, first, counts = np.unique(
        np.sort(every, axis=1), axis=0, return_index=True, return_counts=True
    )
    return np.asarray(every[np.sort(first[counts == 1])])


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
