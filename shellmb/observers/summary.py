"""The summary of a run: a few numbers under stable names, `summary.json`."""

from __future__ import annotations

import importlib.metadata
import json
import math
import platform
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from shellmb import __version__
from shellmb.files.writing import write_text
from shellmb.observers.account.constraints import Constraints
from shellmb.observers.account.energy import EnergyAccount
from shellmb.observers.account.jumps import jump_error
from shellmb.observers.account.momentum import Momentum
from shellmb.observers.account.rotations import BodyRotations
from shellmb.observers.account.step_error import controlled
from shellmb.observers.history import History
from shellmb.simulate.simulation import Simulation

PACKAGES = {"dolfinx": "dolfinx-solver-real", "ufl": "fenics-ufl", "ffcx": "fenics-ffcx"}


@dataclass(frozen=True)
class Sources:
    """The observers that know what a summary says."""

    energy: EnergyAccount
    momentum: Momentum
    constraints: Constraints
    history: History
    rotations: BodyRotations


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
        "step_control": controlled(simulation),
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
    }


def versions() -> dict[str, str]:
    """Versions of what produced the numbers."""
    from petsc4py import PETSc

    found = {"shellmb": __version__, "python": platform.python_version(), "numpy": np.__version__}
    for name, package in PACKAGES.items():
        found[name] = importlib.metadata.version(package)
    found["petsc"] = ".".join(map(str, PETSc.Sys.getVersion()))
    return found


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write a dictionary as JSON, in one go; numbers that are not finite become null.

    Args:
        path: The file.
        content: Its content.
    """
    write_text(path, json.dumps(_plain(content), indent=2, allow_nan=False) + "\n")


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic | np.ndarray):
        return _plain(value.tolist())
    return None if isinstance(value, float) and not math.isfinite(value) else value
