"""What else is frozen than histories: modes, buckling loads, paths, gradients, resumed runs.

Each is a table of columns, as a history is.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from mpi4py import MPI

import numpy as np

import shellmb as sm
from shellmb.arrays import Floats
from shellmb.errors import Stopped
from shellmb.running.execute import RunResult, execute
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.running.resume import resume
from shellmb.running.rotating.campbell import campbell
from shellmb.simulate.buckling import linear_buckling
from shellmb.simulate.simulation import BaseObserver, Simulation
from tests.golden import features, scenes
from tests.sensitivity import path_scenes, test_adjoint
from tests.sensitivity import scenes as differentiable
from tests.sensitivity.test_adjoint import square

Table = dict[str, Floats]
# columns that are round-off or counts
LEFT_OUT = ("error", "iterations", "rejected", "wall", "balance", "step")


def columns(run: RunResult) -> Table:
    """Columns of the history of a run, each shape (rows,)."""
    names = [c for c in run.rows[-1] if not any(part in c for part in LEFT_OUT)]
    return {c: np.array([row.get(c, math.nan) for row in run.rows], dtype=float) for c in names}


def modes() -> Table:
    """Squares of frequencies: at rest and about an equilibrium, of a mechanism and a shell."""
    found = {
        "shell": natural_modes(scenes.shell("static"), count=4).omega2,
        "loaded shell": natural_modes(scenes.shell("static"), count=4, loaded=True).omega2,
        "natural strain": natural_modes(features.natural("static"), count=4, loaded=True).omega2,
        "hinge": natural_modes(features.hinge("static"), count=4, loaded=True).omega2,
    }
    return {f"{name} omega2": np.asarray(values) for name, values in found.items()}


def turning() -> Table:
    """Complex eigenvalues of a beam that turns about an axis beside it."""
    made = scenes.beam("ep")
    found = campbell(replace(made, loads=(), probes=()), [0.05, 0.1], count=3, axis=(0, 0, 1))
    values = [modes.values for modes in found.modes]
    return {
        f"value.{part} {k}": np.array([getattr(v[k], part) for v in values])
        for part in ("real", "imag")
        for k in range(3)
    }


def buckling() -> Table:
    """Load factors at which the cantilever plate buckles that is pressed along its length."""
    push = sm.EdgeForce("right", (-1e-3, 0, 0))
    made = replace(scenes.shell("static"), loads=push, probes=())
    return {"factor": np.asarray(linear_buckling(made, MPI.COMM_WORLD, 2).factors)}


def path(make: Callable[..., sm.Scene], **given: Any) -> Callable[[], Table]:
    """History of a static path."""
    return lambda: columns(execute(replace(make(**given), solver=scenes.EXACT)))


def gradient(make: Callable[..., sm.Scene], *by: str, **given: Any) -> Callable[[], Table]:
    """Derivatives of all columns of a run by parameters of its scene."""

    def found() -> Table:
        history = sm.sensitivities(
            make, by, values=given, fields=False, newton_tolerance=1e-12
        ).history
        return {
            f"{p}: {c}": history[p, c].to_numpy(dtype=float)
            for p, c in history.columns
            if not any(part in c for part in LEFT_OUT)
        }

    return found


def adjoint(make: Callable[..., sm.Scene], *by: str, **given: Any) -> Callable[[], Table]:
    """Derivatives of one number by thicknesses of elements and by parameters, swept backwards."""

    def found() -> Table:
        fields = [(body.name, "thickness") for body in make().shells]
        swept = sm.adjoint(make, square, fields, by, values=given, newton_tolerance=1e-12)
        tables = {"value": np.array([swept.value])}
        tables |= {name: np.array([value]) for name, value in swept.parameters.items()}
        for (body, _), table in swept.fields.items():
            tables[f"thickness of {body}"] = table["derivative"].to_numpy(dtype=float)
        return tables

    return found


def mechanism(scheme: str = "ed3", arm: float = 1.0, stiffness: float = 40.0) -> sm.Scene:
    """A mechanism whose probe is linear in the state."""
    return differentiable.mechanism(scheme, arm=arm, stiffness=stiffness)


def frequencies() -> Table:
    """Frequencies of a plate and their derivatives."""
    table = sm.frequency_sensitivities(
        differentiable.plate, ("thickness", "length"), 2, values={"scheme": "static"}
    )
    return {c: table[c].to_numpy(dtype=float) for c in table.columns}


class StopAt(BaseObserver):
    """Ends a run behind a step, as a signal does."""

    def __init__(self, step: int) -> None:
        self._step = step

    def accepted(self, simulation: Simulation) -> None:
        """After a step."""
        if simulation.step == self._step:
            raise Stopped(15)


def resumed(name: str) -> Callable[[], Table]:
    """History of a frozen run that stops after half of its steps and goes on."""

    def found() -> Table:
        scene = (scenes.SCENES | features.SCENES)[name]()
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "run"
            try:
                execute(scene, out, [StopAt(round(scene.t_end / scene.dt / 2))], pictures=False)
            except Stopped:
                history = resume(out, scene=scene, pictures=False).history
            kept = [c for c in history.columns if not any(part in c for part in LEFT_OUT)]
            return {c: history[c].to_numpy(dtype=float) for c in kept}

    return found


PRODUCTS: dict[str, Callable[[], Table]] = {
    "modes": modes,
    "turning": turning,
    "buckling": buckling,
    "path of a truss": path(path_scenes.truss, rise=0.5, across=0.1, sideways=True),
    "path of a roof": path(path_scenes.roof, t_end=3.0),
    "path of a frame": path(path_scenes.frame),
    "gradient plate ep": gradient(differentiable.plate, "thickness", "length", scheme="ep"),
    "gradient plate ed3": gradient(differentiable.plate, "thickness", "speed", scheme="ed3"),
    "gradient mechanism ed": gradient(differentiable.mechanism, "arm", "stiffness", scheme="ed"),
    "gradient vault ep4": gradient(differentiable.vault, "radius", scheme="ep4"),
    "gradient vault static": gradient(differentiable.vault, "radius", scheme="static"),
    "gradient modal ep": gradient(differentiable.modal_plate, "thickness", scheme="ep"),
    "gradient balloon ed": gradient(differentiable.balloon, "pressure", scheme="ed"),
    "gradient of a path": gradient(path_scenes.roof, "thickness", "E", t_end=3.0),
    "adjoint plate ep4": adjoint(test_adjoint.plate, "thickness", scheme="ep4"),
    "adjoint plate ed": adjoint(test_adjoint.plate, "thickness", scheme="ed"),
    "adjoint mechanism ed3": adjoint(mechanism, "arm", "stiffness", scheme="ed3"),
    "frequencies": frequencies,
}
# runs that go on have the histories of those that did not stop
RESUMED = ("joint ed", "shell ep4", "contact ep", "natural ed3", "modal ep")
PRODUCTS |= {f"resumed {name}": resumed(name) for name in RESUMED}
