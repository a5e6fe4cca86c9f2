"""Run a scene with all observers: what the command line, demos, verification and tests share."""

from __future__ import annotations

import importlib
import logging
import time as clock
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats
from shellmb.barrier import arrive
from shellmb.diagnostics.base import RunWarning, collect_warnings, setup_warnings
from shellmb.errors import (
    ControlError,
    ConvergenceError,
    RunError,
    SceneError,
    ShellmbError,
    Stopped,
)
from shellmb.files.locks import is_temporary
from shellmb.native.assembler import assembled_as
from shellmb.observers.account.energy import EnergyAccount
from shellmb.observers.files.checkpoint import OBSERVED, Saved
from shellmb.observers.files.described import describe
from shellmb.observers.history import points_and_events
from shellmb.observers.summary import summarise, write_json
from shellmb.restart import below, with_arrays
from shellmb.running.directory import claimed, written
from shellmb.running.error_origin import in_words, user_frame
from shellmb.running.memory import check_memory
from shellmb.running.request import REQUEST, Request, resume_command
from shellmb.running.results import Results, add_results, plain_results
from shellmb.running.standard import STATE, SUMMARY, StandardObservers
from shellmb.scene import Scene
from shellmb.scene.checks import ignored_settings
from shellmb.scene.values.validate import said, show
from shellmb.simulate.simulation import PAST, Observer, Simulation
from shellmb.stopping import STOPPING, failing_together

if TYPE_CHECKING:
    import pandas as pd

# what a summary says of a run that a signal has ended
INTERRUPTED = "KeyboardInterrupt"

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class RunResult:
    """Result of a run, the same on all ranks.

    Args:
        scene: The scene.
        simulation: The simulation at its end.
        rows: The history, one row per step and one before the first.
        summary: The summary.
        energy: The energy account.
        out: The run directory, if there is one.
        warnings: What the run says against itself; those of the summary, too.
        measure: What gives its results.
    """

    scene: Scene
    simulation: Simulation
    rows: list[dict[str, float]]
    summary: dict[str, Any]
    energy: EnergyAccount
    out: Path | None
    warnings: tuple[RunWarning, ...] = ()
    measure: Results | None = None

    @cached_property
    def history(self) -> pd.DataFrame:
        """The history, one row per step and one before the first."""
        # half a second that most runs do without (see `column`); on a stack of its own, as a cycle
        # that an import leaves must not hold the simulation (`show.pictures` says why)
        with ThreadPoolExecutor(max_workers=1) as thread:
            pandas = thread.submit(importlib.import_module, "pandas").result()
        return pandas.DataFrame(self.rows)

    def column(self, name: str) -> Floats:
        """A column of the history, shape (rows,).

        Args:
            name: Its name.
        """
        return np.array([row[name] for row in self.rows], dtype=float)

    @property
    def results(self) -> dict[str, float]:
        """Results that the scene measured."""
        return plain_results(self.summary)


@assembled_as(lambda scene, *_, **__: scene.solver)
def execute(
    scene: Scene,
    out: Path | str | None = None,
    observers: Sequence[Observer] = (),
    *,
    comm: MPI.Comm = MPI.COMM_WORLD,
    pictures: bool = True,
    request: Request | None = None,
    results: Results | None = None,
    watched: bool = True,
    accounts: bool = True,
    saved: Saved | None = None,
    new: bool = True,
) -> RunResult:
    """Run a scene, or go on with it.

    Args:
        scene: The scene.
        out: Directory to write, which no other run writes meanwhile; None: nothing is written.
        observers: More observers; the numbers of those that measure enter the history.
        comm: Communicator.
        pictures: Whether pictures are drawn, where anything is written.
        request: How the scene was requested, so that `shellmb resume` can build it again.
        results: Gives the `results` of the summary; None: those of the scene.
        watched: Whether the run is watched for what makes it wrong, as a comparison run is not.
        accounts: Whether energies, momenta and forces are measured, though neither results nor
            controllers and events read them.
        saved: A state to go on from.
        new: Whether the run begins in a directory that is empty; else it is `claimed` already, also
            of a run that was killed before its first state and begins again.

    Raises:
        SceneError: If the scene does not fit its meshes, or `out` cannot be written or holds a run
            already.
        ConvergenceError: If a step fails at the smallest step size; what was computed is written.
        RunError: If `out` cannot be written any more, or the function `results` raises.
        Stopped: If a signal ended the run between two steps.
    """
    directory = None if out is None else Path(out)
    claim = nullcontext() if directory is None or not new else claimed(directory, comm, new=True)
    with claim, failing_together(comm):
        begin = clock.perf_counter()
        # a signal that comes to one of several ranks is taken up by all of them, behind a step
        check_memory(scene, comm)
        STOPPING.renew()
        with (
            STOPPING.deferred(_say) if comm.size > 1 else nullcontext(),
            collect_warnings(comm) as doubts,
            _no_exit(),
        ):
            simulation = Simulation(scene, comm)
        simulation.doubts += tuple(doubts)
        if directory is not None and comm.rank == 0:
            with written(directory, comm):
                if request is not None:
                    write_json(directory / REQUEST, request.to_dict())
                describe(scene).write(directory)
        measure = results or scene.results
        accounts = accounts or bool(measure or scene.sensors)
        standard = StandardObservers(directory, observers, watched=watched, accounts=accounts)
        if saved is not None:
            take_up(simulation, standard.named, saved)

        failure: BaseException | None = None
        try:
            with STOPPING.deferred(_say), written(directory, comm), _no_exit():
                simulation.run(list(standard.named.values()))
        except BaseException as error:
            failure = error
        before = setup_warnings([*ignored_settings.doubts(scene), *simulation.doubts])
        wall = clock.perf_counter() - begin
        failed = None if failure is None else str(failure) or type(failure).__name__
        if isinstance(failure, KeyboardInterrupt):
            failed = INTERRUPTED
        sources, own = standard.sources, simulation.scene
        rows, energy = sources.history.rows, sources.energy
        watches = [w for w in standard.watches if rows and not (w.runs and failure)]
        with _no_exit():
            found = (*before, *(each for watch in watches for each in watch.cautions(simulation)))
            summary = summarise(simulation, sources, wall, failed)
            summary |= points_and_events(simulation) | {"warnings": [c.to_dict() for c in found]}
        result = RunResult(own, simulation, rows, summary, energy, directory, found, measure)
        try:
            with written(directory, comm):
                # with errors there are bands of these in pictures, which are drawn behind them
                later = scene.errors or isinstance(failure, Stopped)
                _write(result, standard, pictures and not later)
        except RunError as error:
            # what came first counts
            failure = failure or error
        if failure is not None:
            raise _with_state(failure, directory, request, simulation) from failure.__cause__
        # the first rank has drawn
        arrive(comm)
        add_results(result.summary, directory, measure, result, comm)
        return result


@contextmanager
def _no_exit() -> Iterator[None]:
    """Refuse that a function of the scene ends the program, which would look like success."""
    try:
        yield
    except SystemExit as error:
        raise RunError(
            f"a function of the scene ends the program ({in_words(error)}); it must return a "
            "value, or raise an error",
            alone=True,
        ) from error


def _say(line: str) -> None:
    if MPI.COMM_WORLD.rank == 0:
        _log.warning(line)


def _write(result: RunResult, standard: StandardObservers, pictures: bool) -> None:
    """Write summary and pictures, on the first rank, of what has begun."""
    directory, frames = result.out, standard.frames
    if directory is None or result.simulation.model.comm.rank != 0 or not result.rows:
        return
    write_json(directory / SUMMARY, result.summary)
    if pictures and frames is not None:
        from shellmb.show.pictures import budget_of, draw_directory

        draw_directory(directory, budget=budget_of(result.summary["wall_s"]))


def _with_state(
    failure: BaseException, directory: Path | None, request: Request | None, simulation: Simulation
) -> BaseException:
    """The failure, with a word on what is left and how to go on."""
    if directory is None:
        return failure
    left = f"the last good state is in {directory / STATE}"
    if is_temporary(directory):
        left = "nothing of the run is left when Python ends; give out to keep its last good state"
    if user_frame(failure) is not None and not isinstance(failure, ShellmbError):
        failure.add_note(left)
    if isinstance(failure, ConvergenceError):
        return failure.reworded(f"{failure}; {left}")
    if isinstance(failure, ControlError):
        return ControlError(f"{failure}; {left}")
    if isinstance(failure, Stopped):
        if not is_temporary(directory):
            left = f"{resume_command(directory, request)} continues from there"
        where = f"t = {simulation.t:g}, step {simulation.step}"
        return Stopped(failure.signal, f"{where}; {left}")
    return failure


def _of_these_ranks(simulation: Simulation, saved: Saved) -> Saved:
    """A state that another number of ranks has saved, without what was known of earlier steps."""
    scene, count = simulation.scene, len(saved.ranks)
    what = "it follows a path" if scene.path is not None else None
    for body in scene.meshed:
        if body.modes:
            # eigenvectors have the sign, and of equal ones the mixture, that ranks give them
            what = f"the model of {said(body)} is {show(body.model)}"
    if what is not None:
        raise SceneError(
            f"resume: the run was made on {count} ranks, and {what}; resume it with "
            f"`mpiexec -n {count}`"
        )
    return replace(
        saved,
        arrays=simulation.spread(saved.ranks),
        simulation=saved.simulation | {"past": {}},
        ranks=(),
    )


def take_up(simulation: Simulation, named: dict[str, Observer], saved: Saved) -> None:
    """Go on from a saved state.

    Args:
        simulation: The simulation.
        named: Its observers by name.
        saved: The state.

    Raises:
        SceneError: If it does not fit the scene.
    """
    saved = _of_these_ranks(simulation, saved) if saved.ranks else saved
    now, then = (
        {k: v.shape for k, v in arrays.items() if not k.startswith((PAST, OBSERVED))}
        for arrays in (simulation.live(), saved.arrays)
    )
    if now != then:
        raise SceneError(
            f"resume: the state does not fit the scene '{simulation.scene.name}', which has other "
            "bodies, meshes or schemes now; undo the changes, or start the run again"
        )
    simulation.restore(saved.arrays, saved.simulation)
    for name, observer in named.items():
        if name in saved.observers:
            own = below(saved.arrays, f"{OBSERVED}{name}/")
            observer.restore(with_arrays(saved.observers[name], own))
