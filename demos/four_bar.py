"""Four-bar mechanism with a misaligned hinge: it cannot move unless its bars bend and twist.

A crank, a coupler and a rocker form a rectangle of 0.12 m x 0.24 m; the hinge between coupler and
rocker is five degrees off the normal of their plane. Rigid bars would be locked; elastic ones move
out of the plane, and jump a little where the mechanism passes its change points, all bars in one
line. O. A. Bauchau et al., Validation of flexible multibody dynamics beam formulations using
benchmark problems, Multibody Syst. Dyn. 37 (2016) 29-48, sec. 3.2; a history for comparison is in
`demos/references/data/four_bar.csv`.
"""

# KIND: mechanisms
# CI: shellmb run four_bar --t-end 4 --check --no-pictures

from typing import Any

import numpy as np

from shellmb.demos.references import tables
from shellmb.scene import (
    GROUND,
    Beam,
    Driver,
    GeneralSection,
    InitialVelocity,
    Line,
    Output,
    Probe,
    Revolute,
    Scene,
)

A, B, C, D = (0.0, 0.0, 0.0), (0.0, 0.12, 0.0), (0.24, 0.12, 0.0), (0.24, 0.0, 0.0)
Z = (0.0, 0.0, 1.0)
RATE = -0.6  # of the crank AB [rad/s]
MISALIGNED = 5.0  # [degrees]
# squares of 16 and of 8 mm: axial, twice shear [N]; twist, twice bending [N m^2]; [kg/m], [kg m]
THICK = GeneralSection(
    (5.2992e7, 1.68803e7, 1.68803e7, 733.488, 1130.5, 1130.5),
    mass_per_length=1.9968,
    second_moments=(42.5984e-6, 0.0, 42.5984e-6),
    size=0.016,
)
THIN = GeneralSection(
    (1.3248e7, 4.22008e6, 4.22008e6, 45.843, 70.656, 70.656),
    mass_per_length=0.4992,
    second_moments=(2.6624e-6, 0.0, 2.6624e-6),
    size=0.008,
)
# the crank is in line with the coupler then, and small differences decide [s]
CHANGE_POINT = 7.8


def scene(
    elements: int = 4, scheme: str = "ed", alpha: float = 1.0, dt: float = 1e-2, t_end: float = 12.0
) -> Scene:
    """The mechanism in the x-y plane, at its full rate from the first moment on.

    Args:
        elements: Elements of each bar.
        scheme: Time scheme.
        alpha: Its dissipation.
        dt: Time step [s].
        t_end: End of the run [s]; a turn takes 10.5 s.
    """
    tilt = np.radians(MISALIGNED)
    bars = (("crank", A, B, THICK), ("coupler", B, C, THICK), ("rocker", D, C, THIN))
    return Scene(
        "four_bar",
        beams=[
            Beam(name, Line(start, end), section, elements=elements, up=Z)
            for name, start, end, section in bars
        ],
        joints=[
            Revolute("A", GROUND, "crank", at=A, axis=Z),
            Revolute("B", "crank", "coupler", at=B, axis=Z),
            Revolute("C", "coupler", "rocker", at=C, axis=(0.0, -np.sin(tilt), np.cos(tilt))),
            Revolute("D", GROUND, "rocker", at=D, axis=Z),
        ],
        drivers=Driver("drive", "A", rotation=lambda t: RATE * t),
        initial=[
            InitialVelocity(spin=(0, 0, RATE), about=A, body="crank"),
            InitialVelocity(linear=(-RATE * B[1], 0, 0), body="coupler"),
            InitialVelocity(spin=(0, 0, RATE), about=D, body="rocker"),
        ],
        probes=[Probe(f"C_{axis}", C, component=k, body="coupler") for k, axis in enumerate("xyz")],
        scheme=scheme,
        alpha=alpha,
        dt=dt,
        t_end=t_end,
        output=Output(frames=121),
        units="m, kg, s",
    )


def results(run: Any) -> dict[str, float]:
    """Measure how far C leaves the plane, and is from another code's before the change point."""
    history = run.history
    t = history["t"].to_numpy()
    stored = tables.read("four_bar")
    stored = stored[stored["t_s"] <= min(CHANGE_POINT, t[-1])]
    found = {
        "lowest": float(history["C_z"].min()),
        "time_of_lowest": float(t[history["C_z"].argmin()]),
    }
    for axis in "xyz":
        ours = np.interp(stored["t_s"], t, history[f"C_{axis}"])
        theirs = stored[f"u{axis}"].to_numpy()
        found[f"{axis}_apart"] = float(np.abs(ours - theirs).max() / np.abs(theirs).max())
    for name in ("energy_balance_error", "constraint_max"):
        found[name] = run.summary[name]
    return found


def check(results: dict[str, float]) -> None:
    """Within a percent of the other code, which takes steps of 4 ms."""
    assert abs(results["lowest"] / -4.128e-3 - 1) < 0.01
    assert abs(results["time_of_lowest"] - 2.672) < 0.05
    assert results["x_apart"] < 2e-3
    assert results["y_apart"] < 5e-3
    assert results["z_apart"] < 0.01
    assert results["energy_balance_error"] < 1e-9
    assert results["constraint_max"] < 1e-10
