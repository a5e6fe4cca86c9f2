"""Two fingers that bend grip a plate and lift it: all three are shells that deform."""

import numpy as np
import pytest

from shellmb.running.execute import execute
from shellmb.scene import (
    Contact,
    Driven,
    Faces,
    Gravity,
    Isotropic,
    Plane,
    Probe,
    Rectangle,
    Scene,
    Shell,
)

THICK, DENSITY, SIDES, LIFT = 1e-3, 2700.0, (0.04, 0.03), 0.05


def gripper(friction: float) -> Scene:
    """Fingers that close by 3 mm within 20 ms and rise from 30 ms on."""
    upright = {"axis1": (0, 1, 0), "axis2": (0, 0, 1)}
    x = THICK + 0.5e-3
    soft = Isotropic(2e9, 0.3, thickness=THICK, density=1200.0)
    hard = Isotropic(70e9, 0.3, thickness=THICK, density=DENSITY)
    fingers = [
        Shell(name, Rectangle(0.02, 0.08, origin=(at, -0.01, 0), **upright), soft, mesh=(2, 6))
        for name, at in (("left", -x), ("right", x))
    ]
    middle = Rectangle(*SIDES, origin=(0, -0.02, -0.015), **upright)

    def held(way: float) -> Driven:
        return Driven(
            "top",
            translation=lambda t: (way * min(t / 0.02, 1.0), 0.0, LIFT * max(t - 0.03, 0.0)),
            body="left" if way > 0 else "right",
        )

    law = {"body": "plate", "radius": THICK / 2, "smoothing": 1e-5}
    law |= {"friction": friction, "slip_speed": 1e-3}
    ground = Plane((0, 0, -0.0151))
    return Scene(
        "gripper",
        [*fingers, Shell("plate", middle, hard, mesh=(4, 4))],
        supports=[held(3e-3), held(-3e-3)],
        contacts=[
            *(Contact(f.name[0], Faces(f.name, THICK), 1e8, **law) for f in fingers),
            Contact("ground", ground, 1e6, body="plate", at="bottom", smoothing=1e-6),
        ],
        probes=Probe("height", (0, 0, 0), component=2, body="plate"),
        loads=Gravity(),
        scheme="ed",
        alpha=0.5,
        dt=1e-3,
        t_end=0.08,
    )


@pytest.mark.slow
def test_friction_lifts_a_plate() -> None:
    """It carries the weight, never more than `mu N`, and the plate rises with the fingers."""
    history = execute(gripper(0.5)).history
    weight = DENSITY * THICK * SIDES[0] * SIDES[1] * 9.81
    late = history[history["t"] > 0.05]
    # the plate swings a little between the fingers: 0.2 % were seen
    assert (late["l.Fz"] + late["r.Fz"]).mean() == pytest.approx(weight, rel=0.02)
    for name in "lr":
        assert np.all(late[f"{name}.friction"] <= 0.5 * late[f"{name}.normal"] * (1 + 1e-9))
    assert late["ground.normal"].max() == 0
    # it creeps by some of the slip speed: 1.2 % were seen
    rise = np.ptp(late["height"]) / np.ptp(late["t"])
    assert rise == pytest.approx(LIFT, rel=0.03) and rise < LIFT


@pytest.mark.slow
def test_too_little_friction_leaves_it_on_the_ground() -> None:
    """Each finger would have to hold a sixth of the largest normal force."""
    history = execute(gripper(0.05)).history
    late = history[history["t"] > 0.05]
    assert late["height"].max() < 2e-4 and late["ground.normal"].mean() > 0.01
    assert late["l.normal"].max() > 0.02
