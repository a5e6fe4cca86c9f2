"""Curved cells as small flat pieces: what cells represent is met between their nodes."""

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from shellmb.show.space.shapes import Shape
from shellmb.show.space.smooth import smooth

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
    return Shape("it", reference, faces, NOTHING, lines, NOTHING[:, 0], (), table, places)


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
