"""Full revolutions, in steps of a radian: nothing is multivalued, nothing adds up."""

import numpy as np
import pytest

from shellmb.observers.forces.joints import JointForces
from shellmb.scene import (
    GROUND,
    Driven,
    InitialVelocity,
    JointSpring,
    Revolute,
    RigidBody,
    Scene,
)
from shellmb.simulate.simulation import BaseObserver, Simulation
from tests.hard.conftest import EVERY, RIGID

TURN = 2 * np.pi


class Turned(BaseObserver):
    """Angle by which the director at a node has turned about the y axis, whole turns counted."""

    def __init__(self) -> None:
        self.angles: list[float] = [0.0]

    def accepted(self, simulation: Simulation) -> None:
        body = simulation.model.shells["plate"]
        w = simulation.problem.state("plate").x.array[body.mixed.dofs["w"]].reshape(-1, 3)[0]
        angle = np.arctan2(w[0], 1 + w[2])
        before = self.angles[-1]
        self.angles.append(before + (angle - before + np.pi) % TURN - np.pi)


@pytest.mark.parametrize(("scheme", "alpha"), EVERY)
def test_tumbling_plate_turns_many_times(scheme, alpha, plate, watch, worst) -> None:
    """Directors pass every direction, the opposite of the first one, too."""
    dt = 1.0
    turned = Turned()
    watched = watch(
        plate(
            scheme,
            alpha,
            initial=InitialVelocity(spin=(0.0, 1.0, 0.02), about=(0.5, 0.25, 0.0)),
            dt=dt,
            t_end=40 * dt,
        ),
        turned,
    )
    watched.check(worst)
    worst("unit length of directors", watched.constraints.director_max, 1e-11)
    # ED takes energy out at a radian per step, and the plate turns slower
    assert turned.angles[-1] > (5 if scheme == "ep" else 3) * TURN


@pytest.mark.parametrize(("scheme", "alpha"), EVERY)
def test_driven_edge_carries_a_plate_round_five_times(scheme, alpha, plate, watch, worst) -> None:
    """The angle of the edge rises smoothly by five turns, in steps up to a radian, and stays."""
    end, angle = 60.0, 5 * TURN
    shape = plate(
        scheme,
        alpha,
        supports=Driven(
            "left",
            axis=(0, 1, 0),
            rotation=lambda t: angle * min(t / end, 1.0) - np.sin(TURN * min(t / end, 1.0)) * 5,
        ),
        dt=1.0,
        t_end=65.0,
    )
    turned = Turned()
    watched = watch(shape, turned)
    watched.check(worst)
    # the director turns by the angle of the edge and swings about it
    assert abs(turned.angles[-1] - angle) < 1.0
    assert max(np.diff(turned.angles)) > 0.8


@pytest.mark.parametrize(("scheme", "alpha"), RIGID)
def test_torsion_spring_winds_up_by_three_turns(scheme, alpha, watch, worst) -> None:
    """A rotor on a spring of its joint's angle, three turns and not what is left of them."""
    inertia, stiffness, turns = 0.5, 0.02, 3
    omega = np.sqrt(stiffness / inertia)
    joints, angles = JointForces(), []

    class Angles(BaseObserver):
        def accepted(self, simulation: Simulation) -> None:
            angles.append((simulation.t, joints.measure()["shaft.rotation"]))

    watched = watch(
        Scene(
            "rotor",
            rigid_bodies=RigidBody("rotor", mass=1.0, inertia=(0.3, 0.4, inertia)),
            joints=Revolute("shaft", GROUND, "rotor", at=(0, 0, 0), axis=(0, 0, 1)),
            force_elements=JointSpring("spring", "shaft", stiffness),
            initial=InitialVelocity(spin=(0, 0, turns * TURN * omega)),
            scheme=scheme,
            alpha=alpha,
            dt=0.1,
            t_end=0.5 * TURN / omega,
        ),
        joints,
        Angles(),
    )
    watched.check(worst)
    t, angle = np.transpose(angles)
    # the mid-point rule turns by 2 atan(h/2) in place of h = 0.38 rad, 1.2 per cent too little,
    # there and back
    error = np.abs(angle / TURN - turns * np.sin(omega * t)).max()
    worst("angle off the harmonic motion, in turns", error, 0.2)
    assert angle.max() > (turns - 0.2) * TURN
