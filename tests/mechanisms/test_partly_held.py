"""Directors that supports hold in part, in scenes whose jumps of velocities are unknowns."""

import numpy as np
import pytest

from shellmb.running.execute import execute
from shellmb.scene import PointForce, RigidBody, Scene, Solver, SymmetryPlane
from tests.scenes import SOFT, plate


def quarter(**more: float) -> Scene:
    """A quarter of a plate beside a rigid body, with which the scene is one of mechanisms."""
    return Scene(
        "quarter",
        plate(SOFT),
        rigid_bodies=RigidBody(
            "other", mass=1.0, inertia=(1.0, 1.0, 1.0), position=(5.0, 0.0, 0.0)
        ),
        supports=[
            SymmetryPlane("left", (1, 0, 0), body="plate"),
            SymmetryPlane("bottom", (0, 1, 0), body="plate"),
        ],
        loads=PointForce((1.0, 0.5, 0.0), (0, 0, -0.005), body="plate"),
        scheme="ed",
        dt=0.2,
        t_end=1.0,
        **more,
    )


@pytest.mark.parametrize("alpha", [pytest.param(0.0, marks=pytest.mark.slow), 0.5])
def test_jumps_of_partly_held_directors_do_no_work(alpha: float) -> None:
    run = execute(quarter(alpha=alpha))
    energy = run.history["kinetic_energy"].max()
    assert energy > 1e-5
    # round-off; jumps that are not tangent at planes of symmetry were 1e-3 of it
    assert np.abs(run.history["energy_balance"]).max() < 2e-12 * energy
    whole = execute(quarter(alpha=alpha, solver=Solver(solve="full")))
    # Newton's tolerance
    for name in ("kinetic_energy", "total_energy"):
        assert run.history[name].to_numpy() == pytest.approx(
            whole.history[name].to_numpy(), abs=1e-8 * energy
        )
