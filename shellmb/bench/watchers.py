"""The observers of `shellmb run`, and the time they take."""

from __future__ import annotations

import io
import time
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from shellmb.observers.progress import ProgressReport
from shellmb.run.standard import StandardObservers
from shellmb.simulate.simulation import Observer, Silent, Simulation


def default_observers(folder: Path) -> list[Observer]:
    """Those of `shellmb run`.

    Args:
        folder: What they write goes there; what they say goes nowhere.
    """
    progress = ProgressReport(Console(file=io.StringIO()))
    return list(StandardObservers(folder, [progress]).named.values())


class Timed(Silent):
    """Several observers as one, with the time they take.

    Args:
        observers: They.

    Attributes:
        seconds: Time spent in them during steps so far, s.
    """

    def __init__(self, observers: Sequence[Observer]) -> None:
        self.observers = list(observers)
        self.seconds = 0.0

    def start(self, simulation: Simulation) -> None:
        """Before the first step."""
        for observer in self.observers:
            observer.start(simulation)

    def switched(self, simulation: Simulation) -> None:
        """Something began to act."""
        begin = time.perf_counter()
        for observer in self.observers:
            observer.switched(simulation)
        self.seconds += time.perf_counter() - begin

    def solved(self, simulation: Simulation) -> None:
        """A step is solved."""
        begin = time.perf_counter()
        for observer in self.observers:
            observer.solved(simulation)
        self.seconds += time.perf_counter() - begin

    def accepted(self, simulation: Simulation) -> None:
        """A step is accepted."""
        begin = time.perf_counter()
        for observer in self.observers:
            observer.accepted(simulation)
        self.seconds += time.perf_counter() - begin

    def finish(self, simulation: Simulation, error: BaseException | None) -> None:
        """After the last step."""
        for observer in self.observers:
            observer.finish(simulation, error)
