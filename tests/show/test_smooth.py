"""Curved cells as small flat pieces: what cells represent is met between their nodes."""

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import pyvista as pv

from shellmb.show.space.shapes import Pieces, Slab, pieces_of

Floats = npt.NDArray[np.float64]
# nodes on the reference cell in the order of VTK
CORNERS = [(0, 0), (1, 0), (1, 1), (0, 1)]
EIGHT = np.array([*CORNERS, (0.5, 0), (1, 0.5), (0.5, 1), (0, 0.5)])
QUAD = np.array([*EIGHT.tolist(), (0.5, 0.5)])
TRIANGLE = np.array([(0, 0), (1, 0), (0, 1), (0.5, 0), (0.5, 0.5), (0, 0.5)])
LINE = np.array([[0.0], [1.0], [1 / 3], [2 / 3]])
KINDS = {
    8: pv.CellType.QUADRATIC_QUAD,
    9: pv.CellType.LAGRANGE_QUADRILATERAL,
    6: pv.CellType.LAGRANGE_TRIANGLE,
    4: pv.CellType.LAGRANGE_CURVE,
    80: pv.CellType.HEXAHEDRON,
}


def pieces(cells: Any, count: int, kind: int | None = None) -> Pieces:
    """Pieces of cells of the kind that has so many nodes, or of another one."""
    reference, table = np.random.default_rng(1).random((count, 3)), np.asarray(cells)
    flat = np.insert(table, 0, table.shape[1], axis=1).ravel()
    types = np.full(len(table), KINDS[kind or table.shape[1]], dtype=np.uint8)
    return pieces_of(table, pv.UnstructuredGrid(flat, types, reference).GetCell(0), reference)


@pytest.mark.parametrize(
    ("places", "degree"),
    [(QUAD, 2), (TRIANGLE, 2), (LINE, 3), (EIGHT, 1)],
    ids=["quad", "triangle", "line", "eight nodes"],
)
def test_polynomials_of_the_cell_are_met(places: Floats, degree: int) -> None:
    fine = pieces([list(range(len(places)))], len(places))
    x = fine.at(places)
    for powers in np.ndindex(*(degree + 1,) * places.shape[1]):
        if places is not TRIANGLE or sum(powers) <= degree:
            values, wanted = (np.prod(p ** np.array(powers), axis=1) for p in (places, x))
            assert np.abs(fine.at(values) - wanted).max() < 1e-12
    # and they are all over the cell
    assert (x.min(), x.max()) == pytest.approx((0, 1), abs=1e-12)
    found = fine.lines if places is LINE else fine.faces
    assert len(np.unique(found)) == len(x) > len(places)


def test_neighbours_share_the_points_between_them() -> None:
    """Else each cell would be shaded by itself; and nothing else is shared."""
    second = [1, 9, 10, 2, 11, 12, 13, 5, 14]
    fine = pieces([list(range(9)), second], 15)
    side = round(math.sqrt(len(fine.faces) / 2))
    assert len(fine.weights) == 2 * (side + 1) ** 2 - (side + 1)


def test_of_solid_cells_the_outer_faces_are_drawn() -> None:
    cube = [0, 1, 2, 3, 4, 5, 6, 7]
    fine = pieces([cube, [*cube[4:], 8, 9, 10, 11]], 12, kind=80)
    assert len(fine.faces) == 10 and {4, 5, 6, 7} not in map(set, fine.faces.tolist())
    assert (fine.at(np.arange(12.0)) == np.arange(12.0)).all()


@pytest.mark.parametrize("places", [QUAD, TRIANGLE], ids=["quad", "triangle"])
def test_a_surface_with_a_thickness_is_closed_and_has_its_volume(places: Floats) -> None:
    """The kind: cells that share a side, turned in space; the rim is about both of them."""
    # two squares side by side, or a square of two triangles
    other = places + np.array([1.0, 0.0]) if places is QUAD else 1.0 - places
    flat = np.concatenate([places, other])
    _, first, number = np.unique(flat.round(9), axis=0, return_index=True, return_inverse=True)
    cells = number.reshape(2, len(places))
    slab = Slab(pieces(cells, len(first)), half=0.05)
    turn, _ = np.linalg.qr(np.random.default_rng(3).random((3, 3)))
    x = slab.place(flat[first] @ turn[:2])
    faces = slab.faces
    edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    # corners of the rim lie on those of the sides
    _, corner = np.unique(x.round(9), axis=0, return_inverse=True)
    directed = {(int(a), int(b)) for a, b in corner[edges]}
    assert len(directed) == len(edges) and directed == {(b, a) for a, b in directed}
    triangles = np.concatenate([faces[:, [0, k, k + 1]] for k in range(1, faces.shape[1] - 1)])
    volume = np.linalg.det(x[triangles]).sum() / 6
    assert abs(volume) == pytest.approx(0.1 * (2.0 if places is QUAD else 1.0), rel=1e-12)
    assert len(slab.at(np.arange(len(first)))) == len(x)
