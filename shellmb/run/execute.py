"""Run a scene with all observers: what the command line, demos, verification and tests share."""

from __future__ import annotations

import importlib
import time as clock
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mpi4py import MPI

import numpy as np
import numpy.typing as npt

from shellmb.errors import ConvergenceError, SceneError
from shellmb.observers.checkpoint import Saved
from shellmb.observers.energy import EnergyAccount
from shellmb.observers.path import path_points
from shellmb.observers.summary import summarise, write_json
from shellmb.run.directory import make_directory, refuse_used
from shellmb.run.request import REQUEST, Request
from shellmb.run.standard import STATE, SUMMARY, StandardObservers
from shellmb.scene import Scene
from shellmb.simulate.simulation import PAST, Observer, Simulation
from shellmb.watches.base import Caution
from shellmb.watches.registry import cautions

if TYPE_CHECKING:
    import pandas as pd

type Results = Callable[[RunResult], dict[str, float]]


@dataclass(frozen=True)
class RunResult:
    """What a run leaves behind, the same on all ranks.

    Args:
        scene: The scene.
        simulation: The simulation at its end.
        rows: The history, one row per step and one before the first.
        summary: The summary.
        energy: The energy account.
        out: The run directory, if there is one.
        warnings: What the run says against itself; those of the summary, too.
    """

    scene: Scene
    simulation: Simulation
    rows: list[dict[str, float]]
    summary: dict[str, Any]
    energy: EnergyAccount
    out: Path | None
    warnings: tuple[Caution, ...] = ()

    @cached_property
    def history(self) -> pd.DataFrame:
        """The history, one row per step and one before the first."""
        # half a second that most runs do without (see `column`); on a stack of its own, as a cycle
        # that an import leaves must not hold the simulation (`observers.pictures.draw` says why)
        with ThreadPoolExecutor(max_workers=1) as thread:
            pandas = thread.submit(importlib.import_module, "pandas").result()
        return pandas.DataFrame(self.rows)

    def column(self, name: str) -> npt.NDArray[np.float64]:
        """A column of the history, shape (rows,).

        Args:
            name: Its name.
        """
        return np.array([row[name] for row in self.rows], dtype=float)

    @property
    def results(self) -> dict[str, float]:
        """What the scene measured."""
        return self.summary["results"]


def execute(
    scene: Scene,
    out: Path | str | None = None,
    observers: Sequence[Observer] = (),
    *,
    comm: MPI.Comm = MPI.COMM_WORLD,
    pictures: bool = True,
    request: Request | None = None,
    results: Results | None = None,
    saved: Saved | None = None,
    again: bool = False,
) -> RunResult:
    """Run a scene.

    Args:
        scene: The scene.
        out: Directory to write; None: nothing is written.
        observers: More observers; the numbers of those that measure enter the history.
        comm: Communicator.
        pictures: Whether pictures are drawn, where anything is written.
        request: How the scene was asked for, so that `shellmb resume` can build it again.
        results: Gives the `results` of the summary; None: those of the scene.
        saved: A state to go on from, see `resume`.
        again: Whether `out` holds what a run left that was killed before its first state.

    Raises:
        SceneError: If the scene does not fit its meshes, or `out` holds a run already.
        ConvergenceError: If a step fails at the smallest step size; what was computed is written.
    """
    begin = clock.perf_counter()
    directory = None if out is None else Path(out)
    if directory is not None and saved is None and not again:
        refuse_used(directory, comm)
    simulation = Simulation(scene, comm)
    if directory is not None:
        _prepare(directory, request, comm)
    standard = StandardObservers(directory, observers)
    if saved is not None:
        _restore(simulation, standard.named, saved)

    history, frames = standard.sources.history, standard.frames
    failed: str | None = None
    try:
        simulation.run(list(standard.named.values()))
    except BaseException as failure:
        failed = str(failure) or type(failure).__name__
        if isinstance(failure, ConvergenceError) and directory is not None:
            message = f"{failure}; the last good state is in {directory / STATE}"
            raise ConvergenceError(message, failure.field, failure.norms) from failure
        raise
    finally:
        wall = clock.perf_counter() - begin
        started = bool(history.rows)
        found = tuple(cautions(standard.watches, simulation) if started else ())
        summary = summarise(simulation, standard.sources, wall, failed)
        summary |= path_points(simulation) | {"warnings": [c.to_dict() for c in found]}
        account = standard.sources.energy
        result = RunResult(scene, simulation, history.rows, summary, account, directory, found)
        if started and directory is not None and comm.rank == 0:
            write_json(directory / SUMMARY, result.summary)
            if pictures and frames is not None:
                from shellmb.observers.pictures import draw

                draw(directory, result.history, frames, simulation)
                if simulation.path is not None:
                    from shellmb.observers.path_pictures import draw_path

                    points = simulation.path.points
                    draw_path(directory / "path.png", result.history, scene.probes, points)
    measure = results or scene.results
    if measure is not None:
        result.summary["results"] = {k: float(v) for k, v in measure(result).items()}
        if directory is not None and comm.rank == 0:
            write_json(directory / SUMMARY, result.summary)
    return result


def _prepare(directory: Path, request: Request | None, comm: MPI.Comm) -> None:
    make_directory(directory, comm)
    if request is not None and comm.rank == 0:
        write_json(directory / REQUEST, request.to_dict())


def _restore(simulation: Simulation, named: dict[str, Observer], saved: Saved) -> None:
    now, then = (
        {k: v.shape for k, v in arrays.items() if not k.startswith(PAST)}
        for arrays in (simulation.arrays(), saved.arrays)
    )
    if now != then:
        raise SceneError(
            f"resume: the state does not fit the scene '{simulation.scene.name}', which has other "
            "bodies, meshes or schemes now; undo the changes, or start the run anew"
        )
    simulation.restore(saved.arrays, saved.simulation)
    for name, observer in named.items():
        if name in saved.observers:
            observer.restore(saved.observers[name])
