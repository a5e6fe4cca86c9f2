"""A tape spring of a polymer is folded, held and released: it relaxes while it is held.

The curved strip is clamped at one end, the other has a rigid cap. A handle that moves in a plane
grips the cap and turns it; the fold localises. While it is held, the moment at the handle falls as the Maxwell
branches relax (generalised Maxwell material, a Prony series with two terms). Released, the strip
springs back, and the branches, which now lag behind, hold it away from its shape for a while. The
account says what the branches have dissipated.
"""

# KIND: vibrations and motion
# CI: shellmb run tape_spring --check --no-pictures

import math

import numpy as np

from shellmb.scene import (
    GROUND,
    Clamped,
    Cylinder,
    Driver,
    Isotropic,
    Join,
    Output,
    Planar,
    Probe,
    Prony,
    RigidBody,
    Scene,
    Shell,
    Weld,
)

RADIUS, ANGLE, LENGTH, THICKNESS = 0.02, 90.0, 0.25, 4e-4  # [m], [degrees]
CAP = 0.01  # [m]
E, NU, DENSITY = 4e9, 0.35, 1300.0
# shares and times of the branches [s]
SERIES = ((0.25, 0.1), (0.2, 1.0))
FOLD, HOLD = 0.4, 1.6  # ends of folding and of holding [s]


def scene(
    fold: float = 70.0, relaxes: bool = True, dt: float = 4e-3, t_end: float = 2.2
) -> Scene:
    """The tape spring; its axis is x, it opens downwards.

    Args:
        fold: Angle by which its end is turned [degrees].
        relaxes: Whether its section relaxes.
        dt: Time step [s].
        t_end: End [s].
    """
    half = ANGLE / 2
    along = {"axis": (1, 0, 0), "start": (0, 0, 1)}
    tape = Cylinder(RADIUS, LENGTH, (-half, half), **along)
    cap = Cylinder(RADIUS, CAP, (-half, half), origin=(LENGTH, 0, 0), **along)
    section = Isotropic(
        E, NU, thickness=THICKNESS, density=DENSITY, relaxation=Prony(SERIES) if relaxes else None
    )
    middle = (LENGTH, 0.0, RADIUS)

    def turned(t: float) -> float:
        part = min(t / FOLD, 1.0)
        return math.radians(fold) * part**2 * (3 - 2 * part)

    return Scene(
        "tape_spring",
        (
            Shell("tape", tape, section, mesh=(4, 14)),
            Shell("cap", cap, section, mesh=(4, 1), model="rigid"),
        ),
        joins=Join("tape", "cap", "top", "bottom"),
        rigid_bodies=RigidBody("handle", 2e-3, (2e-7, 2e-7, 2e-7), position=middle),
        joints=(
            Planar("guide", GROUND, "handle", at=middle, normal=(0, 1, 0)),
            Weld("grip", "handle", "cap", at=middle, active=(0.0, HOLD)),
        ),
        drivers=Driver("fold", "guide", rotation=turned),
        supports=Clamped("bottom", body="tape"),
        probes=(
            Probe("turn", middle, "rotation", component=1, body="handle"),
            Probe("height", middle, component=2, body="handle"),
        ),
        scheme="ed3",
        alpha=1.0,
        dt=dt,
        t_end=t_end,
        output=Output(frames=45),
        units="m, kg, s",
    )
