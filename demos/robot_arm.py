"""A robot arm with a flexible forearm lifts a load: motors under control, and the sag of the tip.

Two links in a vertical plane, the upper arm rigid, the forearm a strip of shell with a load at its
end. Motors at shoulder and elbow follow smooth angles by springs and dampers of their controllers,
`k (wanted - angle) + c (wanted rate - rate)`, so that in the end each holds a torque that is its
error times k. When all has come to rest, the torques are the moments of the weights, and the tip
is where rigid links would put it less the sag of a cantilever.
"""

# KIND: mechanisms
# CI: shellmb run robot_arm --check

import math

import numpy as np
import ufl

from shellmb.scene import (
    GROUND,
    AlongEdge,
    Beam,
    Glue,
    Gravity,
    Isotropic,
    Motor,
    Output,
    Probe,
    Rectangle,
    RectangularSection,
    Revolute,
    RigidBody,
    Scene,
    Shell,
    Weld,
)

UPPER, FORE, WIDTH, THICKNESS = 0.8, 0.8, 0.1, 6e-3  # [m]
E, DENSITY = 70e9, 2700.0  # of the forearm [Pa], [kg/m^3]
UPPER_MASS, LOAD = 4.0, 1.0  # [kg]
G = 9.81  # [m/s^2]
# angles of shoulder and elbow at the end, upwards from straight along x [rad]; time it takes [s]
ANGLES, TAKES = (1.0, -0.6), 1.5
# controllers: [N m/rad], [N m s/rad]
STIFFNESS, DAMPING = (4000.0, 2000.0), (400.0, 60.0)
JOINTS = ("shoulder", "elbow")
END = RectangularSection(E=E, nu=0.3, width=0.02, height=0.02, density=DENSITY)


def controller(angle, stiffness, damping):
    """Law of a motor that follows an angle."""

    def law(coordinate, rate, time):
        s = ufl.min_value(time / TAKES, 1.0)
        wanted = angle * (s - ufl.sin(2 * math.pi * s) / (2 * math.pi))
        speed = angle / TAKES * (1 - ufl.cos(2 * math.pi * s))
        return stiffness * (wanted - coordinate) + damping * (speed - rate)

    return law


def scene(dt: float = 0.04, t_end: float = 4.0):
    """The arm.

    Args:
        dt: Time step [s].
        t_end: End of the run [s].
    """
    # a strip without contraction across is a beam
    strip = Isotropic(E, 0.0, thickness=THICKNESS, density=DENSITY)
    surface = Rectangle(FORE, WIDTH, origin=(UPPER, -WIDTH / 2, 0.0))
    elbow, tip = (UPPER, 0.0, 0.0), (UPPER + FORE, 0.0, 0.0)
    # about -y: up is positive
    axis = (0, -1, 0)
    turns = UPPER_MASS * UPPER**2 / 12
    return Scene(
        "robot_arm",
        Shell("forearm", surface, strip, mesh=(4, 1)),
        beams=[
            Beam("near end", AlongEdge("forearm", "left"), END),
            Beam("far end", AlongEdge("forearm", "right"), END),
        ],
        glues=[Glue("near end", "forearm"), Glue("far end", "forearm")],
        rigid_bodies=[
            RigidBody(
                "upper arm",
                UPPER_MASS,
                (0.01, turns, turns),
                position=(UPPER / 2, 0, 0),
                shape="rod",
            ),
            RigidBody("load", LOAD, (1e-3, 1e-3, 1e-3), position=tip, shape="box"),
        ],
        joints=[
            Revolute("shoulder", GROUND, "upper arm", at=(0, 0, 0), axis=axis),
            Revolute("elbow", "upper arm", "near end", at=elbow, axis=axis),
            Weld("grip", "far end", "load", at=tip),
        ],
        force_elements=[
            Motor(f"{joint} motor", joint, controller(a, k, c))
            for joint, a, k, c in zip(JOINTS, ANGLES, STIFFNESS, DAMPING, strict=True)
        ],
        loads=Gravity((0, 0, -G)),
        probes=[
            Probe("tip_x", tip, "position", 0, body="forearm"),
            Probe("tip_z", tip, "position", 2, body="forearm"),
        ],
        start="equilibrium",
        scheme="ed3",
        alpha=0.5,
        dt=dt,
        t_end=t_end,
        output=Output(fields=("M",), frames=81),
        units="m, kg, s",
    )


def results(run):
    """Compare the tip and the torques that hold it with rigid links, sag and weights."""
    history, summary = run.history, run.summary
    last = history.iloc[-1]
    shoulder, elbow = (last[f"{joint}.rotation"] for joint in JOINTS)
    torques = [last[f"{joint} motor.torque"] for joint in JOINTS]
    slope = shoulder + elbow
    rigid = UPPER * np.array([np.cos(shoulder), np.sin(shoulder)])
    rigid += FORE * np.array([np.cos(slope), np.sin(slope)])
    behind = rigid - [last["tip_x"], last["tip_z"]]
    sag = float(behind @ [-np.sin(slope), np.cos(slope)])
    strip, end = DENSITY * WIDTH * THICKNESS * FORE, END.width * END.height * WIDTH * DENSITY
    # a cantilever under the part of the weights across it, and what the part along it adds
    stiffness = E * WIDTH * THICKNESS**3 / 12
    across, along = G * np.cos(slope), G * np.sin(slope)
    expected = across * FORE**3 * ((LOAD + end) / 3 + strip / 8) / stiffness
    buckles = (math.pi / (2 * FORE)) ** 2 * stiffness
    expected /= 1 - along * (LOAD + end + strip / 3) / buckles
    # all of the forearm hangs at the elbow
    carried = (UPPER_MASS / 2 + LOAD + 2 * end + strip) * G * UPPER * np.cos(shoulder)
    held = [a - t / k for a, t, k in zip(ANGLES, torques, STIFFNESS, strict=True)]
    return {
        "tip_x": float(last["tip_x"]),
        "tip_z": float(last["tip_z"]),
        "sag": sag,
        "sag_over_cantilever": float(sag / expected),
        "shoulder_torque": float(torques[0]),
        "elbow_torque": float(torques[1]),
        "weights_error": float(abs(torques[0] - torques[1] - carried) / carried),
        "control_error": float(np.abs([held[0] - shoulder, held[1] - elbow]).max()),
        "largest_shoulder_torque": float(history["shoulder motor.torque"].max()),
        "energy_balance_error": summary["energy_balance_error"],
        "constraint_max": summary["constraint_max"],
    }


def check(results):
    """At rest to 1e-4, as the controllers damp; the sag but for terms of second order (2.5 %)."""
    assert abs(results["sag_over_cantilever"] - 1) < 3e-3
    # at 8 s it is 1e-9
    assert results["weights_error"] < 2e-4
    assert results["control_error"] < 1e-6
    assert results["energy_balance_error"] < 1e-9
    assert results["constraint_max"] < 1e-10
