"""Flying L-plate: three squares in one plane, thrown by a pulse at the end of each arm.

The plate bends and twists at its re-entrant corner while it tumbles freely. Energy and momenta are
constant after the pulse; the linear momentum is the impulse. Energy-momentum methods for shells
are shown by such a plate, in 2025 by the nine-node co-rotational element of Appl. Sci. 15 (2025)
7153. We could read no data of it: all of them are ours (docs/evidence/in_time.md).
"""

# KIND: vibrations and motion
# CI: shellmb run flying_l_plate --check
# CI: shellmb run flying_l_plate --set fold=90 --set t_end=0.1 --check --no-pictures --out runs/ci-l

import math
from typing import Any

import numpy as np

from shellmb.demos.references import flight
from shellmb.scene import (
    EdgeForce,
    Isotropic,
    Join,
    Output,
    Probe,
    Rectangle,
    Scene,
    Shell,
    Table,
)

SIDE, THICKNESS = 0.3, 1e-3  # [m]
E, NU, DENSITY = 70e9, 0.3, 2700.0
PULSE = 0.02  # [s]
# largest forces on the ends of the arms [N]
RIGHT, TOP = (2.0, 6.0, 8.0), (-4.0, 0.0, 8.0)
IMPULSE = PULSE / 2 * np.add(RIGHT, TOP)


def scene(cells: int = 3, fold: float = 0.0, dt: float = 1e-3, t_end: float = 0.3) -> Scene:
    """The plate.

    Args:
        cells: Elements along a side of each square.
        fold: Angle that the arm along y is folded up by, degrees.
        dt: Time step, s.
        t_end: End, s.
    """
    aluminium = Isotropic(E, NU, thickness=THICKNESS, density=DENSITY)
    pulse = Table((0.0, PULSE / 2, PULSE), (0.0, 1.0, 0.0))
    up = (0.0, math.cos(math.radians(fold)), math.sin(math.radians(fold)))
    squares = {
        "corner": Rectangle(SIDE, SIDE),
        "right": Rectangle(SIDE, SIDE, origin=(SIDE, 0.0, 0.0)),
        "top": Rectangle(SIDE, SIDE, origin=(0.0, SIDE, 0.0), axis2=up),
    }
    ends = (("right", "right", RIGHT), ("top", "top", TOP))
    return Scene(
        "flying_l_plate",
        tuple(Shell(name, at, aluminium, mesh=(cells, cells)) for name, at in squares.items()),
        joins=(Join("corner", "right", "right", "left"), Join("corner", "top", "top", "bottom")),
        loads=tuple(
            EdgeForce(edge, tuple(f / SIDE for f in force), body=body, time=pulse)
            for body, edge, force in ends
        ),
        probes=tuple(
            Probe(f"{name}_u{axis}", at, component=k, body=body)
            for name, at, body in (
                ("right", "right-bottom", "right"),
                ("top", "left-top", "top"),
                ("corner", "left-bottom", "corner"),
            )
            for k, axis in enumerate("xyz")
        ),
        scheme="ep",
        dt=dt,
        t_end=t_end,
        output=Output(frames=61),
        units="m, kg, s",
    )


def results(run: Any) -> dict[str, float]:
    """Momentum beside the impulse, and the energy of the free flight."""
    measured = flight.flight(run.history, PULSE)
    if not measured:
        return measured
    linear = flight.vectors(run.history, "momentum_")[-1]
    return measured | {
        "impulse_error": flight.distance(linear, IMPULSE),
        "energy_balance_error": run.summary["energy_balance_error"],
    }


def check(results: dict[str, float]) -> None:
    """Momentum, angular momentum and energy to round-off; ED and ED3 never gain energy."""
    assert results["impulse_error"] < 1e-9
    assert results["energy_balance_error"] < 1e-9
    assert results["energy_rise"] < 1e-9
    assert results["strain_share"] > 0.1
    if results["energy_variation"] < 1e-9:
        # to round-off in EP, to its order in EP4
        assert results["angular_drift"] < 1e-5
