"""A gripper with two flexible fingers lifts a ball: friction between bodies that all move (ED3).

Two steel strips hang from slides and carry pads at their ends. The slides close, the strips bend,
and the pads press a ball that lies on a table. Then the hand rises by 0.1 m. Each pad is a box that
moves with its finger, and Coulomb friction of both holds the ball against its weight and inertia,
as long as that is less than `2 mu N`. The ball creeps downwards at the speed at which regularised
friction bears its weight.
"""

# KIND: mechanisms
# CI: mpiexec -n 2 shellmb run gripper --check --no-pictures

import math
from typing import Any

from shellmb.scene import (
    GROUND,
    Box,
    Contact,
    Driver,
    Gravity,
    Isotropic,
    Joint,
    Output,
    Plane,
    Prismatic,
    Probe,
    Rectangle,
    RigidBody,
    Scene,
    Shell,
    Weld,
)

RADIUS, MASS, GRAVITY = 0.03, 0.2, 9.81  # [m], [kg], [m/s^2]
LENGTH, WIDTH, THICKNESS, DENSITY, MODULUS = 0.1, 0.02, 2e-3, 7800.0, 210e9  # [m], [kg/m^3], [Pa]
PAD, CLOSING, LIFT = 0.01, 1e-3, 0.1  # thickness of a pad, way of each slide, height [m]
FRICTION, SLIP_SPEED, STIFFNESS = 0.4, 2e-3, 2e5  # -, [m/s], [N/m]
CLOSED, LIFTED = 0.1, 0.5  # [s]
# what a cantilever presses with whose clamped end is moved by that way [N]
PRESS = 3 * MODULUS * WIDTH * THICKNESS**3 / 12 / LENGTH**3 * CLOSING


def smooth(t: float, start: float, end: float) -> float:
    """A step from 0 to 1 whose velocity has no jump."""
    s = min(max((t - start) / (end - start), 0.0), 1.0)
    return s**2 * (3 - 2 * s)


def scene(closing: float = CLOSING, dt: float = 4e-3, t_end: float = 0.6):
    """The open gripper above a ball on a table.

    Args:
        closing: Way of each slide [m].
        dt: Time step [s].
        t_end: End of the run [s].
    """
    steel = Isotropic(MODULUS, 0.3, thickness=THICKNESS, density=DENSITY)
    depth = MASS * GRAVITY / STIFFNESS
    top = RADIUS + LENGTH
    law: dict[str, Any] = {
        "stiffness": STIFFNESS,
        "body": "ball",
        "radius": RADIUS,
        "relative_damping": 1.0,
    }
    inertia = 0.4 * MASS * RADIUS**2
    bodies = [
        RigidBody("ball", MASS, (inertia,) * 3, position=(0, 0, RADIUS - depth)),
        RigidBody("hand", 1.0, (1e-3,) * 3, position=(0, 0, top + 0.02)),
    ]
    shells, contacts = [], []
    joints: list[Joint] = [Prismatic("lift", GROUND, "hand", at=(0, 0, top + 0.02), axis=(0, 0, 1))]
    drivers = [Driver("hoist", "lift", translation=lambda t: LIFT * smooth(t, CLOSED, LIFTED))]
    for name, side in (("left", -1.0), ("right", 1.0)):
        x = side * (RADIUS + PAD)
        strip = Rectangle(LENGTH, WIDTH, (x, -WIDTH / 2, RADIUS), axis1=(0, 0, 1), axis2=(0, 1, 0))
        shells.append(Shell(f"{name} finger", strip, steel, mesh=(3, 1)))
        # pads press at the height of the centre of the ball
        place = (side * (RADIUS + PAD / 2), 0, RADIUS)
        bodies += [
            RigidBody(f"{name} slide", 0.1, (1e-4,) * 3, position=(x, 0, top)),
            RigidBody(f"{name} pad", 0.01, (1e-6,) * 3, position=place),
        ]
        joints += [
            Prismatic(f"{name} rail", "hand", f"{name} slide", at=(x, 0, top), axis=(-side, 0, 0)),
            Weld(
                f"{name} top", f"{name} slide", f"{name} finger", at=(x, 0, top), second_at="right"
            ),
            Weld(
                f"{name} end", f"{name} pad", f"{name} finger", at=(x, 0, RADIUS), second_at="left"
            ),
        ]
        drivers.append(
            Driver(
                f"{name} drive",
                f"{name} rail",
                translation=lambda t: closing * smooth(t, 0.0, CLOSED),
            )
        )
        contacts.append(
            Contact(
                name,
                Box(place, (PAD, WIDTH, WIDTH), rounding=1e-3),
                friction=FRICTION,
                slip_speed=SLIP_SPEED,
                obstacle_body=f"{name} pad",
                **law,
            )
        )
    contacts.append(Contact("table", Plane(), preloaded=True, **law))
    return Scene(
        "gripper",
        shells=shells,
        rigid_bodies=bodies,
        joints=joints,
        drivers=drivers,
        contacts=contacts,
        loads=Gravity((0, 0, -GRAVITY), body="ball"),
        probes=Probe("ball_z", "center", "position", component=2, body="ball"),
        scheme="ed3",
        alpha=0.5,
        dt=dt,
        t_end=t_end,
        output=Output(frames=61),
        units="m, kg, s",
    )


def results(run):
    """Forces of the pads at the end, and how the ball moved."""
    grip = (run.column("left.normal")[1:] + run.column("right.normal")[1:]) / 2
    rubs = (run.column("left.friction")[1:] + run.column("right.friction")[1:]) / 2
    height, t = run.column("ball_z"), run.column("t")
    return {
        "grip": float(grip[-1]),
        "held": float(run.column("left.Fz")[-1] + run.column("right.Fz")[-1]),
        "share_of_friction": float(rubs[-1] / (FRICTION * grip[-1])),
        "lifted": float(height[-1] - height[0]),
        "creep": float((height[-11] - height[-1]) / (t[-1] - t[-11])),
        "table_at_end": float(run.column("table.normal")[-1]),
        "sideways": float(abs(run.column("left.Fx")[1:] + run.column("right.Fx")[1:]).max()),
        "energy_balance_error": run.summary["energy_balance_error"],
    }


def check(results):
    """The ball hangs by friction alone, and creeps as the law says."""
    assert abs(results["grip"] / PRESS - 1) < 0.1, (results["grip"], PRESS)
    assert abs(results["held"] / (MASS * GRAVITY) - 1) < 1e-2
    assert results["table_at_end"] == 0
    ratio = results["share_of_friction"]
    assert ratio < 0.5
    creep = SLIP_SPEED * ratio / math.sqrt(1 - ratio**2)
    assert abs(results["creep"] / creep - 1) < 2e-2, (results["creep"], creep)
    assert 0 < LIFT - results["lifted"] < SLIP_SPEED * LIFTED
    assert results["sideways"] < 1e-6 * results["grip"]
    assert results["energy_balance_error"] < 1e-9
