"""A simulation that begins again with other steps: comparison runs without a new model."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from shellmb.running.execute import RunResult, execute
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
