"""Distorted meshes and sliver elements give the answer of a sound mesh, and keep all laws."""

from typing import Any

import numpy as np
import pytest

from shellmb.scene import Clamped, EdgeForce, Parametric
from tests.hard.conftest import EVERY

# of a factor 9e6 from the first element to the last
GRADING = 16.0


def _graded(xi: Any, eta: Any) -> Any:
    """Elements along x from 7e-7 to 0.86 of the length, the first 350 000 times as wide."""
    return np.array([np.expm1(GRADING * xi) / np.expm1(GRADING), 0.5 * eta, 0 * xi])


def _sheared(xi: Any, eta: Any) -> Any:
    """The same rectangle with elements sheared by up to 51 degrees, back and forth."""
    shift = 0.1 * np.sin(2 * np.pi * xi) * np.sin(2 * np.pi * eta)
    return np.array([xi + shift, 0.5 * eta, 0 * xi])


MESHES: dict[str, dict[str, Any]] = {
    "distorted by 30 per cent": {"mesh": (4, 4), "distortion": 0.3},
    "distorted triangles": {"mesh": (4, 4), "distortion": 0.3, "cell": "tri"},
    "slivers along": {"mesh": (1, 50)},
    "slivers across": {"mesh": (50, 1)},
    "graded over seven decades": {
        "mesh": (8, 2),
        "surface": Parametric(_graded),
        "geometry_order": 1,
    },
    "sheared": {"mesh": (8, 4), "surface": Parametric(_sheared), "geometry_order": 1},
}
# the same motion on 8 x 4 elements: the largest deflection, which 4 x 4 meet within 0.1 per cent
SOUND = {"ep": 0.3635, "ed": 0.3476, "ep4": 0.3507, "ed3": 0.3488}
# one element along the plate, or one of 0.86 of its length, is a coarse one: 8 per cent
COARSE = {"slivers along": 0.08, "graded over seven decades": 0.04}


@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize(("scheme", "alpha"), EVERY)
def test_swaying_plate_on_a_bad_mesh(scheme, alpha, name, plate, watch, worst) -> None:
    loads = EdgeForce("right", (0, 0, 5e-4))
    watched = watch(
        plate(
            scheme,
            alpha,
            supports=Clamped("left"),
            loads=loads,
            dt=2.0,
            t_end=20.0,
            **MESHES[name],
        )
    )
    watched.check(worst)
    assert watched.rejected == 0
    body = watched.simulation.model.shells["plate"]
    q = watched.simulation.problem.levels["plate"].q.x.array
    deflection = float(np.abs(q[body.mixed.dofs["u"]]).max())
    off = abs(deflection / SOUND[scheme] - 1)
    said = "deflection, coarse as they are" if name in COARSE else "deflection"
    worst(f"{said}, beside a sound mesh", off, COARSE.get(name, 0.02))
