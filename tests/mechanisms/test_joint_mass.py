"""The mass of a joint: half of it moves with each of its ends."""

from typing import Any

import numpy as np
import pytest

from shellmb.demos.references.inertia import MassProperties, rod
from shellmb.scene import GROUND, Gravity, Probe, Revolute, RigidBody, Scene
from shellmb.simulate.simulation import Simulation

A, B, C = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.8, 0.0, 0.3)
JOINT_MASS = 0.4
Y = (0.0, 1.0, 0.0)


def _body(name: str, properties: MassProperties) -> RigidBody:
    return RigidBody(name, properties.mass, properties.inertia, position=tuple(properties.center))


def _double_pendulum(in_joint: bool, **scheme: Any) -> Scene:
    """Two rods; the mass at the hinge between them is the joint's, or halves are the rods'."""
    half = MassProperties(JOINT_MASS / 2, np.array(B), np.zeros((3, 3)))
    first, second = rod(1.0, A, B, 0.05), rod(0.7, B, C, 0.05)
    if not in_joint:
        first, second = first + half, second + half
    mass = JOINT_MASS if in_joint else 0.0
    return Scene(
        "joint_mass",
        rigid_bodies=[_body("first", first), _body("second", second)],
        joints=[
            Revolute("top", GROUND, "first", at=A, axis=Y),
            Revolute("hinge", "first", "second", at=B, axis=Y, mass=mass),
        ],
        loads=Gravity((0, 0, -9.81)),
        probes=Probe("tip", C, body="second"),
        dt=0.01,
        t_end=0.3,
        **scheme,
    )


def _end(scene: Scene) -> np.ndarray:
    """Where the end of the second rod is at the end."""
    simulation = Simulation(scene)
    simulation.run()
    rigid = simulation.model.rigid
    assert rigid is not None
    q = simulation.problem.levels[rigid.name].q.x.array
    node = rigid.bodies[rigid.index["second"]]
    frame = node.axes.T + q[rigid.local("second", "w")].reshape(3, 3)
    arm = node.axes.T @ (np.array(C) - node.center)
    return node.center + q[rigid.local("second", "u")] + arm @ frame


@pytest.mark.parametrize(("scheme", "alpha"), [("ep", 0.0), ("ed", 1.0)])
def test_mass_of_a_joint_is_carried_by_its_ends(scheme: str, alpha: float) -> None:
    with_joint = _end(_double_pendulum(True, scheme=scheme, alpha=alpha))
    with_rods = _end(_double_pendulum(False, scheme=scheme, alpha=alpha))
    # the same equations in other unknowns: equal to the tolerance of Newton's method
    assert with_joint == pytest.approx(with_rods, abs=1e-9)
    # and the mass matters
    assert np.linalg.norm(with_joint - np.array(C)) > 0.1
