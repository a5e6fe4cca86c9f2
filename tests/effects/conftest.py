"""Small scenes with and without what the tests look for."""

from dataclasses import replace
from typing import Any

import pytest

from shellmb.scene import (
    Beam,
    Clamped,
    EdgeForce,
    Gravity,
    InitialVelocity,
    Isotropic,
    JointDamper,
    JointSpring,
    Laminate,
    Line,
    PlyMaterial,
    Probe,
    Rectangle,
    RectangularSection,
    Revolute,
    RigidBody,
    Scene,
    Shell,
)

STEEL = Isotropic(E=210e9, nu=0.3, thickness=0.01, density=7800.0)
ECCENTRIC = replace(STEEL, offset=0.004)
PLY = PlyMaterial(E1=140e9, E2=10e9, nu12=0.3, G12=5e9, G13=5e9, G23=4e9, density=1600.0)
UNSYMMETRIC = Laminate.from_stacking(PLY, 0.005, (0, 90))


def make_plate(**changes: Any) -> Scene:
    """A cantilever plate of two elements, in motion."""
    shell = Shell("plate", Rectangle(1.0, 0.5), changes.pop("section", STEEL), mesh=(2, 1))
    shell = replace(shell, **changes.pop("shell", {}))
    load = EdgeForce("right", (0.0, 0.0, 10.0))
    given = {"scheme": "ep", "dt": 1e-3, "t_end": 4e-3, "loads": load} | changes
    tip = Probe("tip", (1.0, 0.0, 0.0))
    given = {"supports": Clamped("left"), "probes": tip} | given
    return Scene("plate", shell, **given)


def make_free(**changes: Any) -> Scene:
    """The plate in flight."""
    flight = InitialVelocity(linear=(1.0, 0.0, 0.0))
    return make_plate(**{"supports": (), "initial": flight, "loads": Gravity()} | changes)


def make_pendulum(**changes: Any) -> Scene:
    """A rigid arm and a flexible bar on two hinges, with a spring and a damper."""
    arm = RigidBody("arm", 2.0, (0.01, 0.2, 0.2), com=(0.5, 0, 0))
    section = RectangularSection(E=7e10, nu=0.3, width=0.02, height=0.01, density=2700.0)
    bar = Beam("bar", Line((1, 0, 0), (2, 0, 0)), section, elements=1)
    axis = (0.0, 1.0, 0.0)
    given = {
        "rigid_bodies": arm,
        "beams": bar,
        "joints": [
            Revolute("pin", "ground", "arm", at=(0, 0, 0), axis=axis),
            Revolute("hinge", "arm", "bar", at=(1, 0, 0), axis=axis, mass=0.1),
        ],
        "force_elements": [
            JointSpring("spring", "pin", stiffness=10.0),
            JointDamper("damper", "hinge", damping=0.1),
        ],
        "loads": Gravity(),
        "scheme": "ep",
        "dt": 1e-3,
        "t_end": 4e-3,
    }
    return Scene("pendulum", **given | changes)


@pytest.fixture
def plate() -> Any:
    """A cantilever plate; fields of the scene, `section` and `shell` may be changed."""
    return make_plate


@pytest.fixture
def free() -> Any:
    """The plate in flight."""
    return make_free


@pytest.fixture
def pendulum() -> Any:
    """A rigid arm and a flexible bar."""
    return make_pendulum


@pytest.fixture
def eccentric() -> Isotropic:
    """A section with s*, B and all."""
    return ECCENTRIC


@pytest.fixture
def unsymmetric() -> Laminate:
    """A section with B, without s*."""
    return UNSYMMETRIC
