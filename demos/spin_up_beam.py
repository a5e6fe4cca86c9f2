"""Spin-up of a flexible beam: its root is turned from rest to a constant speed.

The angle of the root follows `psi(t)`, whose rate grows smoothly to `omega` within `T`. The beam
bends back at first, with the largest deflection of its tip near `T/2`, then is drawn straight by
the centrifugal force, and in the end turns as a stiff rod, longer by what that force stretches it.
A beam that is linear in the rotating frame would grow without bounds here. After T. R. Kane,
R. R. Ryan, A. K. Banerjee, J. Guidance 10 (1987) 139-151, and J. C. Simo, L. Vu-Quoc, J. Appl.
Mech. 53 (1986) 855-863; the data are those of `demos/references/data/spin_up_beam.csv`.
"""

# KIND: vibrations and motion

import math
from typing import Any

import numpy as np

from shellmb.demos.references import tables
from shellmb.scene import GROUND, Beam, Driver, GeneralSection, Line, Output, Probe, Revolute, Scene

# CI: shellmb run spin_up_beam --check

LENGTH, OMEGA, SPIN_UP = 8.0, 4.0, 15.0
AXIAL, SHEAR, BENDING, MASS, ROTARY = 5.03e6, 1.94e6, 566.0, 0.201, 22.7e-6
SECTION = GeneralSection(
    (AXIAL, SHEAR, SHEAR, BENDING, BENDING, BENDING),
    mass_per_length=MASS,
    second_moments=(ROTARY, 0.0, ROTARY),
)


def turned(t: float) -> float:
    """Angle of the root, rad: `omega/T [t^2/2 + (T/2 pi)^2 (cos(2 pi t/T) - 1)]` until T."""
    if t >= SPIN_UP:
        return OMEGA * (t - SPIN_UP / 2)
    wave = (SPIN_UP / (2 * math.pi)) ** 2 * (math.cos(2 * math.pi * t / SPIN_UP) - 1)
    return OMEGA / SPIN_UP * (t**2 / 2 + wave)


def scene(elements: int = 4, dt: float = 0.04, t_end: float = 20.0) -> Scene:
    """The beam.

    Args:
        elements: Number of elements.
        dt: Time step, s.
        t_end: End, s.
    """
    beam = Beam(
        "beam",
        Line((0.0, 0.0, 0.0), (LENGTH, 0.0, 0.0)),
        SECTION,
        elements=elements,
    )
    return Scene(
        "spin_up_beam",
        beams=(beam,),
        joints=(Revolute("root", GROUND, "beam", at=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0)),),
        drivers=(Driver("motor", "root", rotation=turned),),
        probes=tuple(Probe(f"tip_u{axis}", "end", component=k) for k, axis in enumerate("xyz")),
        scheme="ep",
        dt=dt,
        t_end=t_end,
        output=Output(frames=61),
        units="m, kg, s",
    )


def in_the_rotating_frame(history: Any) -> tuple[np.ndarray, np.ndarray]:
    """Displacement of the tip along the root's direction and across it, m, over the history."""
    psi = np.array([turned(t) for t in history["t"]])
    x, y = LENGTH + history["tip_ux"].to_numpy(), history["tip_uy"].to_numpy()
    along = x * np.cos(psi) + y * np.sin(psi) - LENGTH
    return along, y * np.cos(psi) - x * np.sin(psi)


def stretch() -> float:
    """Displacement of the tip of the rod that turns steadily, `rho w^2 L^3/(3 EA)` to first order.

    Exact: `EA u'' + m w^2 (x + u) = 0` with the root held and the tip free.
    """
    k = OMEGA * math.sqrt(MASS / AXIAL)
    return math.tan(k * LENGTH) / k - LENGTH


def results(run: Any) -> dict[str, float]:
    """Energy, the deflection and its largest distance from the published history, the stretch."""
    history, reference = run.history, tables.read("spin_up_beam")
    along, across = in_the_rotating_frame(history)
    t = history["t"].to_numpy()
    then = reference[reference["t_s"] <= t[-1] * (1 + 1e-9)]
    size = float(np.max(np.abs(then["transverse"])))
    difference = np.interp(then["t_s"], t, across) - then["transverse"]
    steady = t > SPIN_UP
    return {
        "energy_balance_error": run.summary["energy_balance_error"],
        "deflection_min": float(np.min(across)),
        "deflection_difference": float(np.max(np.abs(difference))) / size if size else None,
        "stretch": float(np.mean(along[steady])) if steady.any() else None,
        "stretch_exact": stretch(),
    }


def check(results: dict[str, float]) -> None:
    """The published history to 1 % of its largest deflection, the exact stretch to 3 %.

    The vibration that is left after the spin-up shortens the rod by two percent of its stretch.
    """
    assert results["energy_balance_error"] < 1e-9
    assert results["deflection_difference"] < 0.01
    assert abs(results["deflection_min"] / -0.5306 - 1) < 0.01
    if not math.isnan(results["stretch"]):
        assert abs(results["stretch"] / results["stretch_exact"] - 1) < 0.03
