"""Made-up studies: errors and times without a run."""

from pathlib import Path

import pytest

from shellmb.accuracy.studies.choice import Choice
from shellmb.accuracy.studies.points import Judged, Point, Reference
from shellmb.accuracy.studies.quantity import Quantity

SMALL = str(Path(__file__).parents[1] / "run" / "scene_small.py")


def judged(points, uncertainty=0.0, swept=("scheme", "alpha", "dt")):
    reference = Reference("finer", {"value": 1.0}, uncertainty)
    return Judged(Quantity("tip", "end"), reference, tuple(points), swept, "wall")


def point(scheme, dt, error, time, alpha=None, mesh=None, spread=0.0, uncertainty=0.0):
    choice = Choice(scheme=scheme, alpha=alpha, dt=dt, mesh=mesh)
    return Point(choice, error, error < uncertainty, time, spread)


@pytest.fixture
def two_schemes():
    """EP of second order, ED of third order and three times as dear a step."""
    steps = (0.08, 0.04, 0.02, 0.01)
    ep = [point("ep", dt, 3.0 * dt**2, 0.01 / dt) for dt in steps]
    ed = [point("ed", dt, 3.0 * dt**3, 0.03 / dt, 1.0) for dt in steps]
    return judged([*ep, *ed])
