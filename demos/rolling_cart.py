"""A flexible plate on four wheels runs down a slope (ep4): rolling without slip, by contacts.

The plate lies on two axles, each of which carries two wheels with thin rims; under the load in its
middle it bends and bounces. Nothing slips, so the cart as a whole falls down the slope with

    a = g sin(slope) M / (M + 4 I / R^2)

whatever the plate does, friction at the wheels is `I a / R^2` uphill, and the pressures on the
ground add up to the weight across the slope less what the bouncing takes.
"""

# KIND: mechanisms
# CI: shellmb run rolling_cart --set t_end=0.2 --check --no-pictures

import numpy as np

from shellmb.scene import (
    GROUND,
    Gravity,
    Isotropic,
    Joint,
    Output,
    Probe,
    Rectangle,
    Revolute,
    RigidBody,
    Rolling,
    Scene,
    Shell,
    Spherical,
    Weld,
)

LENGTH, WIDTH, THICKNESS = 1.2, 0.6, 0.006  # of the plate [m]
DENSITY, E = 2700.0, 70e9  # [kg/m^3], [Pa]
RADIUS, WHEEL_MASS, WHEEL_INERTIA = 0.15, 1.5, 0.03  # [m], [kg], [kg m^2] about the axis
AXLE_MASS, LOAD_MASS = 2.0, 10.0  # [kg]
GRAVITY, SLOPE = 9.81, 0.2  # [m/s^2], [rad]
Y = (0.0, 1.0, 0.0)

PLATE_MASS = LENGTH * WIDTH * THICKNESS * DENSITY
MASS = PLATE_MASS + 4 * WHEEL_MASS + 2 * AXLE_MASS + LOAD_MASS
# weight down the slope and across it [N]
DOWN, ACROSS = MASS * GRAVITY * np.sin(SLOPE), MASS * GRAVITY * np.cos(SLOPE)
# down the slope [m/s^2]
ACCELERATION = GRAVITY * np.sin(SLOPE) * MASS / (MASS + 4 * WHEEL_INERTIA / RADIUS**2)


def scene(dt: float = 5e-3, t_end: float = 0.5):
    """The cart, from rest, x down the slope and z normal to it.

    Args:
        dt: Time step [s].
        t_end: End of the run [s].
    """
    middle = (LENGTH / 2, WIDTH / 2, 0.0)
    bodies = [RigidBody("load", LOAD_MASS, (0.1, 0.1, 0.1), position=middle, shape="box")]
    # the load stands on the plate's middle, and cannot turn about the director there
    joints: list[Joint] = [Weld("lashing", "load", "plate", at=middle)]
    for axle, x in (("rear", 0.0), ("front", LENGTH)):
        place = (x, WIDTH / 2, 0.0)
        bodies.append(RigidBody(axle, AXLE_MASS, (0.08, 0.002, 0.08), position=place, shape="rod"))
        # one corner carries the axle's moments; the other one may turn, and is at its distance
        joints.append(Weld(f"{axle} weld", axle, "plate", at=(x, 0, 0)))
        joints.append(Spherical(f"{axle} pin", axle, "plate", at=(x, WIDTH, 0)))
        for side, y in (("right", -0.05), ("left", WIDTH + 0.05)):
            name, center = f"{axle} {side}", (x, y, 0.0)
            half = WHEEL_INERTIA / 2
            inertia = (half, WHEEL_INERTIA, half)
            bodies.append(RigidBody(name, WHEEL_MASS, inertia, center, shape="rod"))
            joints.append(Revolute(f"{name} bearing", axle, name, at=center, axis=Y))
            joints.append(
                Rolling(
                    f"{name} contact",
                    GROUND,
                    name,
                    at=(0, 0, -RADIUS),
                    normal=(0, 0, 1),
                    axis=Y,
                    radius=RADIUS,
                )
            )
    return Scene(
        "rolling_cart",
        shells=Shell(
            "plate",
            Rectangle(LENGTH, WIDTH),
            Isotropic(E, 0.3, thickness=THICKNESS, density=DENSITY),
            mesh=(4, 2),
        ),
        rigid_bodies=bodies,
        joints=joints,
        loads=Gravity((GRAVITY * np.sin(SLOPE), 0, -GRAVITY * np.cos(SLOPE))),
        probes=[
            Probe("wheel_x", "center", "position", 0, body="rear left"),
            Probe("load_x", "center", "position", 0, body="load"),
            Probe("load_z", "center", "position", 2, body="load"),
        ],
        # wheels on one axle keep one another from sliding along it: one of two is left out
        redundant="drop",
        scheme="ep4",
        dt=dt,
        t_end=t_end,
        output=Output(frames=51),
    )


WHEELS = [f"{axle} {side}" for axle in ("rear", "front") for side in ("right", "left")]


def results(run):
    """Way of a wheel, forces on the ground, slip, and the laws."""
    history, summary = run.history, run.summary
    t = history["t"].to_numpy()
    way = history["wheel_x"].to_numpy() - history["wheel_x"].iloc[0]
    columns = {c: history[[f"{w} contact.{c}" for w in WHEELS]].to_numpy() for c in ("F1", "F3")}
    friction, pressure = (columns[c][1:].sum(axis=1) for c in ("F1", "F3"))
    gained = [history[f"momentum_{k}"].iloc[-1] / t[-1] for k in "xz"]
    slips = history[[f"{w} contact.slip" for w in WHEELS]].to_numpy()
    return {
        "way": float(way[-1]),
        "way_error": float(np.abs(way - ACCELERATION * t**2 / 2).max()),
        "mean_friction": float(friction.mean()),
        # forces are means over a step: what they give is what the cart gained
        "friction_balance": float(friction.mean() + DOWN - gained[0]),
        "pressure_balance": float(pressure.mean() - ACROSS - gained[1]),
        "least_pressure": float(columns["F3"][1:].min()),
        "bounce": float(np.ptp(history["load_z"])),
        "slip": float(slips.max()),
        "quadratic": float(run.scene.scheme_name in ("ep4", "ed3")),
        "energy_balance_error": summary["energy_balance_error"],
        "constraint_max": summary["constraint_max"],
    }


def check(results):
    """The centre of mass obeys the closed form; a wheel moves to and fro under it."""
    assert abs(results["way_error"]) < 4e-4  # of 8 mm that the load goes up and down
    friction = -4 * WHEEL_INERTIA * ACCELERATION / RADIUS**2
    # wheels that are shaken to and fro add to it in single steps
    assert abs(results["mean_friction"] / friction - 1) < 1e-2
    assert abs(results["friction_balance"]) < 1e-8 * DOWN
    assert abs(results["pressure_balance"]) < 1e-8 * ACROSS
    assert results["least_pressure"] > 0
    assert results["bounce"] > 5e-3
    if results["quadratic"]:
        assert results["slip"] < 1e-12
    assert results["energy_balance_error"] < 1e-9
    assert results["constraint_max"] < 1e-10
