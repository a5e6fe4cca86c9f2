"""The summary of a run: a few numbers under stable names, `summary.json`; the jumps of ED."""

import importlib.metadata
import json
import math
import platform
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from shellmb import __version__
from shellmb.files.writing import plain, write_text
from shellmb.observers.account.constraints import Constraints
from shellmb.observers.account.energy import EnergyAccount
from shellmb.observers.account.momentum import Momentum
from shellmb.observers.account.rotations import BodyRotations
from shellmb.observers.fields.reserves import Reserves
from shellmb.observers.history import History, step_control
from shellmb.simulate.simulation import Simulation

# points of the series that is kept
POINTS = 50
JUMP_UNIT = "1: jump of positions over the size of the body, jump of directors (unit vectors)"

PACKAGES = {"dolfinx": "dolfinx-solver-real", "ufl": "fenics-ufl", "ffcx": "fenics-ffcx"}


class Sources(NamedTuple):
    """The observers that know what a summary says."""

    energy: EnergyAccount
    momentum: Momentum
    constraints: Constraints
    history: History
    rotations: BodyRotations
    reserves: Reserves


def summarise(
    simulation: Simulation, sources: Sources, wall_s: float, failed: str | None
) -> dict[str, Any]:
    """The summary of a run; what does not apply to it is None.

    Args:
        simulation: The simulation, at its end.
        sources: Its observers.
        wall_s: Wall time of the whole run, s.
        failed: Why it failed, if it did.
    """
    scene, problem, steps = simulation.scene, simulation.problem, simulation.step
    dynamic = simulation.scheme.dynamic
    jumps = jump_error(sources.history.rows)
    return {
        "scene": scene.name,
        "scheme": scene.scheme_name,
        "alpha": getattr(simulation.scheme, "alpha", None),
        "dt": scene.dt,
        "t_end": scene.t_end,
        "t": simulation.t,
        "steps": steps,
        "rejected_steps": simulation.size.rejected,
        "step_control": step_control(simulation),
        "newton_iterations": simulation.iterations,
        "unknowns": problem.system.size,
        "bodies": len(scene.bodies),
        "joint_count": len(scene.joints),
        "elements": simulation.model.elements,
        "ranks": simulation.model.comm.size,
        "setup_s": simulation.setup_seconds,
        "jit_s": problem.system.jit_seconds,
        "wall_s": wall_s,
        "wall_per_step_s": simulation.step_seconds / steps if steps else None,
        "energy_balance_error": sources.energy.relative_error if dynamic else None,
        "constraint_max": sources.constraints.constraint_max,
        "director_max": sources.constraints.director_max,
        "joints": {j.name: sources.constraints.joints.get(j.name) for j in scene.joints},
        "dissipated_share": sources.energy.dissipated_share if dynamic else None,
        "linear_momentum_drift": sources.momentum.relative_drift("momentum"),
        "angular_momentum_drift": sources.momentum.relative_drift("angular momentum"),
        "jump_max": None if jumps is None else jumps["max"],
        "jump_error": jumps,
        "versions": versions(),
        "failed": failed,
        "warnings": [],
        "results": {},
        **sources.reserves.summary(),
    }


def versions() -> dict[str, str]:
    """Versions of what produced the numbers."""
    from petsc4py import PETSc

    found = {"shellmb": __version__, "python": platform.python_version(), "numpy": np.__version__}
    found |= {name: importlib.metadata.version(package) for name, package in PACKAGES.items()}
    found["petsc"] = ".".join(map(str, PETSc.Sys.getVersion()))
    return found


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write a dictionary as JSON, in one go; numbers that are not finite become null.

    Args:
        path: The file.
        content: Its content.
    """
    write_text(path, json.dumps(plain(content), indent=2, allow_nan=False) + "\n")


def jump_error(rows: Sequence[Mapping[str, float]]) -> dict[str, Any] | None:
    """The jumps at the starts of the steps of an energy-decaying run, a measure of its accuracy.

    ED lets the state jump from i to j at the start of a step (eqs. 28-31). In the exact motion
    there is no jump; what is left of it, `q_j - q_i = -dt (a - alpha b)/6` with the differences
    `a`, `b` of velocities of eq. (31), is of second order in the step where the motion is
    resolved. Measured: of second order in a rigid mechanism, of about first order where a sudden
    load excites all frequencies (`shellmb study`, column "jump"). The step control rejects and
    chooses steps by it (`StepControl.jump_tolerance`, `simulate.stepsize`).

    It is an indicator of the error of one step and no bound on that of the state, which is of
    another order and adds up over the steps. What it is good for: to see *when* a run is least
    accurate, and whether a run with half the step is better there, as it should be.

    Args:
        rows: Rows of the history.

    Returns:
        `max` and `time_of_max` [s], `mean` over time, and a series: `t` [s] are the ends of the
        steps with the largest jumps of as many equal parts of the run, `largest` these jumps; and
        the `unit`. All jumps are those of the part of the unknowns where they are largest, relative
        to its scale. None where the scheme has no jumps.
    """
    steps = [row for row in rows if not math.isnan(row["jump"])]
    if not steps:
        return None
    worst = max(steps, key=lambda row: row["jump"])
    span = sum(row["dt"] for row in steps)
    count = min(POINTS, len(steps))
    bounds = [round(k * len(steps) / count) for k in range(count + 1)]
    series = [max(steps[a:b], key=lambda row: row["jump"]) for a, b in pairwise(bounds)]
    return {
        "unit": JUMP_UNIT,
        "max": worst["jump"],
        "time_of_max": worst["t"],
        "mean": sum(row["jump"] * row["dt"] for row in steps) / span,
        "t": [row["t"] for row in series],
        "largest": [row["jump"] for row in series],
    }
