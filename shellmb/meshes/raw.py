"""A surface mesh as plain arrays on one rank, the elements of its cells, and their sizes."""

from dataclasses import dataclass, field
from typing import Literal

import basix
import numpy as np
import numpy.typing as npt

from shellmb.arrays import Floats, Ints
from shellmb.errors import SceneError

type Cell = Literal["quad", "tri"]

CELLS = {"quad": basix.CellType.quadrilateral, "tri": basix.CellType.triangle}
# vertices of the edges of a cell in the order of basix, and so of the nodes in their middles
FACETS = {"quad": ((0, 1), (0, 2), (1, 3), (2, 3)), "tri": ((1, 2), (0, 2), (0, 1))}


@dataclass(frozen=True)
class RawMesh:
    """Nodes and cells of one shell.

    Args:
        x: Positions of the nodes, each used by some cell, shape (n, 3) [m].
        cells: Nodes of each cell in the order of DOLFINx, shape (c, k).
        cell: Cell type.
        order: Order of the geometry, 1 or 2.
        normals: A vector on the positive side of each cell, shape (c, 3).
        edges: The vertices of the facets of each named edge, shape (m, 2).
        points: Node of each named point, a vertex of its cells.
        areas: Numbers of the cells of each named area.
    """

    x: Floats
    cells: Ints
    cell: Cell
    order: int
    normals: Floats
    edges: dict[str, Ints]
    points: dict[str, int]
    areas: dict[str, Ints] = field(default_factory=dict)

    @property
    def vertices(self) -> Ints:
        """Vertices of each cell, shape (c, 3 or 4)."""
        return self.cells[:, : vertex_count(self.cell)]


def vertex_count(cell: Cell) -> int:
    """Number of vertices of a cell; they come first among its nodes."""
    return 4 if cell == "quad" else 3


def facets(cells: Ints, cell: Cell) -> Ints:
    """Vertices of all facets of all cells, smaller number first, shape (c, f, 2)."""
    return np.sort(cells[:, np.array(FACETS[cell])], axis=2)


def boundary_facets(cells: Ints, cell: Cell) -> tuple[Ints, Ints]:
    """Vertices of the facets that belong to one cell only, shape (m, 2), and these cells."""
    every = facets(cells, cell).reshape(-1, 2)
    unique, first, count = np.unique(every, axis=0, return_index=True, return_counts=True)
    return unique[count == 1], first[count == 1] // len(FACETS[cell])


def cell_cross(corners: Floats) -> Floats:
    """Normal vectors, of any length, in the middle of cells, shape (c, 3).

    Args:
        corners: Positions of the vertices in the order of DOLFINx, shape (c, 3 or 4, 3).
    """
    if corners.shape[1] == 3:
        along = corners[:, 1] - corners[:, 0]
        across = corners[:, 2] - corners[:, 0]
    else:
        along = corners[:, 1] - corners[:, 0] + corners[:, 3] - corners[:, 2]
        across = corners[:, 2] - corners[:, 0] + corners[:, 3] - corners[:, 1]
    return np.cross(along, across)


def geometry_element(cell: Cell, order: int) -> basix.finite_element.FiniteElement:
    """Element of the geometry."""
    variant = basix.LagrangeVariant.equispaced
    return basix.create_element(basix.ElementFamily.P, CELLS[cell], order, variant)


def shape_functions(cell: Cell, order: int, places: Floats) -> Floats:
    """Shape functions of the geometry at places in a cell, shape (places, nodes).

    Args:
        cell: Its type.
        order: Order of the geometry.
        places: Places in the reference cell, shape (places, 2).
    """
    return np.asarray(geometry_element(cell, order).tabulate(0, places))[0, :, :, 0]


def interval_nodes(degree: int) -> Floats:
    """Nodes of lines' elements on [0, 1] from end to end, which are Lobatto's points."""
    variant = basix.LagrangeVariant.gll_warped
    element = basix.create_element(basix.ElementFamily.P, basix.CellType.interval, degree, variant)
    return np.sort(np.asarray(element.points)[:, 0])


def box(x: Floats) -> str:
    """The box around positions, shape (n, 3), as messages have it."""
    ends = zip(x.min(axis=0), x.max(axis=0), strict=True)
    return ", ".join(f"{low:.4g} to {high:.4g}" for low, high in ends)


def shown(point: Floats, size: float) -> str:
    """A position as messages have it, without the round-off of its coordinates.

    Args:
        point: Position, shape (3,).
        size: Size of the mesh.
    """
    return f"({', '.join(f'{v:.4g}' if abs(v) > 1e-9 * size else '0' for v in point)})"


# squares of squares of what lies between have finite reciprocals
SMALLEST, LARGEST = 1e-60, 1e60


def check_extent(sizes: npt.ArrayLike, unit: str, who: str) -> None:
    """Refuse elements whose sizes vanish or overflow when they are multiplied.

    Args:
        sizes: Lengths or areas of elements; zero, of degenerate ones, is for others to judge.
        unit: Their unit.
        who: The body, for the error.

    Raises:
        SceneError: Names the first such size.
    """
    sizes = np.ravel(sizes)
    wrong = sizes[((sizes > 0) & (sizes < SMALLEST)) | (sizes > LARGEST)]
    if len(wrong):
        raise SceneError(
            f"{who}: an element has {wrong[0]:.3g} {unit}; it must have between {SMALLEST:g} and "
            f"{LARGEST:g} {unit}, so give lengths in other units"
        )
