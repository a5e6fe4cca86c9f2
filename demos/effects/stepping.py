"""A scene that is stepped for a while, with the observers of `shellmb run`, all of it timed."""

from __future__ import annotations

import io
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from statistics import quantiles

from mpi4py import MPI

from rich.console import Console

from shellmb.accuracy.measuring import slowest
from shellmb.clock import CHOSEN, now
from shellmb.demos.verification.measuring import Stopwatch
from shellmb.native.kernels import watched
from shellmb.observers.progress import ProgressReport
from shellmb.running.standard import StandardObservers
from shellmb.scene import Scene
from shellmb.simulate.simulation import BaseObserver, Observer, Simulation, busy

# steps before those that are measured: the predictor needs four, an observer may load its library
WARM = 5
CLOCKS: dict[str, Callable[[], float]] = {"cpu": time.process_time, "wall": time.perf_counter}


@contextmanager
def scratch() -> Iterator[Path]:
    """A folder for a while, the same on all ranks; collective."""
    with tempfile.TemporaryDirectory() as own:
        yield Path(MPI.COMM_WORLD.bcast(own))
        # others may still write
        MPI.COMM_WORLD.Barrier()


def observers_of_run(folder: Path) -> dict[str, Observer]:
    """Observers of `shellmb run` by their names.

    Args:
        folder: What they write goes there; what they say goes nowhere.
    """
    progress = ProgressReport(Console(file=io.StringIO()))
    return StandardObservers(folder, [progress]).named


class Timed(BaseObserver):
    """Observers as one.

    Args:
        observers: They.

    Attributes:
        inner: They.
        seconds: Time spent in them during steps so far, s.
        kernels: Names of the programs that they made for themselves.
    """

    def __init__(self, *observers: Observer) -> None:
        self.inner, self.seconds = observers, 0.0
        self.kernels: set[str] = set()

    def start(self, simulation: Simulation) -> None:
        """Before the first step."""
        with watched() as self.kernels:
            for observer in self.inner:
                observer.start(simulation)
        # as in a run, those that have nothing to do are not called in steps
        self.inner = tuple(busy(self.inner))

    def switched(self, simulation: Simulation) -> None:
        """Something began to act."""
        self._each(lambda observer: observer.switched(simulation))

    def solved(self, simulation: Simulation) -> None:
        """A step is solved."""
        self._each(lambda observer: observer.solved(simulation))

    def accepted(self, simulation: Simulation) -> None:
        """A step is accepted."""
        self._each(lambda observer: observer.accepted(simulation))

    def finish(self, simulation: Simulation, error: BaseException | None) -> None:
        """After the last step."""
        for observer in self.inner:
            observer.finish(simulation, error)

    def _each(self, call: Callable[[Observer], None]) -> None:
        begin = now()
        for observer in self.inner:
            call(observer)
        self.seconds += now() - begin


def one_by_one(observers: Mapping[str, Observer]) -> dict[str, Timed]:
    """Each timed for itself."""
    return {name: Timed(observer) for name, observer in observers.items()}


def together(observers: Mapping[str, Observer]) -> dict[str, Timed]:
    """All timed as one: fewer looks at a clock, which take their time where it is a slow one."""
    return {"all": Timed(*observers.values())}


class Stepping:
    """A simulation that is run round by round.

    Args:
        scene: The scene.
        folder: Where its observers write.
        group: How they are timed.

    Attributes:
        simulation: The simulation.
        observers: Its observers, timed.
        steps: Number of steps so far; as the other numbers it counts on where the scene begins
            again.
        iterations: Newton iterations so far.
    """

    def __init__(
        self,
        scene: Scene,
        folder: Path,
        group: Callable[[Mapping[str, Observer]], dict[str, Timed]] = one_by_one,
    ) -> None:
        self.simulation = Simulation(scene)
        if self.simulation.model.comm.rank == 0:
            folder.mkdir(parents=True, exist_ok=True)
        self.simulation.model.comm.Barrier()
        self.observers = group(observers_of_run(folder))
        for observer in self.observers.values():
            observer.start(self.simulation)
        self.simulation.control.attach(self.simulation, list(self.observers.values()))
        self._start = self.simulation.saved()
        self.steps = self.iterations = 0

    @property
    def factorisations(self) -> int:
        """Factorisations so far."""
        return self.simulation.problem.iteration.factorisations

    @property
    def over(self) -> bool:
        """Decide whether the scene is at its end."""
        return self.simulation.over

    def again(self) -> None:
        """Be at the start again, with nothing left of what was learnt since."""
        self.simulation.restore(*self._start)
        self.simulation.problem.iteration.refresh.forget()

    def advance(self, steps: int) -> float:
        """Run steps as users do, or less if the scene is over before; returns their time, s."""
        total = 0.0
        observers = list(self.observers.values())
        for _ in range(steps):
            if self.over:
                break
            begin = now()
            self.simulation.advance(observers)
            total += now() - begin
            assert self.simulation.last is not None
            self.steps += 1
            self.iterations += self.simulation.last.iterations
        return total

    def round(self, steps: int) -> float:
        """Run the first steps of the scene anew; returns the processor time of one, s.

        Of several ranks the slowest counts. Wall times would tell how busy the machine is.
        """
        self.again()
        before, watch = self.steps, Stopwatch()
        self.advance(steps)
        return slowest(self.simulation.model.comm, watch.cpu) / (self.steps - before)

    def seconds(self) -> dict[str, float]:
        """Time spent in each of the observers so far, s."""
        return {name: timed.seconds for name, timed in self.observers.items()}

    def finish(self) -> None:
        """Close the files."""
        for observer in self.observers.values():
            observer.finish(self.simulation, None)


def observer_shares(stepping: Stepping, steps: int) -> dict[str, float]:
    """Shares of the time of the next steps that the observers take; none if the scene is over."""
    before = stepping.seconds()
    took = stepping.advance(steps)
    return {n: (s - before[n]) / took for n, s in stepping.seconds().items()} if took else {}


@contextmanager
def measured_in(clock: str) -> Iterator[None]:
    """Parts of steps are timed by a clock meanwhile.

    On a machine that others use, too, a step is interrupted and a kernel timed alone is not:
    only processor times can be compared there. On an idle machine they are the wall times, the
    process computing on one thread.

    Args:
        clock: "cpu" or "wall".
    """
    token = CHOSEN.set(CLOCKS[clock])
    try:
        yield
    finally:
        CHOSEN.reset(token)


def in_turn[T](rounds: int, works: Sequence[Callable[[], T]]) -> list[tuple[T, ...]]:
    """Results of works in turn, round by round, so that other load affects all alike.

    What runs second finds the caches of the first: every other round goes backwards.

    Args:
        rounds: Their number; in each all works are done once.
        works: The works.

    Returns:
        For each round what the works returned, in the order of `works`.
    """
    found = []
    for k in range(rounds):
        order = -1 if k % 2 else 1
        found.append(tuple([work() for work in works[::order]][::order]))
    return found


def shares(pairs: Sequence[tuple[float, ...]]) -> tuple[float, float]:
    """Median share of the time that is saved, and the width of the middle half of the shares.

    The extremes of many short rounds tell what else the machine did.

    Args:
        pairs: Times with and without, of each round.
    """
    found = [1 - less / own for own, less in pairs]
    if len(found) == 1:
        return found[0], 0.0
    lower, middle, upper = quantiles(found, n=4, method="inclusive")
    return middle, upper - lower
