"""Bodies as they are drawn, and their states, from the files of a run."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.errors import SceneError
from shellmb.files.grids import components, numbers, read_grid
from shellmb.show.fields import REFERENCE, Fields
from shellmb.show.space.smooth import Pieces, pieces_of

VERTEX = 1
# displacements that are round-off, relative to positions: a hundred times what a rotation leaves
ROUND_OFF = 1e-13


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
