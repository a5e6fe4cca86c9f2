"""Hinges of edges that are thrown open: hard stops, large steps, thin panels."""

import math

import pytest

from shellmb.observers.forces.joints import JointForces
from shellmb.scene import (
    GROUND,
    EdgeHinge,
    InitialVelocity,
    Isotropic,
    JointSpring,
    JointStop,
    Rectangle,
    Scene,
    Shell,
)
from tests.hard.conftest import LATER

SCHEMES = [("ep", 0.0), pytest.param("ed", 1.0, marks=pytest.mark.slow), *LATER]


@pytest.mark.parametrize("thickness", [0.2, pytest.param(0.02, marks=pytest.mark.slow)])
@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_folded_panels_fly_open_into_a_stop(scheme, alpha, thickness, watch, worst) -> None:
    """One is hinged to the ground and whirls, one is folded onto it and thrown into a stop.

    The stop is as stiff as the panel where it is soft, and 100 times so where it is thin; steps are
    an eighth of a turn.
    """
    skin = Isotropic(E=1.0, nu=0.3, thickness=thickness, density=1.0)
    folded = Rectangle(1.0, 0.5, origin=(1.0, 0.0, 0.0), axis1=(-1.0, 0.0, 0.0))
    panels = [
        Shell("a", Rectangle(1.0, 0.5), skin, mesh=(1, 1)),
        Shell("b", folded, skin, mesh=(1, 1)),
    ]
    forces, spin = JointForces(), 0.1 * thickness
    scene = Scene(
        "thrown",
        panels,
        joints=[
            EdgeHinge("root", GROUND, "a", second_at="left", rigid_angle=True),
            EdgeHinge("hinge", "a", "b", at="right", second_at="left"),
        ],
        force_elements=[
            JointSpring("spring", "hinge", 0.1 * thickness * spin**2, rest=2.5),
            JointStop("stop", "hinge", upper=0.5, stiffness=1e-2 * thickness**2),
        ],
        initial=InitialVelocity(spin=(0.0, spin, 0.0), about=(0.0, 0.0, 0.0)),
        scheme=scheme,
        alpha=alpha,
        dt=math.pi / 4 / spin,
        t_end=20 * math.pi / 4 / spin,
    )
    watched = watch(scene, forces)
    watched.check(worst)
    # it went round, and the columns know
    assert abs(forces.measure()["root.rotation"]) > 2 * math.pi
