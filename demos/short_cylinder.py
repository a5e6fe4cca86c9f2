"""Short cylinder of Simo and Tarnow: a thin tube thrown by four forces, bending as it tumbles.

Four dead forces rise for half a second and vanish at one second; then nothing acts on the tube,
which bends to an oval and turns over. Energy and both momenta are constant from then on, and the
linear momentum is the impulse of the forces. J. C. Simo, N. Tarnow, Int. J. Numer. Meth. Engng 37
(1994) 2527-2549; later in D. Kuhl, E. Ramm, Comput. Methods Appl. Mech. Engng 178 (1999) 343-366,
and others. We could not read these papers: radius, height, thickness, material and pulse are as
we know them from there, the places of the forces are ours (docs/evidence/in_time.md).
"""

# KIND: vibrations and motion
# CI: shellmb run short_cylinder --check
# CI: shellmb run short_cylinder --scheme ed3 --set t_end=2 --check --no-pictures --out runs/ci-tube

from typing import Any

import numpy as np

from shellmb.demos.references import flight, tables
from shellmb.scene import Cylinder, Isotropic, Output, PointForce, Probe, Scene, Shell, Table

RADIUS, HEIGHT, THICKNESS = 7.5, 3.0, 0.02
E, NU, DENSITY = 2e8, 0.25, 1.0
# time of the pulse, s, and its largest value, N
PULSE, PEAK = 1.0, 5.0
# places of the forces, and their directions, whose sum is (2, 0, 0)
PLACES = {
    "A": (0.0, -RADIUS, 0.0),
    "B": (0.0, RADIUS, 0.0),
    "C": (0.0, RADIUS, HEIGHT),
    "D": (0.0, -RADIUS, HEIGHT),
}
FORCES = {"A": (0, -1, -1), "B": (1, 1, 1), "C": (1, 1, 1), "D": (0, -1, -1)}
# energy after the pulse, J: EP4, dt=0.00625 s, 16x2
CONVERGED = 52.68993
IMPULSE = PEAK * PULSE / 2 * np.sum(list(FORCES.values()), axis=0)


def scene(mesh: tuple[int, int] = (16, 2), dt: float = 0.02, t_end: float = 5.0) -> Scene:
    """The tube.

    Args:
        mesh: Elements around (a multiple of 4) and along the axis.
        dt: Time step, s.
        t_end: End, s.
    """
    pulse = Table((0.0, PULSE / 2, PULSE), (0.0, PEAK, 0.0))
    section = Isotropic(E, NU, thickness=THICKNESS, density=DENSITY)
    return Scene(
        "short_cylinder",
        Shell("tube", Cylinder(RADIUS, HEIGHT), section, mesh=mesh),
        loads=tuple(PointForce(at, FORCES[name], time=pulse) for name, at in PLACES.items()),
        probes=tuple(
            Probe(f"{name}_u{axis}", at, component=k)
            for name, at in PLACES.items()
            for k, axis in enumerate("xyz")
        ),
        scheme="ep",
        dt=dt,
        t_end=t_end,
        output=Output(frames=61),
        units="m, kg, s",
    )


def from_opensees(history: Any) -> float:
    """Largest distance of the loaded points from those of OpenSees, over the largest displacement.

    Args:
        history: Columns of the run; until its end, or that of the table.
    """
    table = tables.read("short_cylinder")
    table = table[table["t_s"] <= np.max(history["t"]) * (1 + 1e-9)]
    names = [f"{name}_u{axis}" for name in PLACES for axis in "xyz"]
    ours = [np.interp(table["t_s"], history["t"], history[name]) for name in names]
    theirs = table[names].to_numpy().T
    return float(np.max(np.abs(np.array(ours) - theirs)) / np.max(np.abs(theirs)))


def results(run: Any) -> dict[str, float]:
    """Momenta beside what the forces have given, and the energy of the free flight."""
    history = run.history
    measured = flight.flight(history, PULSE)
    if not measured:
        return measured
    given = flight.turned(history, PLACES, FORCES, PEAK, PULSE)[-1]
    linear = flight.vectors(history, "momentum_")[-1]
    angular = flight.vectors(history, "angular_momentum_")[-1]
    return measured | {
        "impulse_error": flight.distance(linear, IMPULSE),
        "moment_error": flight.distance(angular, given),
        "distance_from_opensees": from_opensees(history),
        "energy_balance_error": run.summary["energy_balance_error"],
    }


def check(results: dict[str, float]) -> None:
    """Momentum, angular momentum and energy to round-off; the energy of a converged run to 0.5 %.

    ED and ED3 lose energy and angular momentum, never gain energy, and keep the linear momentum.
    """
    assert results["impulse_error"] < 1e-9
    assert results["energy_balance_error"] < 1e-9
    assert results["energy_rise"] < 1e-9
    assert results["strain_share"] > 0.1
    # flat elements of four nodes, 32x2
    assert results["distance_from_opensees"] < 0.02
    # of EP4 with a small step on the same mesh
    assert abs(results["energy"] / CONVERGED - 1) < 5e-3
    if results["energy_variation"] < 1e-9:
        # to round-off in EP, to its order in EP4
        assert results["angular_drift"] < 1e-5
        assert results["moment_error"] < 1e-3
