"""Companions of a scene, each run once; what goes wrong with one is a remark."""

from __future__ import annotations

import time
from contextlib import ExitStack

from mpi4py import MPI

from shellmb.accuracy.companions import Change
from shellmb.accuracy.kept import Kept, keep
from shellmb.accuracy.repeat import Beginning, Steps, kept, run_again
from shellmb.errors import ShellmbError, Stopped
from shellmb.measuring.stepping import free
from shellmb.running.execute import Companion, RunResult, execute
from shellmb.running.results import Results
from shellmb.scene import Scene

# unknowns above which what a companion leaves behind is freed at once: looking through all objects
# takes a tenth of a second
LARGE = 50_000


class Family:
    """Runs of one scene with changes.

    Args:
        scene: The scene.
        results: Gives results; None: the scene's own function.
        comm: Communicator.
        accounts: Whether companions measure energies, momenta and forces, too.

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
        self.found: dict[Change, Kept | None] = {}
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
            on: Left when the companions have run.
            cpu: Processor time of the run [s].
        """
        self.found[change] = keep(run, 0.0 if begin is None else begin.seconds, cpu)
        if begin is not None and begin.simulation is run.simulation:
            self._model, self._begin = change.model, begin
            on.enter_context(kept(run.simulation))

    def run(self, change: Change) -> Kept | None:
        """A companion; None where it cannot be, or fails; collective.

        Args:
            change: What is different in it.
        """
        if change not in self.found:
            self.found[change] = self._try(change)
        return self.found[change]

    def _try(self, change: Change) -> Kept | None:
        try:
            scene = change.apply(self.scene)
            clock = time.process_time()
            if change.model == self._model and self._begin.simulation is not None:
                steps = Steps()
                again = run_again(
                    self._begin, scene, self._results, self.comm, steps, self._companion
                )
                return keep(again, steps.seconds, time.process_time() - clock)
            begin = Beginning()
            run = execute(
                scene,
                None,
                [begin],
                comm=self.comm,
                pictures=False,
                results=self._results,
                companion=self._companion,
            )
        except Stopped:
            raise
        except ShellmbError as error:
            self.failures[change] = str(error)
            return None
        self._model, self._begin = change.model, begin
        found = keep(run, begin.seconds, time.process_time() - clock)
        large = run.simulation.problem.system.size > LARGE
        del run
        if large or self.comm.size > 1:
            free(self.comm)
        return found
