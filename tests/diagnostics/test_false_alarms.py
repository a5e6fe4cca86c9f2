"""Runs that have nothing to say, and words that fit what is wrong.

The kinds: a ratio of round-off to round-off; a sentence about something that the scene has not.
"""

from typing import Any

import pytest
import ufl

import shellmb as sm
from shellmb.scene.values.validate import described
from shellmb.simulate.simulation import Simulation


@pytest.mark.parametrize("metre", [1.0, 1e6])
@pytest.mark.parametrize("scheme", ["ep", "ed", "ep4", "ed3"])
def test_what_is_at_rest_says_nothing(scheme: str, metre: float) -> None:
    """Turned bodies, whose directors are rounded, free and on a hinge, in two units."""
    inertia = (0.1 * metre**2, 0.2 * metre**2, 0.3 * metre**2)
    free = sm.RigidBody("free", 1.0, inertia, rotation=(0.3, 0.4, 0.5))
    held = sm.RigidBody("held", 1.0, inertia, (0.0, 2.0 * metre, 0.0), rotation=(1e-3, 2.0, 0.7))
    hinge = sm.Revolute("hinge", sm.GROUND, "held", at=(0.0, metre, metre), axis=(0.0, 0.0, 1.0))
    scene = sm.Scene(
        "rest", rigid_bodies=[free, held], joints=hinge, scheme=scheme, dt=0.01, t_end=0.1
    )
    assert not sm.run(scene).warnings


def test_what_moves_slowly_is_still_watched() -> None:
    """A millionth of its length in a step is no rest."""
    scene = sm.Scene(
        "slow",
        rigid_bodies=sm.RigidBody("free", 1.0, (0.1, 0.2, 0.3)),
        initial=sm.InitialVelocity(spin=(1e-4, 2e-4, 1e-4)),
        scheme="ep4",
        dt=0.01,
        t_end=0.05,
    )
    summary = sm.run(scene).summary
    # round-off of 1e-16 beside a motion of 1e-6 in a step; the worst seen is 3e-11
    assert summary["energy_balance_error"] < 1e-8
    assert summary["energy_balance_error"] == summary["energy_balance_error"]


@pytest.mark.parametrize("law", [lambda x: ufl.sqrt(x - 1.0), ufl.ln], ids=["root", "logarithm"])
@pytest.mark.parametrize("scheme", ["ep", "linear-dynamics"])
def test_a_law_without_a_number_is_named_as_such(scheme: str, law: Any) -> None:
    scene = sm.Scene(
        "nan",
        rigid_bodies=sm.RigidBody("body", 1.0, (0.1, 0.2, 0.3), (1.0, 0.0, 0.0)),
        joints=sm.Revolute("hinge", sm.GROUND, "body", at=(0, 0, 0), axis=(0, 0, 1)),
        force_elements=sm.JointSpring("spring", "hinge", potential=law),
        initial=sm.InitialVelocity(spin=(0.0, 0.0, 1.0)),
        scheme=scheme,
        dt=0.01,
        t_end=0.05,
    )
    with pytest.raises(sm.ConvergenceError, match="a force is no finite number here: a law"):
        Simulation(scene).run()


def test_too_many_arguments_are_counted() -> None:
    with pytest.raises(sm.SceneError) as refused:
        sm.Isotropic(1.0, 0.3, 0.1, 1.0, 5 / 6, 0.0, 0.0, 0.0, 9.0)  # type: ignore[call-arg]
    assert "more than E, nu, thickness, density are given without their names" in str(refused.value)


def test_what_is_wrong_as_a_whole_shows_no_arguments() -> None:
    """An error that a description raises itself is said as it is."""

    @described("gadget")
    class Gadget:
        size: float

        def __post_init__(self) -> None:
            raise ValueError("its size is that of nothing")

    with pytest.raises(sm.SceneError) as refused:
        Gadget(1.0)
    assert str(refused.value) == "gadget: its size is that of nothing"


def test_rotation_is_not_named_where_nothing_turns() -> None:
    """A mass on a rail: the rival's forces are no impulses of its steps, and no rotation is why."""
    scene = sm.Scene(
        "rail",
        rigid_bodies=sm.RigidBody("mass", 1.0, (0.1, 0.2, 0.3)),
        joints=sm.Prismatic("rail", sm.GROUND, "mass", at=(0, 0, 0), axis=(1, 0, 0)),
        force_elements=sm.JointSpring("spring", "rail", 100.0, coordinate="translation"),
        initial=sm.InitialVelocity(linear=(1.0, 0.0, 0.0)),
        scheme="generalized-alpha",
        dt=0.01,
        t_end=0.5,
    )
    (said,) = (
        text for text in sm.run(scene).warnings if "momentum has an unexplained error" in text
    )
    assert "linear momentum" in said and "turns" not in said
