"""A tape spring of a polymer is folded, held and released: it relaxes while it is held.

The curved strip is clamped at one end, the other has a stiff rim. A handle that moves in a plane
grips the rim and turns it; the fold localises. While it is held, the moment at the handle falls as
its Maxwell branches relax (a Prony series with two terms). Released, the strip springs back, and
the branches, which now lag behind, hold it away from its shape for a while. The account says what
the branches have dissipated.
"""

# KIND: vibrations and motion
# CI: shellmb run tape_spring --check --no-pictures

import math

import numpy as np

from shellmb.scene import (
    GROUND,
    AlongEdge,
    Beam,
    Clamped,
    Cylinder,
    Driver,
    Glue,
    Isotropic,
    Output,
    Prismatic,
    Probe,
    Prony,
    RectangularSection,
    Revolute,
    RigidBody,
    Scene,
    Shell,
    Weld,
)

RADIUS, ANGLE, LENGTH, THICKNESS = 0.02, 90.0, 0.25, 4e-4  # [m], [degrees]
RIM = 2e-3  # side of the beam along the end [m]
E, NU, DENSITY = 4e9, 0.35, 1300.0
# shares and times of the branches [s]
SERIES = ((0.25, 0.1), (0.2, 1.0))
FOLD, HOLD = 0.4, 1.6  # ends of folding and of holding [s]
# time that moments are averaged over [s]
MEAN = 0.4


def scene(fold: float = 70.0, relaxes: bool = True, dt: float = 8e-3, t_end: float = 2.0) -> Scene:
    """The tape spring; its axis is x, it opens downwards.

    Args:
        fold: Angle by which its end is turned [degrees].
        relaxes: Whether its section relaxes.
        dt: Time step [s].
        t_end: End [s].
    """
    half = ANGLE / 2
    tape = Cylinder(RADIUS, LENGTH, (-half, half), axis=(1, 0, 0), start=(0, 0, 1))
    rim = RectangularSection(70e9, 0.3, width=RIM, height=RIM, density=2700.0)
    section = Isotropic(
        E, NU, thickness=THICKNESS, density=DENSITY, relaxation=Prony(SERIES) if relaxes else None
    )
    middle = (LENGTH, 0.0, RADIUS)

    def turned(t: float) -> float:
        part = min(t / FOLD, 1.0)
        return math.radians(fold) * part**2 * (3 - 2 * part)

    return Scene(
        "tape_spring",
        Shell("tape", tape, section, mesh=(4, 14)),
        beams=Beam("rim", AlongEdge("tape", "top"), rim),
        glues=Glue("rim", "tape", "director"),
        rigid_bodies=[
            RigidBody(name, 2e-3, (2e-7, 2e-7, 2e-7), position=middle)
            for name in ("sledge", "carriage", "handle")
        ],
        joints=(
            Prismatic("along", GROUND, "sledge", at=middle, axis=(1, 0, 0)),
            Prismatic("across", "sledge", "carriage", at=middle, axis=(0, 0, 1)),
            Revolute("axle", "carriage", "handle", at=middle, axis=(0, 1, 0)),
            Weld("grip", "handle", "rim", at=middle, active=(0.0, HOLD)),
        ),
        drivers=Driver("fold", "axle", rotation=turned),
        supports=Clamped("bottom", body="tape"),
        probes=(
            Probe("turn", middle, "rotation", component=1, body="rim"),
            Probe("height", middle, component=2, body="rim"),
        ),
        scheme="ed3",
        alpha=1.0,
        dt=dt,
        t_end=t_end,
        output=Output(frames=45),
        units="m, kg, s",
    )


def results(run):
    """Moments at the handle, what the branches dissipate, and how far the strip returns."""
    history = run.history
    t, moment = history["t"].to_numpy(), history["fold.torque"].to_numpy()
    loss, energy = (history[f"tape.relaxation.{what}"].to_numpy() for what in ("loss", "energy"))
    # means, because the rim swings
    first, last = (moment[(t > at) & (t < at + MEAN)].mean() for at in (FOLD, HOLD - MEAN))
    return {
        "energy_balance_error": run.summary["energy_balance_error"],
        "moment_after_folding": float(first),
        "moment_before_release": float(last),
        "dissipated_by_branches": float(loss[-1]),
        "smallest_loss_in_a_step": float(np.diff(loss).min()),
        "balance": float(
            history["total_energy"].iloc[-1]
            + history["dissipation"].iloc[-1]
            - history["work_supports"].iloc[-1]
            - history["work_terms"].iloc[-1]
        ),
        "stored_in_branches": float(energy[np.argmin(np.abs(t - HOLD))]),
        "largest_turn": float(history["turn"].max()),
        "last_turn": float(history["turn"].iloc[-1]),
    }


def check(results):
    """The moment falls while the strip is held, and every joule is stored or dissipated."""
    assert results["energy_balance_error"] < 1e-9
    assert results["smallest_loss_in_a_step"] >= 0
    assert abs(results["balance"]) < 1e-9 * results["dissipated_by_branches"]
    assert results["moment_before_release"] < 0.93 * results["moment_after_folding"]
    assert 0 < results["last_turn"] < 0.4 * results["largest_turn"]
