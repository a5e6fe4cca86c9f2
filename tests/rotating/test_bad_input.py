"""What cannot turn steadily is refused in one sentence, before anything is compiled."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import shellmb as sm
from shellmb.errors import SceneError
from shellmb.running.rotating.axis import Axis, check_steady, find_axis
from shellmb.running.rotating.campbell import campbell
from shellmb.scene import (
    Contact,
    Driver,
    Gravity,
    InitialVelocity,
    Isotropic,
    JointDamper,
    Lock,
    Modal,
    Plane,
    Prismatic,
    Rectangle,
    Revolute,
    RigidBody,
    Scene,
    Shell,
    Spring,
)

BODY = RigidBody("rotor", 1.0, (1.0, 1.0, 1.0), points={"rim": (1.0, 0, 0)})
AXLE = Revolute("axle", "ground", "rotor", at=(0, 0, 0), axis=(0, 0, 1))
Z = Axis((0, 0, 1))


def scene(**parts: Any) -> Scene:
    """A rotor and what it is held by."""
    return Scene("rotor", rigid_bodies=BODY, scheme="ep", dt=0.1, t_end=1.0, **parts)


SLIDE = Prismatic("slide", "ground", "rotor", at=(0, 0, 0), axis=(0, 0, 1))
ASIDE = Revolute("aside", "ground", "rotor", at=(1, 0, 0), axis=(0, 0, 1))
BRAKE = JointDamper("brake", "axle", damping=1.0)
HELD = Lock("axle", (0.0, 1.0))
ROPE = Spring("rope", "ground", "rotor", at=(2, 0, 0), second_at="rim", stiffness=1.0)
HOOK = Spring("hook", "ground", "rotor", at=(0, 0, 3), second_at="rim", stiffness=1.0)


RIDING = Contact("riding", Plane((0, 0, -1)), 1e4, "rotor", obstacle_body="panel")
FLOOR = Contact("floor", Plane((0, 0, -1)), 1e4, "rotor")
SKIN = Isotropic(E=70e9, nu=0.3, thickness=4e-3, density=2700.0)
IN_MODES = Shell("panel", Rectangle(1.0, 0.2), SKIN, model=Modal(modes=3))


@pytest.mark.parametrize(
    ("parts", "loaded", "said"),
    [
        ({"joints": SLIDE}, False, "'slide' holds on to ground, which does not turn along"),
        ({"joints": ASIDE}, False, "'aside' holds on to ground.*on that axis"),
        (
            {"joints": AXLE, "force_elements": BRAKE},
            False,
            "'brake' is turned in .*'axle' to ground",
        ),
        ({"joints": AXLE, "locks": HELD}, False, "lock of joint 'axle' acts in windows"),
        ({"force_elements": ROPE}, False, r"'rope' holds on to ground at \(2.*point of the axis"),
        ({"contacts": FLOOR}, False, "contact 'floor' is fixed in space"),
        (
            {"shells": replace(IN_MODES, model="rigid"), "contacts": RIDING},
            False,
            "contact 'riding' is between bodies",
        ),
        (
            {"shells": IN_MODES},
            False,
            "shell 'panel' is reduced to modes, which have no stiffening",
        ),
        (
            {"shells": replace(IN_MODES, model="floating-frame")},
            False,
            "shell 'panel' has linear strains, which have no stiffening",
        ),
        ({"loads": Gravity((0, -9.81, 0))}, True, "gravity is .*fixed in space.*along the axis"),
    ],
)
def test_what_does_not_turn_along(parts: dict[str, Any], loaded: bool, said: str) -> None:
    with pytest.raises(SceneError, match=said):
        check_steady(scene(**parts), Z, loaded)


def test_what_turns_along() -> None:
    """Weight along the axis, a rope to a point of it; loads that do not act do not matter."""
    check_steady(scene(joints=AXLE, force_elements=HOOK, loads=Gravity((0, 0, -9.81))), Z, True)
    check_steady(scene(loads=Gravity((0, -9.81, 0))), Z, False)


def test_axis_of_the_scene() -> None:
    """From a driven joint, or the initial spin; where the point moves, the axis is elsewhere."""
    driven = scene(joints=AXLE, drivers=Driver("motor", "axle", rotation=lambda t: t))
    assert find_axis(driven) == Z
    spun = scene(initial=InitialVelocity(linear=(0, 2.0, 0), spin=(0, 0, 4.0)))
    found = find_axis(spun)
    assert found.along((0, 0, 1))
    assert found.has((-0.5, 0, 7.0))
    with pytest.raises(SceneError, match="its axis of rotation is unknown; give axis"):
        find_axis(scene())
    both = scene(joints=AXLE, drivers=driven.drivers, initial=InitialVelocity(spin=(1.0, 0, 0)))
    with pytest.raises(SceneError, match="it must be one axis"):
        find_axis(both)


@pytest.mark.parametrize("rates", [[], [-1.0], [2.0, 1.0], [np.nan], 3.0, ["x"], np.ones(1) * 1j])
def test_rates(rates: Any) -> None:
    with pytest.raises(SceneError, match=r"rates are .*must be one or more numbers"):
        campbell(scene(joints=AXLE), rates, axis=(0, 0, 1))


def test_rates_of_numpy_are_rates() -> None:
    """Sequences of options are arrays, too: these ended in NumPy's error about truth values."""
    rates = np.linspace(0.0, 2.0, 2)
    found = sm.modes(scene(joints=AXLE), rates=rates, axis=(0, 0, 1), count=1, pictures=False)
    assert found.rates == rates.tolist()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"axis": (0, 0, 0)}, "axis is .*must have a direction"),
        ({"axis": (0, 1)}, "axis is .*must be three numbers"),
        ({"axis": (0, 0, 1), "about": (0, float("inf"), 0)}, "about is .*must be three numbers"),
        ({"axis": (0, 0, 1), "count": 0}, "count is 0"),
    ],
)
def test_options(options: dict[str, Any], said: str) -> None:
    with pytest.raises(SceneError, match=said):
        campbell(scene(joints=AXLE), [1.0], **options)
