"""Modes of rigid bodies on joints under loads: what joints carry is part of the stiffness.

The kind: multipliers of an equilibrium, which have the unit of forces in statics, in the model of a
motion, which has another one. Pendulums by closed forms, in twins of units, steps and loads.
"""

from typing import Any

import numpy as np
import pytest

from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.scene import (
    FollowerForce,
    Gravity,
    JointSpring,
    PointForce,
    Revolute,
    RigidBody,
    Scene,
)

UNITS = [(1.0, 1.0, 1.0), (1e6, 10.0, 1e3), (1e-6, 1e-3, 1e-3)]


def ziegler(load: Any, k: float = 1.0, m: float = 1.0, L: float = 1.0, dt: float = 0.5) -> Scene:
    """Two rods on springs, masses `2 m` and `m` at their ends (H. Ziegler, 1952)."""
    small = (1e-9 * m * L**2,) * 3
    bodies = [
        RigidBody("one", 2 * m, small, com=(0, 0, L)),
        RigidBody("two", m, small, com=(0, 0, 2 * L)),
    ]
    joints = [
        Revolute("a", "ground", "one", at=(0, 0, 0), axis=(0, 1, 0)),
        Revolute("b", "one", "two", at=(0, 0, L), axis=(0, 1, 0)),
    ]
    springs = [JointSpring("ka", "a", stiffness=k), JointSpring("kb", "b", stiffness=k)]
    return Scene(
        "ziegler",
        rigid_bodies=bodies,
        joints=joints,
        force_elements=springs,
        loads=load,
        scheme="static",
        dt=dt,
        t_end=1.0,
    )


def exact(P: float, follows: bool) -> Any:
    """Squares of the frequencies times `m L^2/k`, of a force `P k/L`."""
    M = np.array([[3.0, 1.0], [1.0, 1.0]])
    K = np.array([[2 - P, P - 1], [-1, 1]]) if follows else np.array([[2 - P, -1], [-1, 1 - P]])
    return np.sort_complex(np.linalg.eigvals(np.linalg.solve(M, K)))


@pytest.mark.parametrize(("k", "m", "L"), UNITS)
@pytest.mark.parametrize("dt", [0.25, 1.0])
def test_a_force_that_follows_a_rigid_body(k: float, m: float, L: float, dt: float) -> None:
    """It flutters from `(7/2 - sqrt 2) k/L`, 2.086, on; before and after as the closed form."""
    for P, grows in ((1.0, False), (2.05, False), (2.12, True), (4.0, True)):
        load = FollowerForce((0, 0, 2 * L), (0, 0, -P * k / L), body="two")
        modes = natural_modes(ziegler(load, k, m, L, dt), count=2, loaded=True)
        found = np.sort_complex(modes.omega2 + 1j * modes.imaginary) * m * L**2 / k
        # small inertia of the rods, and two squares that are near one another
        np.testing.assert_allclose(found, exact(P, True), atol=1e-6)  # not round-off
        assert any("flutter" in said for said in modes.warnings) is grows


@pytest.mark.parametrize(("k", "m", "L"), UNITS)
def test_a_force_that_keeps_its_direction(k: float, m: float, L: float) -> None:
    """It diverges from `(3 - sqrt 5)/2 k/L`, 0.382, on."""
    for P, grows in ((-2.0, False), (0.3, False), (0.5, True)):
        load = PointForce((0, 0, 2 * L), (0, 0, -P * k / L), body="two")
        modes = natural_modes(ziegler(load, k, m, L), count=2, loaded=True)
        np.testing.assert_allclose(
            modes.omega2 * m * L**2 / k, exact(P, False).real, atol=1e-6
        )  # not round-off
        assert any("divergence" in said for said in modes.warnings) is grows


@pytest.mark.parametrize("dt", [0.2, 1.0])
def test_a_pendulum_swings_by_its_weight(dt: float) -> None:
    """`omega^2 = (m g L + k)/(J + m L^2)` with a soft spring, whatever steps lead there."""
    bob = RigidBody("bob", 2.0, (0.5, 0.5, 0.5), com=(0, 0, -1.0))
    scene = Scene(
        "pendulum",
        rigid_bodies=bob,
        joints=Revolute("pin", "ground", "bob", at=(0, 0, 0), axis=(0, 1, 0)),
        force_elements=JointSpring("spring", "pin", stiffness=0.1),
        loads=Gravity((0, 0, -10.0)),
        scheme="static",
        dt=dt,
        t_end=1.0,
    )
    (square,) = natural_modes(scene, count=1, loaded=True).omega2
    assert square == pytest.approx(20.1 / 2.5, rel=1e-8)
