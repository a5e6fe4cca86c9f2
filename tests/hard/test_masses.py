"""Masses and inertias from nothing to a million, no load at all, and starts that do not fit."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from shellmb.errors import ConvergenceError, SceneError
from shellmb.scene import (
    GROUND,
    Clamped,
    Driver,
    EdgeForce,
    Gravity,
    Revolute,
    RigidBody,
    Scene,
    Spherical,
    Universal,
)
from shellmb.simulate.simulation import Simulation
from tests.hard.conftest import RIGID


def rod(name: str, x: float, mass: float, inertia: float | None = None) -> RigidBody:
    """A rod of length 1 along x, from `x` on."""
    across = mass / 12 if inertia is None else inertia
    return RigidBody(name, mass, (across / 10, across, across), position=(x + 0.5, 0, 0))


def pendulum(bodies: list[RigidBody], scheme: str, alpha: float, **more: Any) -> Scene:
    """Rods in a row on ball joints, which fall from the side."""
    names = [GROUND, *(body.name for body in bodies)]
    joints = [
        Spherical(f"joint{k}", names[k], names[k + 1], at=(float(k), 0, 0))
        for k in range(len(bodies))
    ]
    given = {"loads": Gravity((0, 1.0, -9.81)), "dt": 0.01, "t_end": 0.5} | more
    return Scene("row", rigid_bodies=bodies, joints=joints, scheme=scheme, alpha=alpha, **given)


@pytest.mark.parametrize(("scheme", "alpha"), RIGID)
@pytest.mark.parametrize("masses", [(1e-6, 1.0), (1.0, 1e-6)], ids=["heavy end", "light end"])
def test_mass_ratio_of_1e6(scheme, alpha, masses, watch, worst) -> None:
    watched = watch(pendulum([rod(f"rod{k}", k, m) for k, m in enumerate(masses)], scheme, alpha))
    watched.check(worst)


@pytest.mark.parametrize(("scheme", "alpha"), RIGID)
@pytest.mark.parametrize("what", ["light link", "point mass"])
def test_vanishing_inertia(scheme, alpha, what, watch, worst) -> None:
    """A link of 1e-12 of the mass of what it links; a point mass that a joint keeps straight."""
    if what == "light link":
        bodies = [rod("a", 0, 1.0), rod("link", 1, 1e-12), rod("b", 2, 1.0)]
    else:
        bodies = [rod("a", 0, 1.0), rod("b", 1, 1.0, inertia=0.0)]
    scene = pendulum(bodies, scheme, alpha, t_end=0.5)
    if what == "point mass":
        axes = {"axis": (0, 0, 1), "second_axis": (0, 1, 0)}
        knee = Universal("joint1", "a", "b", at=(1, 0, 0), **axes)
        scene = replace(scene, joints=(scene.joints[0], knee))
    watch(scene).check(worst)


def test_a_point_mass_that_may_turn_is_named() -> None:
    bodies = [rod("a", 0, 1.0), rod("b", 1, 1.0, inertia=0.0)]
    with pytest.raises(ConvergenceError, match=r"t = 0: .*without inertia about an axis: 'b'"):
        Simulation(pendulum(bodies, "ep", 0.0))


def test_no_mass_is_refused() -> None:
    """A body without mass in dynamics is told before anything is meshed."""
    with pytest.raises(SceneError, match="'link': its mass is 0; it must be greater than 0"):
        pendulum([rod("a", 0, 1.0), rod("link", 1, 0.0)], "ep", 0.0)


@pytest.mark.parametrize("scheme", ["static", "linear-statics", "ep", "ed", "ep4", "ed3"])
def test_zero_load(scheme, plate) -> None:
    """Nothing happens, at no cost: exactly zero, one iteration in each step."""
    simulation = Simulation(
        plate(
            scheme, supports=Clamped("left"), loads=EdgeForce("right", (0, 0, 0)), dt=0.5, t_end=2.0
        )
    )
    simulation.run()
    q = simulation.problem.state("plate").x.array
    assert not np.any(q)
    assert simulation.iterations <= 2 * simulation.step


@pytest.mark.parametrize(("scheme", "alpha"), RIGID)
def test_rest_with_a_driver_that_runs_already(scheme, alpha, watch, worst) -> None:
    """All is given at rest, and the motor turns at 5 rad/s from the start: an impact."""
    bodies = [rod("a", 0, 1.0), rod("b", 1, 1.0)]
    scene = pendulum(bodies, scheme, alpha, t_end=0.5)
    shaft = Revolute("shaft", GROUND, "a", at=(0, 0, 0), axis=(0, 0, 1))
    motor = Driver("motor", "shaft", rotation=lambda t: 5.0 * t)
    watched = watch(replace(scene, joints=(shaft, scene.joints[1]), drivers=motor))
    watched.check(worst)
    # the first rod turns with the motor, and takes the second one along
    assert watched.total[0] > 0.5 * (1 / 3) * 5.0**2
