"""Slider-crank with a driven crank; the coupler is rigid (ED), or a beam by `flexible=True` (EP).

The crank is brought from rest to a constant rate. With a rigid coupler positions are exact to the
tolerance of Newton's method whatever the step, and the driving torque is that of the equations of
motion. With a flexible one the coupler bends under its own inertia and weight: by the deflection of
a simply supported beam under the d'Alembert load of the rigid motion, which changes slowly in terms
of the coupler's period.

With `modes=3` it is reduced to modes about a frame that moves with it, which gives the same.

EP is the better choice for the flexible one: in ED the forces inside a stiff body that turns are of
first order in the step only.
"""

# KIND: start here
# CI: shellmb run slider_crank --check --no-pictures
# CI: shellmb run slider_crank --scheme ep --check --no-pictures --out runs/ci-crank-ep
# CI: shellmb run slider_crank --set flexible=True --check --no-pictures --out runs/ci-crank-soft
# CI: shellmb run slider_crank --set flexible=True --set modes=3 --check --no-pictures --out runs/cm

from typing import Literal

import numpy as np

from shellmb.demos.references.inertia import rod
from shellmb.demos.references.slider_crank import SliderCrank
from shellmb.scene import (
    GROUND,
    Beam,
    Driver,
    Gravity,
    Line,
    Modal,
    Output,
    Prismatic,
    Probe,
    RectangularSection,
    Revolute,
    RigidBody,
    Scene,
    Spherical,
    Universal,
)

CRANK, COUPLER = 0.1, 0.4  # [m]
WIDTH, HEIGHT = 0.02, 0.004  # of the coupler's section, the height in the plane of motion [m]
DENSITY = 2700.0  # [kg/m^3]
CRANK_MASS, SLIDER_MASS = 0.2, 0.1  # [kg]
RATE, RUN_UP = 30.0, 0.1  # [rad/s], [s]
GRAVITY = 9.81  # [m/s^2]
E = 70e9  # [Pa]

COUPLER_MASS = DENSITY * WIDTH * HEIGHT * COUPLER
# about its centre
COUPLER_INERTIA = COUPLER_MASS * (COUPLER**2 + HEIGHT**2) / 12
Z = (0.0, 0.0, 1.0)

IDEAL = SliderCrank(
    CRANK,
    COUPLER,
    coupler_mass=COUPLER_MASS,
    coupler_center=COUPLER / 2,
    coupler_inertia=COUPLER_INERTIA,
    slider_mass=SLIDER_MASS,
    crank_mass=CRANK_MASS,
    crank_center=CRANK / 2,
    crank_inertia=CRANK_MASS * CRANK**2 / 3,
    gravity=GRAVITY,
)


def crank(t):
    """Angle [rad], rate and acceleration of the crank: a run-up by a cosine, then uniform."""
    t = np.asarray(t, dtype=float)
    k = np.pi / RUN_UP
    early = t < RUN_UP
    rising = RATE / 2 * (t - np.sin(k * t) / k)
    return (
        np.where(early, rising, RATE * (t - RUN_UP / 2)),
        np.where(early, RATE / 2 * (1 - np.cos(k * t)), RATE),
        np.where(early, RATE / 2 * k * np.sin(k * t), 0.0),
    )


def scene(
    flexible: bool = False,
    modes: int = 0,
    modulus: float = E,
    dt: float = 2e-3,
    t_end: float = 0.4,
):
    """The mechanism, in the x-y plane, the crank along x at the start.

    Args:
        flexible: Whether the coupler is a beam.
        modes: It is reduced to so many modes with its ends held; 0: it is geometrically exact.
        modulus: Young's modulus of the beam [Pa].
        dt: Time step [s].
        t_end: End of the run [s].
    """
    pin, end = (CRANK, 0.0, 0.0), (CRANK + COUPLER, 0.0, 0.0)
    arm = rod(CRANK_MASS, (0, 0, 0), pin, radius=0.005)
    bodies = [
        RigidBody("crank", arm.mass, arm.inertia.tolist(), position=tuple(arm.center)),
        RigidBody("slider", SLIDER_MASS, (1e-5, 1e-5, 1e-5), position=end),
    ]
    beams = []
    middle = (CRANK + COUPLER / 2, 0.0, 0.0)
    if flexible:
        # d2 = z across the plane, d3 = y in it
        section = RectangularSection(modulus, 0.3, width=WIDTH, height=HEIGHT, density=DENSITY)
        line = Line(pin, end)
        model: Literal["exact"] | Modal = Modal(modes) if modes else "exact"
        beams = [Beam("coupler", line, section, elements=4, up=(0, 1, 0), model=model)]
    else:
        inertia = (1e-3 * COUPLER_INERTIA, COUPLER_INERTIA, COUPLER_INERTIA)
        bodies.append(RigidBody("coupler", COUPLER_MASS, inertia, position=middle))
    return Scene(
        "slider_crank",
        rigid_bodies=bodies,
        beams=beams,
        # 5 + 3 + 4 + 5 constraints: with revolute joints only, three would be redundant
        joints=[
            Revolute("bearing", GROUND, "crank", at=(0, 0, 0), axis=Z),
            Spherical("pin", "crank", "coupler", at=pin),
            Universal("wrist", "slider", "coupler", at=end, axis=Z, second_axis=(0, 1, 0)),
            Prismatic("guide", GROUND, "slider", at=end, axis=(1, 0, 0)),
        ],
        drivers=Driver("drive", "bearing", rotation=lambda t: float(crank(t)[0])),
        loads=Gravity((0.0, -GRAVITY, 0.0)),
        probes=[
            Probe("slider_x", "origin", "position", 0, body="slider"),
            Probe("pin_x", pin, "position", 0, body="crank"),
            Probe("pin_y", pin, "position", 1, body="crank"),
            Probe("middle_x", middle, "position", 0, body="coupler"),
            Probe("middle_y", middle, "position", 1, body="coupler"),
        ],
        # a beam that began undeformed would vibrate about its sag
        start="equilibrium" if flexible else "given",
        scheme="ep" if flexible else "ed",
        dt=dt,
        t_end=t_end,
        output=Output(frames=81),
        units="m, kg, s",
    )


def deflection(time, modulus=E):
    """Deflection of the coupler's middle by the inertia of the rigid motion [m].

    A simply supported beam under a load that is linear in between `q0` and `q1` at its ends:
    `5 (q0 + q1) L^4 / (768 E I)`, positive along the coupler's direction turned by +90 degrees.
    """
    motion = IDEAL.motion(*crank(time))
    along = np.stack([np.cos(motion.coupler_angle), np.sin(motion.coupler_angle)], 1)
    across = np.stack([-along[:, 1], along[:, 0]], 1)
    # acceleration and gravity at the middle, half the sum of those at the ends
    turning = motion.coupler_acceleration[:, None] * across
    inward = -(motion.coupler_rate**2)[:, None] * along
    step = 1e-4
    before, after = (IDEAL.motion(*crank(np.abs(time + s))).pin for s in (-step, step))
    pin = (after - 2 * motion.pin + before) / step**2
    total = pin + COUPLER / 2 * (turning + inward) + (0.0, GRAVITY)
    load = -COUPLER_MASS / COUPLER * (total * across).sum(axis=1)
    stiffness = modulus * WIDTH * HEIGHT**3 / 12
    return 5 * 2 * load * COUPLER**4 / (768 * stiffness)


def results(run):
    """Differences from the rigid motion, the torque, and the deflection of the coupler."""
    history, summary = run.history, run.summary
    t = history["t"].to_numpy()
    motion = IDEAL.motion(*crank(t))
    torque = history["drive.torque"].to_numpy()[1:]
    # the torque is the mean over a step
    middle = IDEAL.motion(*crank((t[1:] + t[:-1]) / 2)).torque
    pin, point = (history[[f"{p}_x", f"{p}_y"]].to_numpy() for p in ("pin", "middle"))
    slider = np.stack([history["slider_x"], 0 * t], 1)
    chord = (slider - pin) / np.linalg.norm(slider - pin, axis=1)[:, None]
    bend = chord[:, 0] * (point - pin)[:, 1] - chord[:, 1] * (point - pin)[:, 0]
    found = {
        "slider_error": float(np.abs(slider[:, 0] - motion.slider).max()),
        "pin_error": float(np.abs(pin - motion.pin).max()),
        "largest_torque": float(np.abs(torque).max()),
        "torque_error": float(np.abs(torque - middle).max() / np.abs(middle).max()),
        "largest_deflection": float(np.abs(bend).max()),
        "energy_balance_error": summary["energy_balance_error"],
        "constraint_max": summary["constraint_max"],
    }
    beams = run.scene.beams
    found["flexible"] = float(bool(beams))
    found["dissipates"] = float(run.scene.scheme_name == "ed")
    if beams:
        wanted = deflection(t, beams[0].section.E)
        found["expected_deflection"] = float(np.abs(wanted).max())
        found["deflection_error"] = float(np.abs(bend - wanted).max() / np.abs(wanted).max())
    return found


def check(results):
    """Rigid: exact. Flexible: the quasi-static deflection, without the dynamic amplification.

    That is `(2 rate / 362 rad/s)^2`, about 3 %, and the force along the coupler adds 2 %.
    """
    assert results["energy_balance_error"] < 1e-9
    assert results["constraint_max"] < 1e-10
    assert results["pin_error"] < 1e-10
    if results["flexible"]:
        assert results["deflection_error"] < 0.1
        assert results["slider_error"] < 1e-4
        assert results["largest_deflection"] > 1e-4
    else:
        assert results["slider_error"] < 1e-10
        # the mean over a step of 0.06 rad against the value at its middle; in EP nothing damps the
        # oscillation of multipliers that the jerk at the end of the run-up starts
        assert results["torque_error"] < (2e-3 if results["dissipates"] else 2e-2)
