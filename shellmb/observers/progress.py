"""Progress of a run: a bar on a terminal or in a notebook, lines of a log elsewhere."""

import sys
import time as clock
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from shellmb.simulate.simulation import BaseObserver, Simulation

# a line of the log at every tenth of the run, or when nothing was said for so long [s]
TENTHS = 10
PATIENCE = 30.0
# columns of a bar in a notebook, which knows no width
WIDTH = 100


def in_notebook() -> bool:
    """Decide whether this process is the kernel of a notebook."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    return type(shell).__name__ == "ZMQInteractiveShell"


def is_watched() -> bool:
    """Decide whether somebody sees a bar on stderr: on a terminal, or in a notebook."""
    return in_notebook() or sys.stderr.isatty()


def _console() -> Console:
    if not in_notebook():
        return Console(stderr=True)
    # one line that is written again and again, which needs no widgets
    plain = {"force_jupyter": False, "force_terminal": True, "color_system": None}
    return Console(stderr=True, width=WIDTH, **plain)  # type: ignore[arg-type]


class ProgressReport(BaseObserver):
    """Shows how far a run is, on rank 0 only.

    Args:
        console: Where to; a terminal gets a bar. None: stderr.
    """

    def __init__(self, console: Console | None = None) -> None:
        self.console = console or _console()
        # of what is no terminal it does nothing
        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.percentage:>3.0f} %"),
            TimeRemainingColumn(),
            console=self.console,
            transient=True,
            disable=not self.console.is_terminal,
        )
        self._task = self._bar.add_task("", total=None)

    @contextmanager
    def building(self, name: str, rank: int) -> Iterator[None]:
        """Context in which a run is built and carried out, shown from its first second.

        Args:
            name: Name of the scene.
            rank: Rank of this process.
        """
        if rank != 0:
            yield
            return
        self._bar.remove_task(self._task)
        self._task = self._bar.add_task(f"{name}: building", total=None)
        self._bar.start()
        try:
            yield
        finally:
            self._bar.stop()

    def start(self, simulation: Simulation) -> None:
        """Say what is run."""
        self._shown = simulation.model.comm.rank == 0
        if not self._shown:
            return
        self._begin = self._last = clock.perf_counter()
        self._done = 0.0
        self._tenth = int(TENTHS * self._part(simulation))
        model, problem = simulation.model, simulation.problem
        self._line(
            f"{simulation.scene.name}: {model.elements} elements, {problem.system.size} unknowns, "
            f"{simulation.scheme.title}, {self._range(simulation)}, "
            f"forms in {problem.system.jit_seconds:.1f} s"
        )
        self._bar.reset(self._task, total=1.0, description=simulation.scene.name)
        self._bar.update(self._task, completed=self._done)
        self._bar.start()

    def _line(self, text: str) -> None:
        self.console.print(text, highlight=False, markup=False, soft_wrap=True)

    def _part(self, simulation: Simulation) -> float:
        """Part of the run that is done: of its time, or of the load at which a path ends.

        The load of a path goes down, too; what is done stays done.
        """
        part = simulation.t / simulation.t_end
        scene_path = simulation.scene.path
        if simulation.path is not None and scene_path is not None and scene_path.load_end:
            part = max(part, simulation.path.factor / scene_path.load_end)
        self._done = max(self._done, min(part, 1.0))
        return self._done

    @staticmethod
    def _range(simulation: Simulation) -> str:
        """From where to where it goes."""
        times = f"t = {simulation.t:g} to {simulation.t_end:g}"
        path = simulation.scene.path
        if simulation.path is None or path is None:
            return times
        last = "" if path.load_end is None else f" to {path.load_end:g}"
        return f"path from load factor {simulation.path.factor:g}{last}, arc length {times}"

    def _status(self, simulation: Simulation) -> str:
        mean = simulation.iterations / max(simulation.step, 1)
        rejected = f", {simulation.size.rejected} rejected" if simulation.size.rejected else ""
        path = simulation.path
        load = "" if path is None else f"load factor {path.factor:.4g}, "
        return (
            f"step {simulation.step}{rejected}, {load}t = {simulation.t:.4g}, "
            f"{mean:.1f} iterations per step"
        )

    def accepted(self, simulation: Simulation) -> None:
        """Move the bar, or write a line now and then."""
        if not self._shown:
            return
        if self.console.is_terminal:
            status, done = self._status(simulation), self._part(simulation)
            self._bar.update(self._task, completed=done, description=status)
            return
        now = clock.perf_counter()
        tenth = int(TENTHS * self._part(simulation) + 1e-9)
        if tenth > self._tenth or now - self._last > PATIENCE:
            self._tenth, self._last = tenth, now
            self._line(f"{self._status(simulation)}, {now - self._begin:.1f} s")

    def finish(self, simulation: Simulation, error: BaseException | None) -> None:
        """Take the bar away."""
        if self._shown:
            self._bar.stop()
