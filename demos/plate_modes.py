"""Natural modes of a free square plate: six rigid-body motions, then the Chladni figures.

Run it with `shellmb modes plate_modes`. The frequency parameters `omega a^2 sqrt(rho h/D)` of the
thin plate are
13.468, 19.596, 24.270, 34.801, 34.801 (Ritz, `demos/references/data/plate_thin_freq_ritz.csv`).
"""

# KIND: vibrations and motion
# CI: shellmb modes plate_modes --count 11 --check --out runs/ci-plate_modes

import math
from typing import Any

from shellmb.scene import Isotropic, Rectangle, Scene, Shell

SIDE, THICKNESS, E, NU, RHO = 1.0, 0.005, 70e9, 0.3, 2700.0

# thin plate, nu = 0.3, Legendre-Ritz 14x14: row FFFF of plate_thin_freq_ritz.csv in
# demos/references/data
RITZ = (13.4682, 19.5961, 24.2702, 34.8009, 34.8009)


def scene(side: float = SIDE, thickness: float = THICKNESS) -> Scene:
    """A free plate.

    Args:
        side: Side, m.
        thickness: Thickness, m.
    """
    plate = Shell(
        "plate",
        Rectangle(side, side, origin=(-side / 2, -side / 2, 0.0)),
        Isotropic(E=E, nu=NU, thickness=thickness, density=RHO),
        mesh=(8, 8),
    )
    return Scene("plate_modes", (plate,), scheme="ep", dt=1e-4, t_end=1e-2, units="m, kg, s")


def mode_results(modes: Any) -> dict[str, float]:
    """Frequency parameters of the elastic modes and the number of rigid ones."""
    bending = E * THICKNESS**3 / 12 / (1 - NU**2)
    unit = math.sqrt(bending / (RHO * THICKNESS)) / SIDE**2
    found = {"rigid_modes": float(modes.rigid)}
    for k, omega in enumerate(modes.omega[modes.rigid :]):
        found[f"lambda_{k + 1}"] = float(omega / unit)
    return found


def check(results: dict[str, float]) -> None:
    """Exactly six rigid modes; the first five elastic ones within 1 % of the Ritz values."""
    assert results["rigid_modes"] == 6
    for k, reference in enumerate(RITZ):
        assert abs(results[f"lambda_{k + 1}"] / reference - 1) < 0.01
