"""Stops of joints: a door, and a slide."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from shellmb.scene import (
    GROUND,
    InitialVelocity,
    JointStop,
    Prismatic,
    Revolute,
    RigidBody,
    Scene,
)

SCHEMES = [
    ("ep", 0.0),
    pytest.param("ed3", 1.0, marks=pytest.mark.slow),
    pytest.param("ep4", 0.0, marks=pytest.mark.slow),
    pytest.param("ed", 1.0, marks=pytest.mark.slow),
]
INERTIA, SPIN, STIFFNESS = 1.7 + 20 * 0.4**2, 2.0, 1e4


def door(scheme: str, alpha: float, dt: float, **more: Any) -> Scene:
    """It swings from -0.1 to 0.6 rad, and hits the upper stop first."""
    return Scene(
        "door",
        rigid_bodies=RigidBody("door", 20.0, (6.0, 6.0, 1.7), position=(0.4, 0, 1.0)),
        joints=Revolute("hinge", GROUND, "door", at=(0, 0, 1.0), axis=(0, 0, 1)),
        force_elements=JointStop("stop", "hinge", -0.1, 0.6, stiffness=STIFFNESS, **more),
        initial=InitialVelocity(spin=(0, 0, SPIN)),
        scheme=scheme,
        alpha=alpha,
        dt=dt,
        t_end=1.2,
    )


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_a_door_swings_between_its_stops(scheme, alpha, run) -> None:
    """Energy is exact; it is turned back at `spin sqrt(J/k)` beyond the stop."""
    found = run(door(scheme, alpha, 5e-3)).history
    energy = found.total_energy
    assert_allclose(energy.iloc[0], INERTIA * SPIN**2 / 2, rtol=1e-12)
    if alpha == 0:
        assert np.ptp(energy) < 1e-10 * energy.iloc[0]
    beyond = SPIN * math.sqrt(INERTIA / STIFFNESS)
    # one step of 5 ms in 70 ms of contact: the deepest angle is between two steps
    assert_allclose(found["hinge.rotation"].max(), 0.6 + beyond, atol=0.02 * beyond)
    assert_allclose(found["stop.torque"].max(), STIFFNESS * beyond, rtol=0.02)
    assert found["hinge.rotation"].min() < -0.1


@pytest.mark.slow
def test_a_damped_stop(run) -> None:
    """The rebound of a force that grows with the rate, as of contact; twice, once at each stop."""
    chi = 0.3
    found = run(door("ep4", 0.0, 2.5e-3, relative_damping=chi, smoothing=5e-3)).history
    after = found[(found.t > 0.5) & (found.t < 0.6)]
    rebound = math.sqrt(2 * after.kinetic_energy.iloc[0] / INERTIA)

    def fallen(v: float) -> float:
        return v / chi - math.log(1 + chi * v) / chi**2

    assert_allclose(fallen(-rebound), fallen(SPIN), rtol=2e-3)
    assert_allclose(after.work_terms, (after.total_energy - found.total_energy.iloc[0]), rtol=1e-9)


def test_a_slide_with_one_end(run) -> None:
    """A translation, with one limit only: restitution one, in the momentum."""
    scene = Scene(
        "slide",
        rigid_bodies=RigidBody("sledge", 2.0, (1.0, 1.0, 1.0)),
        joints=Prismatic("rail", GROUND, "sledge", at=(0, 0, 0), axis=(1, 0, 0)),
        force_elements=JointStop("end", "rail", upper=0.5, stiffness=2e4),
        initial=InitialVelocity(linear=(3.0, 0, 0)),
        scheme="ep",
        dt=2e-3,
        t_end=0.3,
    )
    p = run(scene).history.momentum_x
    assert_allclose([p.iloc[0], p.iloc[-1]], [6.0, -6.0], rtol=1e-10)
