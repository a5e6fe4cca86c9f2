"""Comparison runs of a scene, each run once."""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mpi4py import MPI

from shellmb.accuracy.companions import Change
from shellmb.accuracy.run_record import RunRecord, keep
from shellmb.errors import ShellmbError, Stopped, unsaid
from shellmb.meshes.lifetime import free
from shellmb.running.execute import RunResult, execute
from shellmb.running.request import Request
from shellmb.running.results import Results
from shellmb.scene import Scene
from shellmb.simulate.simulation import BaseObserver, Observer, Simulation


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
        self._results, self._accounts = results, accounts
        self.found: dict[Change, RunRecord | None] = {}
        self.failures: dict[Change, str] = {}

    @unsaid()
    def run(self, change: Change) -> RunRecord | None:
        """A comparison run; None where it cannot be, or fails; collective.

        Args:
            change: What is different in it.
        """
        if change not in self.found:
            try:
                run, found = self.start(change, watched=False, accounts=self._accounts)
            except Stopped:
                raise
            except ShellmbError as error:
                self.failures[change], self.found[change] = str(error), None
            else:
                self.found[change], large = found, is_large(run)
                del run
                if large:
                    free(self.comm)
        return self.found[change]

    def start(
        self,
        change: Change,
        out: Path | None = None,
        observers: Sequence[Observer] = (),
        request: Request | None = None,
        **measured: bool,
    ) -> tuple[RunResult, RunRecord]:
        """Run the scene with a change; collective.

        Args:
            change: What is different in it.
            out: Directory to write; None: nothing is written.
            observers: More observers.
            request: How the scene was requested.
            **measured: What is measured, as of `execute`; without a word everything.

        Returns:
            The run, and what is kept of it.

        Raises:
            ShellmbError: If there is no such scene, or it fails.
        """
        scene, clock, steps = change.apply(self.scene), time.process_time(), Steps()
        how: Any = {"comm": self.comm, "request": request, "results": self._results, **measured}
        run = execute(scene, out, [*observers, steps], pictures=False, **how)
        return run, keep(run, steps.seconds, time.process_time() - clock)
