"""A satellite deploys two panels in turn: it turns away and back, and its momentum stays zero.

Two panels are hinged at the bus by beams along their edges, and folded down along its sides. Motors
in the hinges turn them out, the second one later. Nothing acts from outside: linear and angular
momentum stay zero, by which the turn of the bus follows from that of rigid panels, as

    (sum of all angular momenta per rate of the bus) rate = -(those per rate of the hinges)

integrated here as a plane problem with one unknown. It ends turned: how far depends on the order in
which panels open. Flexible panels lag behind as they bend, and swing about it.
"""

# KIND: mechanisms
# CI: shellmb run satellite --check
# CI: shellmb run satellite --set model=rigid --scheme ep4 --check --no-pictures --out runs/ci-rigid

import math
from functools import partial
from typing import Literal

import numpy as np
from scipy.integrate import solve_ivp

from shellmb.scene import (
    AlongEdge,
    Beam,
    Driver,
    Glue,
    Isotropic,
    Modal,
    Output,
    Probe,
    Rectangle,
    RectangularSection,
    Revolute,
    RigidBody,
    Scene,
    Shell,
)

BUS, SIDE = 150.0, 1.0  # mass [kg], of a cube [m]
LENGTH, WIDTH, THICKNESS = 2.4, 1.0, 8e-3  # of a panel [m]
E, DENSITY = 10e9, 600.0  # of the panels [Pa], [kg/m^3]
ROOT = RectangularSection(E=70e9, nu=0.3, width=0.02, height=0.02, density=2700.0)
TURN, TAKES, LATER = math.pi / 2, 3.0, 2.0  # [rad], [s], [s]
HINGE = (SIDE / 2, 0.0, SIDE / 2)
# by which sign it is right and left
PANELS = {"right": 1, "left": -1}


def opening(t, begin):
    """Angle of a hinge, smooth to the second derivative [rad]."""
    s = min(max((t - begin) / TAKES, 0.0), 1.0)
    return TURN * (s - math.sin(2 * math.pi * s) / (2 * math.pi))


def scene(
    model: Literal["exact", "modal", "rigid"] = "exact", dt: float = 0.05, t_end: float = 6.0
):
    """The satellite.

    Args:
        model: How the panels deform: exactly, in their first ten modes, or not at all.
        dt: Time step [s].
        t_end: End of the run [s].
    """
    word = Modal(modes=10) if model == "modal" else model
    section = Isotropic(E, 0.3, thickness=THICKNESS, density=DENSITY)
    inertia = BUS * SIDE**2 / 6
    shells, beams, glues, joints, drivers, probes = [], [], [], [], [], []
    for name, sign in PANELS.items():
        hinge = (sign * HINGE[0], 0.0, HINGE[2])
        corner = (hinge[0], -WIDTH / 2, hinge[2])
        # down along the side of the bus
        surface = Rectangle(LENGTH, WIDTH, corner, axis1=(0, 0, -1), axis2=(0, 1, 0))
        shells.append(Shell(name, surface, section, mesh=(4, 1), model=word))
        beams.append(Beam(f"{name} root", AlongEdge(name, "left"), ROOT, model=word))
        glues.append(Glue(f"{name} root", name))
        joints.append(
            Revolute(f"{name} hinge", "bus", f"{name} root", at=hinge, axis=(0, -sign, 0))
        )
        turn = partial(opening, begin=0.0 if sign > 0 else LATER)
        drivers.append(Driver(f"{name} motor", f"{name} hinge", rotation=turn))
        tip = (hinge[0], 0.0, hinge[2] - LENGTH)
        probes.append(Probe(f"{name}_tip", tip, "position", 0, body=name))
    probes.append(Probe("turn", "center", "rotation", 1, body="bus"))
    probes.append(Probe("recoil", "center", component=2, body="bus"))
    return Scene(
        "satellite",
        shells,
        beams=beams,
        glues=glues,
        rigid_bodies=RigidBody("bus", BUS, (inertia, inertia, inertia), shape="box"),
        joints=joints,
        drivers=drivers,
        probes=probes,
        scheme="ep",
        dt=dt,
        t_end=t_end,
        output=Output(fields=("velocity",) if model != "exact" else ("M", "force"), frames=61),
        units="m, kg, s",
    )


def turn_of_rigid_panels(time):
    """Turn of the bus about +y over time, shape (n,) [rad]."""
    plate, root = LENGTH * WIDTH * THICKNESS * DENSITY, WIDTH * ROOT.width * ROOT.height * 2700.0
    # masses, and moments of inertia about the centres of mass: bus, then plate and root of each
    mass = np.array([BUS, *[plate, root] * 2])
    own = [plate * (LENGTH**2 + THICKNESS**2) / 12, root * (ROOT.width**2 + ROOT.height**2) / 12]
    inertia = np.array([BUS * SIDE**2 / 6, *own * 2])

    def in_bus(t):
        """Angular momentum per rate of the bus and due to the hinges, about the common centre."""
        places, speeds, rates = [np.zeros(2)], [np.zeros(2)], [0.0]
        for sign in PANELS.values():
            begin = 0.0 if sign > 0 else LATER
            s = (t - begin) / TAKES
            rate = TURN / TAKES * (1 - math.cos(2 * math.pi * s)) if 0 < s < 1 else 0.0
            angle = opening(t, begin)
            hinge = np.array([sign * HINGE[0], HINGE[2]])
            out = np.array([sign * math.sin(angle), -math.cos(angle)])
            across = np.array([sign * math.cos(angle), math.sin(angle)])
            places += [hinge + LENGTH / 2 * out, hinge]
            speeds += [LENGTH / 2 * rate * across, np.zeros(2)]
            rates += [-sign * rate] * 2
        x, v = (np.array(a) - mass @ np.array(a) / mass.sum() for a in (places, speeds))
        # about +y: from z to x
        of_hinges = mass @ (x[:, 1] * v[:, 0] - x[:, 0] * v[:, 1]) + inertia @ rates
        return mass @ (x**2).sum(axis=1) + inertia.sum(), of_hinges

    def rate(t, _):
        per_rate, of_hinges = in_bus(t)
        return [-of_hinges / per_rate]

    found = solve_ivp(rate, (0.0, time[-1]), [0.0], t_eval=time, rtol=1e-10, atol=1e-12)
    return found.y[0]


def results(run):
    """Turns of the bus, how far they are from those of rigid panels, and what is conserved."""
    history, summary = run.history, run.summary
    rigid = turn_of_rigid_panels(history["t"].to_numpy())
    turn = history["turn"].to_numpy()
    return {
        "largest_turn": float(turn.max()),
        "turn_at_end": float(turn[-1]),
        "rigid_turn_at_end": float(rigid[-1]),
        "from_rigid": float(np.abs(turn - rigid).max() / rigid.max()),
        "recoil": float(history["recoil"].iloc[-1]),
        "rigid": float(run.scene.shell("right").rigid),
        "linear_momentum_drift": summary["linear_momentum_drift"],
        "angular_momentum_drift": summary["angular_momentum_drift"],
        "energy_balance_error": summary["energy_balance_error"],
    }


def check(results):
    """Rigid panels: exact but for the integration in time. Flexible ones: by how much they bend.

    A strip under `m alpha x`, which turns it with the largest acceleration of the motor, is bent by
    `11 m alpha L^5 / (120 E I)` at its tip; as an angle that is 2.4 % of the turn of the hinge.
    """
    largest = 2 * math.pi * TURN / TAKES**2
    mass, bending = THICKNESS * DENSITY, E * THICKNESS**3 / 12
    lag = 11 * mass * largest * LENGTH**4 / (120 * bending)
    if results["rigid"]:
        assert results["from_rigid"] < 1e-7
        assert abs(results["turn_at_end"] - results["rigid_turn_at_end"]) < 1e-8
    else:
        assert 0.1 * lag / TURN < results["from_rigid"] < lag / TURN
        # EP; in EP4 that of each step is of fifth order
        assert results["angular_momentum_drift"] < 1e-9
    assert results["linear_momentum_drift"] < 1e-9
    assert results["energy_balance_error"] < 1e-9
