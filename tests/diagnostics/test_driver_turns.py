"""Drivers and driven supports turn by less than half a turn in a step, or not at all."""

import numpy as np
import pytest

from shellmb.errors import ConvergenceError
from shellmb.running.execute import execute
from shellmb.scene import (
    GROUND,
    Driven,
    Driver,
    Isotropic,
    Rectangle,
    Revolute,
    RigidBody,
    Scene,
    Shell,
)

SCHEMES = [("ep", 0.0), ("ed", 0.0), ("ed", 1.0), ("ep4", 0.0), ("ed3", 0.5)]


def rotor(motion, scheme, alpha) -> Scene:
    return Scene(
        "rotor",
        rigid_bodies=RigidBody("rotor", mass=1.0, inertia=(0.3, 0.4, 0.5), position=(0.3, 0, 0)),
        joints=Revolute("shaft", GROUND, "rotor", at=(0, 0, 0), axis=(0, 0, 1)),
        drivers=Driver("motor", "shaft", rotation=motion),
        scheme=scheme,
        alpha=alpha,
        dt=0.1,
        t_end=1.0,
    )


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_fast_driver_keeps_the_energy_law(scheme, alpha) -> None:
    """7.6 rad in the last of the steps that are asked for: they are halved as it takes."""
    result = execute(rotor(lambda t: 40 * t**2, scheme, alpha))
    assert result.summary["rejected_steps"] > 0
    assert result.summary["energy_balance_error"] < 1e-12
    assert result.history["shaft.rotation"].iloc[-1] == pytest.approx(40.0)
    assert any(c.watch == "turning" and c.body == "rotor" for c in result.warnings)


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_jump_of_a_driver(scheme, alpha) -> None:
    """Less than half a turn is a step like others; more is refused by name."""
    result = execute(rotor(lambda t: 2.0 * (t > 0.35), scheme, alpha))
    # in ep4 the rotor rests at both ends of that step: what is exchanged over it is round-off
    bound = 1e-8 if scheme == "ep4" else 1e-12
    assert result.summary["energy_balance_error"] < bound
    with pytest.raises(ConvergenceError, match=r"driver 'motor' turns by 4 rad in a step .* pi"):
        execute(rotor(lambda t: 4.0 * (t > 0.35), scheme, alpha))


def test_driven_support_is_refused_alike() -> None:
    """Its nodes are where they ought to be: the bodies would turn the other way round."""
    soft = Isotropic(E=1.0, nu=0.3, thickness=0.2, density=1.0)
    plate = Shell("plate", Rectangle(1.0, 0.5), soft, mesh=(2, 1))
    support = Driven("left", rotation=lambda t: 1.5 * np.pi * (t > 0.25))
    scene = Scene("driven", plate, supports=support, scheme="ep", dt=0.1, t_end=1.0)
    with pytest.raises(ConvergenceError, match=r"Driven\('left'\) of 'plate' turns by 4.712 rad"):
        execute(scene)
