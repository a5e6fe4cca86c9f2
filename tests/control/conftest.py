"""A mass on a slide and an arm on a hinge, which controllers move and events watch."""

from typing import Any

import pytest

from shellmb.scene import GROUND, Prismatic, Revolute, RigidBody, Scene

MASS, LENGTH = 2.0, 1.0


def make_slider(**changes: Any) -> Scene:
    """A mass that slides along x: with EP its motion under constant forces is exact."""
    body = RigidBody("mass", MASS, (0.1, 0.1, 0.1))
    slide = Prismatic("slide", GROUND, "mass", at=(0, 0, 0), axis=(1, 0, 0))
    given = {"joints": slide, "scheme": "ep", "dt": 0.01, "t_end": 1.0} | changes
    return Scene("slider", rigid_bodies=body, **given)


def make_arm(**changes: Any) -> Scene:
    """A uniform rod on a hinge about y; a positive angle turns it down."""
    inertia = MASS * LENGTH**2 / 12
    rod = RigidBody("arm", MASS, (1e-3, inertia, inertia), com=(LENGTH / 2, 0, 0))
    hinge = Revolute("hinge", GROUND, "arm", at=(0, 0, 0), axis=(0, 1, 0))
    given = {"scheme": "ep", "dt": 0.01, "t_end": 1.0} | changes
    return Scene("arm", rigid_bodies=rod, joints=hinge, **given)


@pytest.fixture
def slider() -> Any:
    """Makes the mass on a slide."""
    return make_slider


@pytest.fixture
def arm() -> Any:
    """Makes the arm on a hinge."""
    return make_arm
