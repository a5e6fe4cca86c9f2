"""Laws of motors are averaged over a step in time, as loads are, in every scheme.

The kind: what depends on time and is taken at one instant of a step, where what begins, ends or
peaks within the step counts in whole or not at all.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import ufl

from shellmb.running.execute import execute
from shellmb.scene import (
    GROUND,
    Isotropic,
    JointSpring,
    Motor,
    PointMoment,
    Prismatic,
    Rectangle,
    Revolute,
    RigidBody,
    Scene,
    Shell,
    Weld,
)

SCHEMES = [("ep", 0.0), ("ed", 0.0), ("ed", 1.0), ("ep4", 0.0), ("ed3", 0.5)]
INERTIA = 0.5
# within steps of 0.1
ON, OFF = 0.12, 0.27

LAWS: dict[str, tuple[Callable[[Any], Any], Callable[[float], float]]] = {
    "switched": (
        lambda t: ufl.conditional(ufl.And(ufl.gt(t, ON), ufl.lt(t, OFF)), 1.0, 0.0),
        lambda t: float(ON < t < OFF),
    ),
    "steep": (
        lambda t: ufl.exp(-(((t - 0.2) / 0.06) ** 2)),
        lambda t: math.exp(-(((t - 0.2) / 0.06) ** 2)),
    ),
    "linear": (lambda t: 3 * t, lambda t: 3 * t),
}


def turning(scheme: str, alpha: float, **more: Any) -> Scene:
    return Scene(
        "turning",
        rigid_bodies=RigidBody("wheel", 2.0, (0.3, 0.3, INERTIA)),
        joints=Revolute("hub", GROUND, "wheel", at=(0, 0, 0), axis=(0, 0, 1)),
        scheme=scheme,
        alpha=alpha,
        dt=0.1,
        t_end=0.5,
        **more,
    )


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
@pytest.mark.parametrize("law", LAWS)
def test_motor_turns_a_wheel_as_a_moment_does(scheme: str, alpha: float, law: str) -> None:
    """Rotations, rates and work are those of a load with the same function of time."""
    symbols, plain = LAWS[law]
    motor = Motor("motor", "hub", law=lambda x, rate, t: -0.4 * symbols(t))
    by_motor = execute(turning(scheme, alpha, force_elements=motor)).history
    load = PointMoment("origin", (0, 0, -0.4), body="wheel", time=plain)
    by_load = execute(turning(scheme, alpha, loads=load)).history
    assert abs(by_load["hub.rotation"].iloc[-1]) > 0.01
    for one, other in (("hub.rotation", "hub.rotation"), ("work_terms", "work_loads")):
        # a moment works on directors: to the error of the schemes, found 6e-5; a single instant a
        # step is off by 5 per cent and more
        near = 1e-3 * np.abs(by_load[other]).max()
        np.testing.assert_allclose(by_motor[one], by_load[other], rtol=0, atol=near)


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_impulse_of_a_motor(scheme: str, alpha: float) -> None:
    """A slide: the impulse of a smooth force is its integral to the fifth degree in time."""
    force = 3.0
    scene = Scene(
        "slide",
        rigid_bodies=RigidBody("cart", 2.0, (1.0, 1.0, 1.0)),
        joints=Prismatic("rail", GROUND, "cart", at=(0, 0, 0), axis=(1, 0, 0)),
        force_elements=Motor("motor", "rail", law=lambda x, rate, t: force * (1 - t) * t**4),
        scheme=scheme,
        alpha=alpha,
        dt=0.25,
        t_end=1.0,
    )
    energy = execute(scene).history["kinetic_energy"].iloc[-1]
    impulse = force * (1 / 5 - 1 / 6)
    assert energy == pytest.approx(impulse**2 / (2 * 2.0), rel=1e-9)


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_a_law_of_time_and_state(scheme: str, alpha: float) -> None:
    """A force `(2 + 3 t^2) (1 - rate/4)`: the motor has the rate of what it drives.

    With `w = 1 - v/4` it is `w' = -(2 + 3 t^2) w/8` of a mass of 2 kg.
    """
    scene = Scene(
        "slide",
        rigid_bodies=RigidBody("cart", 2.0, (1.0, 1.0, 1.0)),
        joints=Prismatic("rail", GROUND, "cart", at=(0, 0, 0), axis=(1, 0, 0)),
        force_elements=Motor(
            "motor", "rail", law=lambda x, rate, t: (2 + 3 * t**2) * (1 - rate / 4)
        ),
        scheme=scheme,
        alpha=alpha,
        dt=0.1,
        t_end=1.0,
    )
    energy = execute(scene).history["kinetic_energy"].iloc[-1]
    exact = 4 * (1 - math.exp(-3 / 8))
    # order 2 where the rate is that of a step, whose square the error is
    assert energy == pytest.approx(exact**2, rel=2e-3)


def driven(scheme: str, alpha: float, symbols: Callable[[Any], Any]) -> Scene:
    """A light wheel with a soft plate on it, turned by half a radian and more."""
    soft = Isotropic(E=1e5, nu=0.3, thickness=0.05, density=10.0)
    return Scene(
        "driven",
        Shell("plate", Rectangle(1.0, 0.5), soft, mesh=(2, 1)),
        rigid_bodies=RigidBody("wheel", 0.2, (0.03, 0.03, 0.05)),
        joints=(
            Revolute("hub", GROUND, "wheel", at=(0, 0, 0), axis=(0, 1, 0)),
            Weld("weld", "wheel", "plate"),
        ),
        force_elements=(
            Motor("motor", "hub", law=lambda x, rate, t: -0.5 * symbols(t)),
            JointSpring("spring", "hub", stiffness=0.5),
        ),
        scheme=scheme,
        alpha=alpha,
        dt=0.02,
        t_end=0.4,
    )


# they begin within a step, or over two of them
BEGINS: dict[str, Callable[[Any], Any]] = {
    "switched": lambda t: ufl.conditional(ufl.lt(t, 0.13), 0.0, 1.0),
    "steep": lambda t: (1 + ufl.tanh((t - 0.13) / 0.004)) / 2,
}


@pytest.mark.parametrize(
    ("scheme", "alpha"), [("ep", 0.0), ("ed", 1.0), ("ep4", 0.0), ("ed3", 0.5)]
)
@pytest.mark.parametrize("law", BEGINS)
def test_motors_that_begin_at_once_are_solved_for(scheme: str, alpha: float, law: str) -> None:
    """Kind: a force that jumps, after which Newton's method stalls and the account is open."""
    run = execute(driven(scheme, alpha, BEGINS[law]))
    assert abs(run.history["hub.rotation"]).max() > 0.3
    assert run.summary["rejected_steps"] == 0
    # old factorisations are used for as long as that is cheaper: found up to 17, and 28 with others
    assert run.history["iterations"].max() <= 22
    # found 7e-15 on one processor
    assert run.summary["energy_balance_error"] < 1e-12
