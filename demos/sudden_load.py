"""Cantilever plate under a sudden tip load, large vibrations (EP).

A strip of steel, clamped at one short edge, is loaded at the other one by 2 N at once. Its tip
swings out to nearly twice the static deflection and back; the energy balance closes to round-off.
"""

# KIND: start here
# CI: shellmb run sudden_load --check
# CI: shellmb run sudden_load --backend snes --check --no-pictures --out runs/ci-snes
# CI: mpiexec -n 2 shellmb run sudden_load --check --no-pictures --quiet

import math

from shellmb.scene import Clamped, EdgeForce, Isotropic, Output, Probe, Rectangle, Scene, Shell

LENGTH, WIDTH = 1.0, 0.08  # [m]

# largest tip deflection [m]: Exudyn 1.13.6, ANCFThinPlate, generalised-alpha, dt = 1e-3 s, gives
# 0.11466 with 6x2 elements and 0.11508 with 12x4
PEAK = 0.1147


def risen(t: float, rise: float) -> float:
    """Part of the load: from 0 to 1 in the time `rise`, with two derivatives."""
    s = min(t / rise, 1.0)
    return s - math.sin(2 * math.pi * s) / (2 * math.pi)


def scene(
    force: float = 2.0,
    thickness: float = 2e-3,
    dt: float = 1e-3,
    t_end: float = 0.5,
    rise: float = 0.0,
):
    """The strip.

    Args:
        force: Force on the free edge [N].
        thickness: Thickness [m].
        dt: Time step [s].
        t_end: End of the run [s].
        rise: Time in which the load rises, smoothly [s]; 0: it is there at once.
    """
    steel = Isotropic(E=210e9, nu=0.25, thickness=thickness, density=7870.0)
    plate = Shell("plate", Rectangle(LENGTH, WIDTH), steel, mesh=(6, 2))
    return Scene(
        "sudden_load",
        plate,
        supports=Clamped("left"),
        loads=EdgeForce(
            "right", (0, 0, force / WIDTH), time=(lambda t: risen(t, rise)) if rise else None
        ),
        probes=(
            Probe("tip_z", (LENGTH, WIDTH / 2, 0), component=2),
            Probe("tip_x", (LENGTH, WIDTH / 2, 0), component=0),
        ),
        scheme="ep",
        dt=dt,
        t_end=t_end,
        output=Output(frames=51),
        units="m, kg, s",
    )


def results(run):
    """Largest deflection of the tip and what the account says."""
    tip = run.column("tip_z")
    return {
        "peak_tip_deflection": float(tip.max()),
        "time_of_peak": float(run.column("t")[tip.argmax()]),
        "energy_balance_error": run.summary["energy_balance_error"],
    }


def check(results):
    """The reference peak, and the energy law."""
    peak = results["peak_tip_deflection"]
    assert abs(peak / PEAK - 1) < 0.01, f"peak {peak:.5f} m, not {PEAK} m"
    assert results["energy_balance_error"] < 1e-9
