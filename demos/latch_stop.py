"""A panel that a spring unfolds by a right angle, into a stop (ED3): what the stop has to bear.

A panel of an instrument is hinged along one edge to a body that stands still. A torsion spring
turns it out; after 90 degrees it runs into a stop with damping, rebounds several times, and comes
to rest against it. The panel is flexible and swings in the stop: its torque is compared with that
of a rigid panel, whose energy is all in the stop at the turn.
"""

# KIND: mechanisms
# CI: shellmb run latch_stop --set t_end=1.0 --check --no-pictures

import math

from shellmb.scene import (
    GROUND,
    Isotropic,
    JointSpring,
    JointStop,
    Output,
    Probe,
    Rectangle,
    Revolute,
    RigidBody,
    Scene,
    Shell,
    Weld,
)

LENGTH, WIDTH, THICKNESS, DENSITY = 0.6, 0.4, 4e-3, 2700.0  # [m], [kg/m^3]
SPRING, WINDING = 0.4, math.radians(180)  # [N m/rad], where the spring is at rest [rad]
OPEN, STIFFNESS, DAMPING = math.pi / 2, 500.0, 0.3  # [rad], [N m/rad], [s/rad]
# about the hinge [kg m^2]
INERTIA = DENSITY * THICKNESS * WIDTH * LENGTH * (LENGTH**2 / 3 + THICKNESS**2 / 12)
# what the spring gives on the way, and speed and torque of a rigid panel [J], [rad/s], [N m]
GIVEN = SPRING * (WINDING**2 - (WINDING - OPEN) ** 2) / 2
SPEED = math.sqrt(2 * GIVEN / INERTIA)
TORQUE = math.sqrt(2 * GIVEN * STIFFNESS)


def scene(dt: float = 4e-3, t_end: float = 1.2, damping: float = DAMPING):
    """The panel, folded, at rest.

    Args:
        dt: Time step [s].
        t_end: End of the run [s].
        damping: Damping of the stop [s/rad].
    """
    panel = Shell(
        "panel",
        Rectangle(LENGTH, WIDTH),
        Isotropic(70e9, 0.33, thickness=THICKNESS, density=DENSITY),
        mesh=(3, 1),
    )
    # a frame for the hinge, which the edge of the panel is fixed to
    flange = RigidBody("flange", 0.0, (0.0, 0.0, 0.0), position=(0, WIDTH / 2, 0))
    return Scene(
        "latch_stop",
        panel,
        rigid_bodies=flange,
        joints=(
            Weld("bolts", "flange", "panel", second_at="left"),
            Revolute("hinge", GROUND, "flange", at=(0, WIDTH / 2, 0), axis=(0, -1, 0)),
        ),
        force_elements=(
            JointSpring("spring", "hinge", stiffness=SPRING, rest=WINDING),
            JointStop("stop", "hinge", upper=OPEN, stiffness=STIFFNESS, relative_damping=damping),
        ),
        probes=Probe("tip_z", "right-bottom", body="panel"),
        scheme="ed3",
        alpha=0.5,
        dt=dt,
        t_end=t_end,
        output=Output(frames=101),
        units="m, kg, s",
    )


def results(run):
    """Speed at the stop, largest torque in it, and what is left of the motion at the end."""
    t, angle = run.column("t"), run.column("hinge.rotation")
    first = int((angle > OPEN).argmax())
    speed = (angle[first - 1] - angle[first - 2]) / (t[first - 1] - t[first - 2])
    return {
        "arrival": float(t[first]),
        "speed_at_stop": float(speed),
        "peak_torque": float(run.column("stop.torque").max()),
        "largest_angle_deg": float(math.degrees(angle.max())),
        "taken_by_stop": float(-run.column("work_terms")[-1]),
        "taken_by_scheme": float(run.column("dissipation")[-1]),
        "energy_balance_error": run.summary["energy_balance_error"],
    }


def check(results):
    """Speed and torque of a rigid panel, and the energy law."""
    # slower, by half a step and by the panel's bending
    assert abs(results["speed_at_stop"] / SPEED - 1) < 0.02, results["speed_at_stop"]
    # bending in the stop takes a part of the energy; damping adds to the torque at first
    assert 0.5 < results["peak_torque"] / TORQUE < 1.3, results["peak_torque"]
    assert 90 < results["largest_angle_deg"] < 120
    assert results["taken_by_stop"] > 0.2 * GIVEN
    assert results["energy_balance_error"] < 1e-10
