"""Forces of elements and where strains are taken."""

from mpi4py import MPI

import numpy as np
import pytest

from shellmb.model.model import Model
from shellmb.scene import Clamped, Cylinder, Isotropic, Parametric, Rectangle, Scene, Shell


def _trapezoid(xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
    return np.stack([xi * (1 + eta), eta, 0 * xi])


@pytest.mark.parametrize("unit", [1.0, 1e3])
@pytest.mark.parametrize(
    ("surface", "distortion", "own", "there"),
    [
        (Rectangle, 0.0, {}, False),
        (Rectangle, 0.25, {}, True),
        (Rectangle, 0.25, {"stretching": False}, False),
        (Rectangle, 0.25, {"degree": 3}, False),
        (Rectangle, 0.25, {"cell": "tri"}, False),
        (Cylinder, 0.0, {}, False),
        (None, 0.0, {}, True),
    ],
)
def test_what_is_beside_twist_is_there_where_cells_are_no_parallelograms(
    surface, distortion: float, own: dict, there: bool, unit: float
) -> None:
    """Kind: a scene has only the terms that it calls for, in any unit."""
    if surface is None:
        where = Parametric(lambda xi, eta: unit * _trapezoid(xi, eta))
    else:
        where = surface(unit, unit)
    section = Isotropic(1e9 / unit**2, 0.3, thickness=0.01 * unit, density=1.0)
    shell = Shell("panel", where, section, (3, 2), distortion=distortion, **own)
    body = Model(Scene("panel", shell, supports=Clamped("bottom")), MPI.COMM_WORLD).shells["panel"]
    assert (body.tying.bow is not None) == there
