"""Comparison runs of a scene, each run once, on the last model where that serves again."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from mpi4py import MPI

from shellmb.accuracy.companions import Change
from shellmb.accuracy.run_record import RunRecord, keep
from shellmb.errors import ShellmbError, Stopped
from shellmb.meshes.lifetime import free
from shellmb.running.execute import Companion, RunResult, execute
from shellmb.running.request import Request
from shellmb.running.results import Results
from shellmb.scene import Scene
from shellmb.simulate.simulation import BaseObserver, Observer, Simulation
from shellmb.simulate.stepping import Arrays


class Steps(BaseObserver):
    """An observer that times the steps of a run.

    Attributes:
        seconds: Their processor time [s].
    """

    def __init__(self) -> None:
        self._begun = self.seconds = 0.0

    def start(self, simulation: Simulation) -> None:
        """Start the clock."""
        self._begun = time.process_time()

    def finish(self, simulation: Simulation, error: BaseException | None) -> None:
        """Stop the clock."""
        self.seconds = time.process_time() - self._begun


class Beginning(Steps):
    """An observer that also keeps the state before the first step.

    Attributes:
        simulation: The simulation; None: it has not begun, or went on from a later state.
        arrays: Its arrays.
        counters: Its counters.
        building: Processor time from when this was made to the start of the steps [s].
    """

    def __init__(self) -> None:
        super().__init__()
        self._made, self.building = time.process_time(), 0.0
        self.simulation: Simulation | None = None
        self.arrays: Arrays = {}
        self.counters: dict[str, Any] = {}

    def start(self, simulation: Simulation) -> None:
        """Keep the state, and start the clock."""
        super().start(simulation)
        self.building = self._begun - self._made
        if simulation.step == 0 and simulation.repeatable:
            self.simulation = simulation
            self.arrays, self.counters = simulation.saved()


@contextmanager
def kept(simulation: Simulation) -> Iterator[None]:
    """Context that restores a simulation to its end.

    Args:
        simulation: The simulation.
    """
    arrays, counters = simulation.saved()
    scene, t_end, size, last = simulation.scene, simulation.t_end, simulation.size, simulation.last
    levels, control = simulation.problem.levels.values(), simulation.control
    stages = [(f, f.x.array.copy()) for level in levels for f in level.unknown.values()]
    try:
        yield
    finally:
        simulation.begin_again(scene, arrays, counters, size)
        simulation.t_end, simulation.last, simulation.control = t_end, last, control
        for function, values in stages:
            function.x.array[:] = values


def run_again(
    begin: Beginning,
    scene: Scene,
    clock: Steps,
    out: Path | None = None,
    observers: Sequence[Observer] = (),
    **how: Any,
) -> RunResult:
    """Run a scene with other steps on the simulation of a run.

    Args:
        begin: What kept the state before the run's first step.
        scene: The scene, with other steps.
        clock: Times its steps.
        out: Directory to write; None: nothing is written.
        observers: More observers.
        **how: As of `execute`.

    Raises:
        ConvergenceError: If a step fails.
        RunError: If `results` fails.
    """
    simulation = begin.simulation
    assert simulation is not None
    simulation.begin_again(scene, begin.arrays, begin.counters)
    own = [*observers, clock]
    return execute(scene, out, own, pictures=False, simulation=simulation, **how)


# unknowns above which what a companion leaves behind is freed at once: looking through all objects
# takes a tenth of a second
LARGE = 50_000


def is_large(run: RunResult) -> bool:
    """Decide whether what a run leaves behind is to be freed at once; alike on all ranks.

    Args:
        run: The run.
    """
    simulation = run.simulation
    return simulation.model.comm.size > 1 or simulation.problem.system.size > LARGE


class Family:
    """Runs of one scene with changes.

    Args:
        scene: The scene.
        results: Gives results; None: the scene's own function.
        comm: Communicator.
        accounts: Whether comparison runs measure energies, momenta and forces, too.

    Attributes:
        found: What is kept of runs; None of those that failed.
        failures: Why these failed.
    """

    def __init__(
        self,
        scene: Scene,
        results: Results | None,
        comm: MPI.Comm = MPI.COMM_WORLD,
        accounts: bool = False,
    ) -> None:
        self.scene, self.comm = scene, comm
        self._results, self._companion = results, Companion(accounts)
        self.found: dict[Change, RunRecord | None] = {}
        self.failures: dict[Change, str] = {}
        # the last model is used again where only steps differ
        self._model: Change | None = None
        self._begin = Beginning()

    def take_up(
        self,
        run: RunResult,
        begin: Beginning | None,
        change: Change,
        on: ExitStack,
        cpu: float = 0.0,
    ) -> None:
        """Take up a run that is there already; its simulation is as it was when `on` is left.

        Args:
            run: The run, at its end.
            begin: What kept the state before its first step; None: it cannot begin again.
            change: What is different in it.
            on: Left when the comparison runs are done.
            cpu: Processor time of the run [s].
        """
        self.found[change] = keep(run, 0.0 if begin is None else begin.seconds, cpu)
        if begin is not None and begin.simulation is run.simulation:
            self._model, self._begin = change.model, begin
            on.enter_context(kept(run.simulation))

    def run(self, change: Change) -> RunRecord | None:
        """A comparison run; None where it cannot be, or fails; collective.

        Args:
            change: What is different in it.
        """
        if change not in self.found:
            self.found[change] = self._try(change)
        return self.found[change]

    def _try(self, change: Change) -> RunRecord | None:
        try:
            run, begin, cpu = self.start(change, companion=self._companion)
        except Stopped:
            raise
        except ShellmbError as error:
            self.failures[change] = str(error)
            return None
        found = keep(run, begin.seconds, cpu)
        large = is_large(run)
        del run
        if large:
            free(self.comm)
        return found

    def start(
        self,
        change: Change,
        out: Path | None = None,
        observers: Sequence[Observer] = (),
        request: Request | None = None,
        companion: Companion | None = None,
    ) -> tuple[RunResult, Beginning, float]:
        """Run the scene with a change, on the last model where that is the one of it; collective.

        Args:
            change: What is different in it.
            out: Directory to write; None: nothing is written.
            observers: More observers.
            request: How the scene was requested.
            companion: What is measured; None: everything.

        Returns:
            The run, what kept the state before its first step, and the processor time of all of
            it [s], that of the model included.

        Raises:
            ShellmbError: If there is no such scene, or it fails.
        """
        scene, clock = change.apply(self.scene), time.process_time()
        how: Any = {"comm": self.comm, "request": request, "results": self._results}
        begin, built = Beginning(), 0.0
        if change.model == self._model and self._begin.simulation is not None:
            begin, built, steps = self._begin, self._begin.building, Steps()
            run = run_again(begin, scene, steps, out, observers, companion=companion, **how)
            begin.seconds = steps.seconds
        else:
            own = [*observers, begin]
            run = execute(scene, out, own, pictures=False, companion=companion, **how)
            self._model, self._begin = change.model, begin
        return run, begin, built + time.process_time() - clock
