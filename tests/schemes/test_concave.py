"""Dissipation where potentials are concave: it takes energy, never gives it, and is in the account.

The kind: a change of a force times a change of the coordinate, which is negative where what acts
pushes away from an equilibrium. Mass and spring are a double well, begun on the hill between.
"""

from typing import Any

import numpy as np
import pytest
import ufl

from shellmb.running.execute import execute
from shellmb.scene import (
    GROUND,
    InitialVelocity,
    JointSpring,
    Potential,
    Prismatic,
    Revolute,
    RigidBody,
    Scene,
)

SLOW = pytest.mark.slow
OTHERS = [("ep", 0.0), ("ed", 0.0), ("ed", 0.5), ("ep4", 0.0)]
SCHEMES = [("ed", 1.0), ("ed3", 1.0), *(pytest.param(*pair, marks=SLOW) for pair in OTHERS)]
K, C = 50.0, 40.0
BODY = RigidBody("body", 1.0, (1.0, 1.0, 1.0))


def well(x: Any) -> Any:
    """Concave up to `x^2 = K/(3 C)`."""
    return -K * x**2 / 2 + C * x**4 / 4


def along(at: Any, p: Any) -> Any:
    """The well of a coordinate as a potential of the place, and a bowl across."""
    x, y, z = at.x
    return well(x) + K * (y**2 + z**2) / 2


def on_rail(**more: Any) -> Scene:
    rail = Prismatic("rail", GROUND, "body", at=(0, 0, 0), axis=(1, 0, 0))
    push = InitialVelocity(linear=(0.05, 0, 0))
    spring = JointSpring("spring", "rail", potential=well)
    return Scene(
        "rail", rigid_bodies=BODY, joints=rail, force_elements=spring, initial=push, **more
    )


def on_axle(**more: Any) -> Scene:
    axle = Revolute("axle", GROUND, "body", at=(0, 0, 0), axis=(0, 0, 1))
    push = InitialVelocity(spin=(0, 0, 0.05))
    hill = JointSpring("spring", "axle", potential=lambda a: 80.0 * ufl.cos(a))
    return Scene("axle", rigid_bodies=BODY, joints=axle, force_elements=hill, initial=push, **more)


def in_field(**more: Any) -> Scene:
    push = InitialVelocity(linear=(0.05, 0.02, 0.01))
    field = Potential("field", along)
    return Scene("field", rigid_bodies=BODY, potentials=field, initial=push, **more)


@pytest.mark.parametrize("make", [on_rail, on_axle, in_field])
@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
@pytest.mark.parametrize("dt", [pytest.param(0.02, marks=SLOW), 0.2])
def test_what_is_pushed_off_a_hill_gains_no_energy(dt, scheme, alpha, make) -> None:
    """Steps of a fifth of the way down and ones as long as that, in which nothing is resolved."""
    found = execute(make(scheme=scheme, alpha=alpha, dt=dt, t_end=20 * dt))
    assert found.summary["energy_balance_error"] < 1e-10
    lost, total = found.column("dissipation"), found.column("total_energy")
    size = np.abs(found.column("kinetic_energy")).max()
    assert np.all(np.diff(lost) > -1e-12 * size)
    assert np.all(np.diff(total) < 1e-11 * size)
    # it does leave the hill
    assert size > 10 * found.column("kinetic_energy")[0]
    if alpha == 0 and scheme != "ed":
        assert lost[-1] == 0.0
