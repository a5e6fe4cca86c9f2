"""Which way an angle of fibres turns, and on which side a ply lies."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from shellmb.scene import (
    Clamped,
    EdgeForce,
    Laminate,
    Orthotropic,
    PlyMaterial,
    Rectangle,
    Scene,
    Shell,
)

STIFF, SOFT, SHEAR, H = 20.0, 1.0, 0.5, 0.1
FIBRES = Orthotropic(
    E1=STIFF, E2=SOFT, nu12=0.0, G12=SHEAR, G13=SHEAR, G23=SHEAR, thickness=H, angle=0.0
)
PLY = PlyMaterial(E1=STIFF, E2=SOFT, nu12=0.0, G12=SHEAR, G13=SHEAR, G23=SHEAR)
# small enough for what is linear in it to be left
PULL = 1e-6
MIDDLE = (1.0, 0.1, 0.0)


def pulled(section: Any) -> Scene:
    """A strip along x, clamped at one end and pulled at the other."""
    return Scene(
        "strip",
        Shell("strip", Rectangle(1.0, 0.2), section, mesh=(4, 1)),
        supports=Clamped("left"),
        loads=EdgeForce("right", (PULL, 0.0, 0.0)),
        scheme="static",
        dt=1.0,
    )


@pytest.mark.parametrize("angle", [30.0, -30.0])
def test_pulled_fibres_turn_towards_the_load(angle: float, run, at) -> None:
    """Off-axis tension shears the strip, `gamma = S16 N`; its end moves aside by that, by S16 < 0.

    The clamp hinders the shear near it: some tenths of the width of 0.2.
    """
    moved = at(run(pulled(replace(FIBRES, angle=angle))), "strip", MIDDLE)
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    # laminated plates: S16 of a turned ply
    mixed = 2 / STIFF + 0.0 - 1 / SHEAR
    s16 = (mixed * s * c**3 - (2 / SOFT - 1 / SHEAR) * s**3 * c) / H
    assert moved[1] == pytest.approx(s16 * PULL, rel=0.3)
    assert moved[2] == pytest.approx(0.0, abs=1e-6 * abs(moved[1]))


@pytest.mark.parametrize("upper", [0.0, 90.0])
def test_a_pulled_strip_curves_towards_its_stiffer_face(upper: float, run, at) -> None:
    """The soft side is stretched more: curvature `M = 0`, so `kappa = -B N/(A D - B^2)`."""
    plies = Laminate.from_stacking(PLY, H / 2, (90.0 - upper, upper))
    moved = at(run(pulled(plies)), "strip", MIDDLE)
    low, high = (STIFF if a == 0 else SOFT for a in (90.0 - upper, upper))
    A, B, D = H / 2 * (low + high), H**2 / 8 * (high - low), H**3 / 24 * (low + high)
    curvature = -B * PULL / (A * D - B**2)
    # positive curvature bends down from the clamp: `kappa = -w''` with this director
    assert moved[2] == pytest.approx(-curvature / 2, rel=0.02)
    assert (moved[2] > 0) == (high > low)
