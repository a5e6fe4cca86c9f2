"""Runs with contact of shells that stop and go on: at rest apart, while they touch, and after."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shellmb.errors import Stopped
from shellmb.running.execute import execute
from shellmb.running.resume import resume
from shellmb.scene import InitialVelocity, Solver
from shellmb.simulate.simulation import BaseObserver, Simulation
from tests.contact.test_faces import SPEED, plates

SLOW = pytest.mark.slow


class Stop(BaseObserver):
    """Stops behind a step."""

    def __init__(self, step: int) -> None:
        self.step = step

    def accepted(self, simulation: Simulation) -> None:
        if simulation.step == self.step:
            raise Stopped(2)


@pytest.mark.parametrize("scheme", ["ep", pytest.param("ep4", marks=SLOW)])
def test_resumed_bit_for_bit(tmp_path: Path, scheme: str) -> None:
    """Which pairs are looked at, and with which the matrix was made, goes on, too.

    It slides so far that pairs change, and is stopped before and after.
    """
    start = InitialVelocity((30.0, 10.0, -SPEED), body="up")
    scene = plates(scheme=scheme, initial=start, dt=1e-4, t_end=1.4e-3)
    # factors of earlier steps are not saved
    scene = replace(scene, solver=Solver(newton="full", tolerance=1e-11))
    whole = execute(scene, tmp_path / "whole", pictures=False)
    assert whole.history["touch.normal"].max() > 10
    parts = tmp_path / "parts"
    with pytest.raises(Stopped):
        execute(scene, parts, [Stop(6)], pictures=False)
    with pytest.raises(Stopped):
        resume(parts, [Stop(11)], scene=scene, pictures=False)
    found = resume(parts, scene=scene, pictures=False)
    one, other = (r.history.drop(columns="wall_s").to_numpy() for r in (whole, found))
    assert np.array_equal(one, other, equal_nan=True)
    for name, array in whole.simulation.arrays().items():
        assert np.array_equal(array, found.simulation.arrays()[name])
