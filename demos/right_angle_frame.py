"""Right-angle cantilever of Simo and Vu-Quoc, swinging freely after a pulse at its elbow.

Two arms of length 10 lie in the x-y plane, the first along x and clamped, the second along y and
welded to it. A force out of the plane at the elbow grows to 50 in one second and goes away in
another. Bending of the one arm is torsion of the other; the tip is carried 18 units to and fro,
almost twice the length of an arm, while nothing but inertia acts: from 2 s on the energy is
constant. J. C. Simo, L. Vu-Quoc, On the dynamics in space of rods undergoing large motions,
Comput. Methods Appl. Mech. Engng 66 (1988) 125-161, sec. 5.1.4; histories for comparison are in
`demos/references/data/right_angle_frame.csv`.
"""

# KIND: vibrations and motion

from typing import Any

import numpy as np

from shellmb.demos.references import tables
from shellmb.scene import (
    Beam,
    Clamped,
    GeneralSection,
    Line,
    Output,
    PointForce,
    Probe,
    Scene,
    Table,
    Weld,
)

# CI: shellmb run right_angle_frame --check
# CI: mpiexec -n 2 shellmb run right_angle_frame --set t_end=3 --check --no-pictures --out runs/two

LENGTH = 10.0
PULSE = Table((0.0, 1.0, 2.0), (0.0, 1.0, 0.0))
# rotary inertia (20, 10, 10) about d1, d2, d3
ARM = GeneralSection(
    (1e6, 1e6, 1e6, 1e3, 1e3, 1e3), mass_per_length=1.0, second_moments=(10.0, 0.0, 10.0)
)
POINTS = ("elbow", "tip")


def scene(elements: int = 4, dt: float = 0.1, t_end: float = 30.0, force: float = 50.0) -> Scene:
    """The frame.

    Args:
        elements: Elements in each arm.
        dt: Time step, s.
        t_end: End, s.
        force: Largest force, N.
    """
    elbow, tip = (LENGTH, 0.0, 0.0), (LENGTH, LENGTH, 0.0)
    arms = (
        Beam("first", Line((0.0, 0.0, 0.0), elbow), ARM, elements=elements),
        Beam("second", Line(elbow, tip), ARM, elements=elements),
    )
    places = (("elbow", "first"), ("tip", "second"))
    return Scene(
        "right_angle_frame",
        beams=arms,
        joints=(Weld("corner", "first", "second", at="end", second_at="start"),),
        supports=(Clamped("start", body="first"),),
        loads=(PointForce("end", (0.0, 0.0, force), body="first", time=PULSE),),
        probes=tuple(
            Probe(f"{name}_u{axis}", "end", component=k, body=body)
            for name, body in places
            for k, axis in enumerate("xyz")
        ),
        scheme="ep",
        dt=dt,
        t_end=t_end,
        output=Output(frames=61),
        units="m, kg, s",
    )


def results(run: Any) -> dict[str, float]:
    """Energy, and how far extremes and history are from the published ones.

    Differences are relative to the largest excursion of the point; beyond the end of a short run
    nothing is compared.
    """
    history, reference = run.history, tables.read("right_angle_frame")
    t = history["t"].to_numpy()
    then = reference[reference["t_s"] <= t[-1] * (1 + 1e-9)]
    measured = {"energy_balance_error": run.summary["energy_balance_error"]}
    for point in POINTS:
        column = f"{point}_uz"
        found, wanted = history[column].to_numpy(), then[column].to_numpy()
        excursion = float(np.max(np.abs(wanted)))
        for name, extreme in (("min", np.min), ("max", np.max)):
            measured[f"{column}_{name}"] = float(extreme(found))
            if len(then) == len(reference):
                # of a short run the largest value may be the last one, which is no extreme
                off = float(extreme(found) - extreme(wanted))
                measured[f"{column}_{name}_error"] = abs(off) / excursion
        away = np.abs(np.interp(then["t_s"], t, found) - wanted)
        measured[f"{column}_difference"] = float(np.max(away)) / excursion
    return measured


def check(results: dict[str, float]) -> None:
    """The energy to round-off, the extremes to 1 %, the history as far as the step resolves it."""
    assert results["energy_balance_error"] < 1e-9
    for point in POINTS:
        assert results.get(f"{point}_uz_min_error", 0.0) < 0.01
        assert results.get(f"{point}_uz_max_error", 0.0) < 0.01
        # late in the motion a difference of phase of half a step counts
        assert results[f"{point}_uz_difference"] < 0.05
