"""Comparison runs of a scene, each run once; a failure of one is a remark."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from mpi4py import MPI

from shellmb.accuracy.companions import Change
from shellmb.accuracy.repeat import Beginning, Steps, kept, run_again
from shellmb.accuracy.run_record import RunRecord, keep
from shellmb.errors import ShellmbError, Stopped
from shellmb.meshes.lifetime import free
from shellmb.running.execute import Companion, RunResult, execute
from shellmb.running.request import Request
from shellmb.running.results import Results
from shellmb.scene import Scene
from shellmb.simulate.simulation import Observer

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
