"""A panel that a spring unfolds latches at 90 degrees, without a clock, and a switch ends the run.

The hinge's lock waits for its angle: the step in which it reaches 90 degrees is repeated, shorter,
until it ends there. A rigid panel stops dead; it unfolds as a torsion pendulum whose time to 90
degrees is known, and the latch takes all of its energy. A flexible one swings on about the latched
hinge, whose torque is what the latch has to bear. Its run ends by itself where the tip has swung
over as far as it goes; the rigid one's when its time is over.
"""

# KIND: mechanisms
# CI: shellmb run latching_panel --check --set rigid=true

import math

from shellmb.scene import (
    GROUND,
    Event,
    Isotropic,
    JointSpring,
    Lock,
    Output,
    Probe,
    Rectangle,
    Revolute,
    RigidBody,
    Scene,
    Sensor,
    Shell,
    Weld,
)

LENGTH, WIDTH = 1.0, 0.4  # [m]
SKIN = Isotropic(E=70e9, nu=0.3, thickness=2e-3, density=2700.0)
STIFFNESS, REST = 0.5, math.radians(135.0)  # [N m/rad], [rad]
LATCH = math.radians(90.0)
# of the shaft that the panel is fixed to, about the hinge [kg m^2]
SHAFT = 1e-4
ANGLE, TIP, SPEED = Sensor("hinge.rotation"), Sensor("tip"), Sensor("tip speed")


def scene(rigid: bool = False, dt: float = 0.01, t_end: float = 3.0):
    """The panel.

    Args:
        rigid: Whether it is rigid.
        dt: Time step [s].
        t_end: End of the run, if nothing ends it before [s].
    """
    surface = Rectangle(LENGTH, WIDTH, origin=(0.0, -WIDTH / 2, 0.0))
    return Scene(
        "latching_panel",
        Shell("panel", surface, SKIN, mesh=(4, 2), model="rigid" if rigid else "exact"),
        rigid_bodies=RigidBody("shaft", 0.1, (SHAFT, SHAFT, SHAFT)),
        joints=[
            # about -y: the panel unfolds upwards
            Revolute("hinge", GROUND, "shaft", at=(0, 0, 0), axis=(0, -1, 0)),
            Weld("seam", "shaft", "panel", second_at="left"),
        ],
        force_elements=JointSpring("spring", "hinge", stiffness=STIFFNESS, rest=REST),
        locks=Lock("hinge", when="latched"),
        events=[
            Event("latched", ANGLE >= LATCH),
            # the tip has swung over by more than the latch is late, and stands still
            Event("farthest", (TIP < -1e-3) & (SPEED >= 0.0), ends=True),
        ],
        probes=[
            Probe("tip", (LENGTH, 0.0, 0.0), "position", 0, body="panel"),
            Probe("tip speed", (LENGTH, 0.0, 0.0), "velocity", 0, body="panel"),
        ],
        scheme="ed3",
        alpha=1.0,
        dt=dt,
        t_end=t_end,
        output=Output(frames=61),
        units="m, kg, s",
    )


def closed_form():
    """Time of a rigid panel to the latch, s, and its energy there, J."""
    mass = SKIN.density * SKIN.thickness * LENGTH * WIDTH
    inertia = mass * (LENGTH**2 / 3 + SKIN.thickness**2 / 12) + SHAFT
    time = math.acos(1 - LATCH / REST) / math.sqrt(STIFFNESS / inertia)
    return time, STIFFNESS * (REST**2 - (REST - LATCH) ** 2) / 2


def results(run):
    """Measure when the panel latches, what the latch takes, and how far the panel swings."""
    history, events = run.history, run.summary["events"]
    time, energy = closed_form()
    latched, over = events["latched"]["times"][0], events["farthest"]["times"]
    return {
        "latched": latched,
        "latched_over_rigid": latched / time - 1,
        "angle_error": float(abs(history["hinge.rotation"].iloc[-1] - LATCH)),
        "lost_over_energy": float(history["dissipation"].iloc[-1] / energy),
        "largest_latch_torque": float(history["hinge.lock_torque"].abs().max()),
        "farthest": over[0] if over else None,
        "swung_over": -float(history["tip"].iloc[-1]) if over else None,
        "energy_balance_error": run.summary["energy_balance_error"],
    }


def check(results):
    """The rigid panel to the error of ED3 in 100 steps; what the flexible one keeps swings on."""
    assert results["angle_error"] < 1e-6
    assert results["energy_balance_error"] < 1e-9
    if "farthest" in results:
        assert abs(results["latched_over_rigid"]) < 0.03
        assert results["lost_over_energy"] < 0.05
        assert 0.05 < results["swung_over"] < 0.5
    else:
        assert abs(results["latched_over_rigid"]) < 1e-6
        assert abs(results["lost_over_energy"] - 1) < 1e-5
