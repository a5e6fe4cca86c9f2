"""Massless bodies that are driven: a crank whose motion is given has no equation of its own.

The kind: a body without inertia, which is solvable where joints and drivers leave it no motion.
"""

import math
from typing import Any

import pytest

from shellmb.errors import SceneError
from shellmb.observers.account.energy import EnergyAccount
from shellmb.observers.forces.joints import JointForces
from shellmb.scene import (
    GROUND,
    Cylindrical,
    Driver,
    JointSpring,
    Prismatic,
    Revolute,
    RigidBody,
    Scene,
    Spherical,
)
from shellmb.simulate.simulation import Simulation

Z = (0.0, 0.0, 1.0)


def turned(t: float) -> float:
    return 1 - math.cos(5 * t)


def crank(mass: float, scheme: str = "ep", base: str = GROUND, kind: str = "turn") -> Scene:
    """A body at the end of a crank with a slide, both of them driven, on the ground or a base."""
    bodies = [
        RigidBody("crank", mass, (mass,) * 3),
        RigidBody("slide", mass, (mass,) * 3),
        RigidBody("bob", 1.0, (0.1, 0.1, 0.1), position=(1.0, 0.0, 0.0)),
    ]
    if base != GROUND:
        bodies.append(RigidBody(base, 2.0, (0.3, 0.3, 0.3)))
    both: dict[str, Any] = {"rotation": turned, "translation": lambda t: 0.1 * turned(t)}
    pin: Any = Revolute("pin", base, "crank", at=(0, 0, 0), axis=Z)
    if kind == "both":
        pin = Cylindrical("pin", base, "crank", at=(0, 0, 0), axis=Z)
    given = both if kind == "both" else {"rotation": turned}
    return Scene(
        "crank",
        rigid_bodies=bodies,
        joints=[
            pin,
            Prismatic("rail", "crank", "slide", at=(0.2, 0, 0), axis=(1.0, 0.0, 0.0)),
            Revolute("tip", "slide", "bob", at=(0.5, 0, 0), axis=Z),
        ],
        force_elements=JointSpring("spring", "tip", 1.0),
        drivers=[
            Driver("motor", "pin", **given),
            Driver("push", "rail", translation=lambda t: 0.1 * turned(t)),
        ],
        scheme=scheme,
        alpha={"ed": 1.0, "ed3": 0.5}.get(scheme),
        dt=0.02,
        t_end=0.1,
    )


def ends(scene: Scene) -> dict[str, float]:
    """Columns of joints at the end; the account is closed."""
    energy, forces = EnergyAccount(), JointForces()
    Simulation(scene).run([energy, forces])
    assert energy.error < 1e-12 * energy.exchanged
    return forces.measure()


@pytest.mark.parametrize(
    ("scheme", "base", "kind"),
    [
        ("ep", GROUND, "turn"),
        ("ed3", "base", "turn"),
        *(
            pytest.param(scheme, base, kind, marks=pytest.mark.slow)
            for scheme in ("ep", "ed", "ep4", "ed3")
            for base in (GROUND, "base")
            for kind in ("turn", "both")
        ),
    ],
)
def test_a_driven_crank_without_mass(scheme: str, base: str, kind: str) -> None:
    """What a crank of a billionth of the mass does, to the mass: angles, torques, forces."""
    none, least = (ends(crank(mass, scheme, base, kind)) for mass in (0.0, 1e-9))
    for column in ("tip.rotation", "motor.torque", "push.force", "tip.F1", "pin.F2"):
        # not round-off: some times the mass
        assert none[column] == pytest.approx(least[column], rel=1e-7, abs=1e-8)
    assert abs(none["motor.torque"]) > 1e-3


@pytest.mark.parametrize("what", ["free", "spherical"])
def test_a_crank_that_may_move_needs_mass(what: str) -> None:
    bodies = [RigidBody("crank", 0.0, (0.0, 0.0, 0.0)), RigidBody("bob", 1.0, (0.1, 0.1, 0.1))]
    joint: Any = Revolute("pin", GROUND, "crank", at=(0, 0, 0), axis=Z)
    if what == "spherical":
        joint = Spherical("pin", GROUND, "crank", at=(0, 0, 0))
    tip = Revolute("tip", "crank", "bob", at=(0.5, 0, 0), axis=Z)
    with pytest.raises(SceneError, match="'crank': its mass is 0; it must be greater than 0"):
        Scene("bad", rigid_bodies=bodies, joints=[joint, tip], scheme="ep", dt=0.1, t_end=1.0)
