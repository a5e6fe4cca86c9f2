"""A controller that beats a flexible body up, and events where steps begin and end."""

import numpy as np
import pytest

from shellmb.observers.forces.joints import JointForces
from shellmb.observers.probes import Probes
from shellmb.scene import (
    GROUND,
    PID,
    Clamped,
    Command,
    EdgeForce,
    Event,
    InitialVelocity,
    Lock,
    Probe,
    Revolute,
    RigidBody,
    Scene,
    Sensor,
)
from tests.hard.conftest import LATER

SCHEMES = [("ep", 0.0), pytest.param("ed", 1.0, marks=pytest.mark.slow), *LATER]
ANGLE = Sensor("pin.rotation")


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_high_gain_of_a_sampled_controller(scheme, alpha, plate, watch, worst) -> None:
    """Against its limits at nearly every sample, late by ten periods of the higher modes."""
    pid = PID("beat", Sensor("tip"), 0.1, 1.0, kd=5.0, limits=(-5e-4, 5e-4), period=4.0)
    watched = watch(
        plate(
            scheme,
            alpha,
            supports=Clamped("left"),
            loads=EdgeForce("right", (0, 0, 1.0), time=Command("beat")),
            probes=Probe("tip", (1.0, 0.5, 0.0)),
            controllers=pid,
            dt=2.0,
            t_end=200.0,
        ),
        Probes(),
    )
    watched.check(worst)
    (sampler,) = watched.simulation.control.samplers
    assert abs(sampler.outputs["u"]) == 5e-4
    # it never comes to rest
    assert np.abs(np.diff(watched.given[-20:])).max() > 1e-6


@pytest.mark.parametrize("off", [1e-11, -1e-11, 0.0])
@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_events_where_steps_begin_and_end(scheme, alpha, off, watch, worst) -> None:
    """Locked and let go again in turn, 1e-11 s before or behind the ends of steps of 0.05 s."""
    # conditions on time alone: an angle less itself
    now = ANGLE - ANGLE
    lock = Event(
        "lock",
        when=now >= (lambda t: 0.1 + off - t),
        until=now >= (lambda t: 0.25 + off - t),
    )
    rods = [
        RigidBody(n, 1.0, (0.01, 0.1, 0.1), position=(x, 0, 0)) for n, x in (("a", 0.5), ("b", 1.5))
    ]
    hip = Revolute("hip", GROUND, "a", at=(0, 0, 0), axis=(0, 0, 1))
    scene = Scene(
        "events",
        rigid_bodies=rods,
        joints=[hip, Revolute("pin", "a", "b", at=(1, 0, 0), axis=(0, 0, 1))],
        initial=[
            InitialVelocity(spin=(0, 0, 2.0), body="a"),
            InitialVelocity(spin=(0, 0, -3.0), about=(1, 0, 0), linear=(0, 2.0, 0), body="b"),
        ],
        events=lock,
        locks=Lock("pin", when="lock"),
        scheme=scheme,
        alpha=alpha,
        dt=0.05,
        t_end=0.5,
    )
    watched = watch(scene, JointForces())
    watched.check(worst)
    (event,) = watched.simulation.control.watches
    assert len(event.times) == 2
    late = np.array(event.times) - [0.1 + off, 0.25 + off]
    assert np.all(late >= -1e-12)
    worst("event late, in steps", float(late.max()) / 0.05, 1.1e-6)
