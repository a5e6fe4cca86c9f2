"""Curved cells as small flat pieces: what cells represent is met between their nodes."""

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from shellmb.show.space.shapes import Shape
from shellmb.show.space.smooth import Slab, smooth

Floats = npt.NDArray[np.float64]
NOTHING = np.zeros((0, 3), dtype=np.int64)
# nodes on the reference cell
QUAD = np.array([(i / 2, j / 2) for i in range(3) for j in range(3)])
TRIANGLE = np.array([(0, 0), (1, 0), (0, 1), (0.5, 0), (0.5, 0.5), (0, 0.5)])
LINE = np.array([[0.0], [1.0], [1 / 3], [2 / 3]])


def shape(places: Floats, cells: Any, count: int) -> Shape:
    reference = np.random.default_rng(1).random((count, 3))
    lines = np.asarray(cells) if places.shape[1] == 1 else NOTHING[:, :2]
    faces = NOTHING if places.shape[1] == 1 else np.asarray(cells)[:, :3]
    table = np.asarray(cells)
    return Shape("it", reference, faces, NOTHING, lines, NOTHING[:, 0], table, places)


@pytest.mark.parametrize(
    ("places", "degree"), [(QUAD, 2), (TRIANGLE, 2), (LINE, 3)], ids=["quad", "triangle", "line"]
)
def test_polynomials_of_the_cell_are_met(places: Floats, degree: int) -> None:
    one = shape(places, [list(range(len(places)))], len(places))
    fine = smooth(one)
    x = fine.at(places)
    for powers in np.ndindex(*(degree + 1,) * places.shape[1]):
        if places is not TRIANGLE or sum(powers) <= degree:
            values, wanted = (np.prod(p ** np.array(powers), axis=1) for p in (places, x))
            assert np.abs(fine.at(values) - wanted).max() < 1e-12
    # and they are all over the cell
    assert (x.min(), x.max()) == pytest.approx((0, 1), abs=1e-12)
    pieces = fine.lines if places is LINE else fine.faces
    assert len(np.unique(pieces)) == len(x) > len(places)


def test_neighbours_share_the_points_between_them() -> None:
    """Else each cell would be shaded by itself; and nothing else is shared."""
    second = [6, 7, 8, *range(9, 15)]
    fine = smooth(shape(QUAD, [list(range(9)), second], 15))
    side = round(math.sqrt(len(fine.faces) / 2))
    assert len(fine.weights) == 2 * (side + 1) ** 2 - (side + 1)


def test_cells_of_no_known_kind_are_drawn_by_their_nodes() -> None:
    odd = shape(QUAD[:8], [list(range(8))], 8)
    fine = smooth(odd)
    values = np.arange(8.0)
    assert (fine.at(values) == values).all() and fine.faces is odd.faces


@pytest.mark.parametrize("places", [QUAD, TRIANGLE], ids=["quad", "triangle"])
def test_a_surface_with_a_thickness_is_closed_and_has_its_volume(places: Floats) -> None:
    """The kind: cells that share a side, turned in space; the rim is about both of them."""
    # two squares side by side, or a square of two triangles
    other = places + np.array([1.0, 0.0]) if places is QUAD else 1.0 - places
    flat = np.concatenate([places, other])
    _, first, number = np.unique(flat.round(9), axis=0, return_index=True, return_inverse=True)
    cells = number.reshape(2, len(places))
    slab = Slab(smooth(shape(places, cells, len(first))), half=0.05)
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
