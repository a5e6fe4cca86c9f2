"""Errors of a run's results and histories, estimated from companions that cost less than the run.

Step: the run against companions with two and four times the step. Mesh: two companions against
each other, with elements of degree 2 and 3 (or with twice the elements) and up to eight times the
step, in which the error of the step is the same. The error of a quantity is the sum of both.
Statics have no error of the step; rigid bodies alone have none of the mesh.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite, sqrt
from typing import TYPE_CHECKING, Any

from mpi4py import MPI

import numpy as np

from shellmb.accuracy.companions import (
    degree_of,
    doublings_of_meshes,
    with_other_degree,
    with_steps,
    with_twice_the_elements,
)
from shellmb.accuracy.estimates import NONE, Estimate, mesh_error, step_error
from shellmb.errors import SceneError, ShellmbError
from shellmb.measuring.stepping import free
from shellmb.observers.summary import write_json
from shellmb.running.directory import written
from shellmb.running.execute import RunResult, execute
from shellmb.running.results import Results, plain_results
from shellmb.running.standard import SUMMARY
from shellmb.scene import Scene
from shellmb.studies.quantity import Quantity

if TYPE_CHECKING:
    import pandas as pd

# norms in which the history of a probe is judged
NORMS = ("l2", "end", "max", "min")
type Tell = Callable[[str], None]


@dataclass(frozen=True)
class Found:
    """A number with its error.

    Args:
        value: The number: a result, or the size (norm) of a history.
        mesh: Error of the mesh, in its unit.
        step: Error of the time step.
    """

    value: float
    mesh: Estimate
    step: Estimate

    @property
    def error(self) -> float:
        """The sum of both."""
        return self.mesh.error + self.step.error

    def to_dict(self) -> dict[str, float | None]:
        """Plain values: what is not known is None."""
        return {
            "value": self.value,
            "error": _finite(self.error),
            "error_mesh": _finite(self.mesh.error),
            "error_step": _finite(self.step.error),
            "order_mesh": self.mesh.order,
            "order_step": self.step.order,
        }


@dataclass(frozen=True)
class Errors:
    """Errors of a run.

    Args:
        results: By the names of the results.
        probes: By the names of columns and norms, "tip:l2".
        remarks: What is not in the errors, each a sentence.
    """

    results: dict[str, Found]
    probes: dict[str, Found]
    remarks: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Plain values for `summary.json`."""
        return {
            "results": {k: f.to_dict() for k, f in self.results.items()},
            "probes": {k: f.to_dict() for k, f in self.probes.items()},
            "remarks": list(self.remarks),
        }


@dataclass(frozen=True)
class _Kept:
    """What is kept of a run: its numbers, its columns, how often events came."""

    results: Mapping[str, float]
    history: pd.DataFrame
    events: Mapping[str, int]


def estimate_errors(
    run: RunResult,
    results: Results | None = None,
    tell: Tell = lambda text: None,
    comm: MPI.Comm = MPI.COMM_WORLD,
) -> Errors:
    """Run the companions of a run, and estimate its errors; collective.

    Args:
        run: The run, at its end.
        results: What gave its results; None: the scene's own function.
        tell: Is told which companion runs.
        comm: Communicator.

    Raises:
        SceneError: If the scene follows a path, whose points are not those of its companions.
    """
    scene = run.scene
    if scene.path is not None:
        raise SceneError(
            f"errors: the scene '{scene.name}' follows a path of equilibria; errors are estimated "
            "of motions and of statics without `path`"
        )
    family = _Family(scene, results, tell, comm)
    mine = _keep(run)
    degree = degree_of(scene)
    mesh: tuple[_Kept, _Kept] | None = None
    steps: list[_Kept] = [mine]
    if not scene.static:
        for n in (1, 2):
            if (kept := family.run(f"{2**n} times the step", n)) is None:
                break
            steps.append(kept)
    better = degree != 3
    if degree is not None:
        n = 0 if scene.static else doublings_of_meshes(scene)
        same = steps[n] if n < len(steps) else family.run(f"{2**n} times the step", n)
        other = None
        if same is not None:
            other = family.run(f"degree {5 - degree}", n, with_other_degree, last=False)
        if same is not None and other is None:
            other, better = family.run("twice the elements", n, with_twice_the_elements), True
        mesh = None if same is None or other is None else (same, other)
    pairs = list(pairwise(steps))
    order = float(run.simulation.scheme.order)

    def find(quantity: Quantity) -> Found:
        value = _value(_take(mine, quantity), quantity)
        of_mesh, of_step = NONE, NONE
        if degree is not None:
            away = None if mesh is None else _difference(*mesh, quantity)
            of_mesh = mesh_error(away, better)
        if not scene.static:
            away_steps = [_difference(fine, coarse, quantity) for fine, coarse in pairs]
            of_step = step_error([a for a in away_steps if a is not None], order)
        return Found(value, of_mesh, of_step)

    others = [*steps[1:2], *(mesh or ())[1:]]
    return Errors(
        {name: find(Quantity(name)) for name in mine.results},
        {str(q): find(q) for name in _columns(mine, scene) for q in _norms(name)},
        (*family.remarks, *_remarks(mine, others)),
    )


class _Family:
    """Runs companions; what goes wrong with one is a remark."""

    def __init__(self, scene: Scene, results: Results | None, tell: Tell, comm: MPI.Comm) -> None:
        self._scene, self._tell, self._comm = scene, tell, comm
        self._results = results or scene.results or _nothing
        self.remarks: list[str] = []

    def run(
        self,
        name: str,
        doublings: int,
        changed: Callable[[Scene], Scene] = lambda scene: scene,
        last: bool = True,
    ) -> _Kept | None:
        """A companion; None where it cannot be, or fails.

        Args:
            name: What is different in it.
            doublings: How often the step is doubled.
            changed: Changes its elements.
            last: Whether there is no other one in its place, so that a failure is a remark.
        """
        try:
            scene = changed(self._scene)
            scene = scene if scene.static else with_steps(scene, doublings)
            self._tell(name)
            done = execute(scene, None, [], comm=self._comm, pictures=False, results=self._results)
        except ShellmbError as error:
            if last:
                self.remarks.append(f"no error can be told from {name}: {error}")
            return None
        kept = _keep(done)
        del done
        free(self._comm)
        return kept


def _nothing(run: RunResult) -> dict[str, float]:
    return {}


def _remarks(mine: _Kept, others: Sequence[_Kept]) -> list[str]:
    """What makes the estimates doubtful."""
    return [
        f"event '{name}' comes {count} times in the run and {other.events.get(name, 0)} times in a "
        "companion: errors after it are not known"
        for other in others
        for name, count in mine.events.items()
        if other.events.get(name) != count
    ]


def _difference(fine: _Kept, coarse: _Kept, quantity: Quantity) -> float | None:
    """How far a coarse run is from a fine one, in the unit of the quantity; None: not known."""
    try:
        reference, found = _take(fine, quantity), _take(coarse, quantity)
    except SceneError:
        return None
    size = abs(_value(reference, quantity)) or 1.0
    away = quantity.difference(found, reference) * size
    return away if isfinite(away) else None


def _take(kept: _Kept, quantity: Quantity) -> dict[str, Any]:
    return quantity.take(kept.results, kept.history)


def _value(taken: Mapping[str, Any], quantity: Quantity) -> float:
    """The number that a quantity is, or the root mean square of a curve."""
    return _rms(taken) if quantity.is_curve else float(taken["value"])


def _rms(taken: Mapping[str, Any]) -> float:
    t, y = np.array(taken["t"]), np.array(taken["y"])
    if len(t) < 2 or t[-1] <= t[0]:
        return float(np.abs(y).max(initial=0.0))
    return sqrt(float(np.trapezoid(y**2, t)) / float(t[-1] - t[0]))


def _keep(run: RunResult) -> _Kept:
    events = {k: len(e["times"]) for k, e in run.summary.get("events", {}).items()}
    return _Kept(plain_results(run.summary), run.history, events)


def _columns(kept: _Kept, scene: Scene) -> list[str]:
    """Columns of the history that belong to probes."""
    names = [probe.name for probe in scene.probes]
    return [
        str(c)
        for c in kept.history.columns
        if any(c == n or str(c).startswith(f"{n}.") for n in names)
    ]


def _norms(name: str) -> list[Quantity]:
    return [Quantity(name, norm) for norm in NORMS]


def _finite(value: float) -> float | None:
    return value if isfinite(value) else None


def add_errors(
    run: RunResult,
    results: Results | None = None,
    tell: Tell = lambda text: None,
    comm: MPI.Comm = MPI.COMM_WORLD,
) -> Errors:
    """Estimate the errors of a run and put them into its summary, also the one on disk; collective.

    In the summary, `results` then has a table for each number, and `errors` those of the probes.

    Args:
        run: The run, at its end.
        results: What gave its results; None: the scene's own function.
        tell: Is told which companion runs.
        comm: Communicator.

    Raises:
        SceneError: If errors of such a scene are not estimated.
    """
    found = estimate_errors(run, results, tell, comm)
    plain = found.to_dict()
    run.summary["results"] = plain.pop("results")
    run.summary["errors"] = plain
    if run.out is not None and comm.rank == 0:
        with written(run.out, comm):
            write_json(run.out / SUMMARY, run.summary)
    comm.Barrier()
    return found
