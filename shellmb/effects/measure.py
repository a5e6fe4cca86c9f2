"""Time of a step with and without an effect, one beside the other, so that noise hits both."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from statistics import median

from mpi4py import MPI

from shellmb.bench.restart import Restart
from shellmb.bench.watchers import Timed
from shellmb.kernels import watched
from shellmb.run.directory import make_directory
from shellmb.run.standard import StandardObservers
from shellmb.scene import Scene
from shellmb.simulate.simulation import Observer, Simulation
from shellmb.simulate.stepsize.landing import ROUND_OFF


class Stepping:
    """A scene that is stepped for a while, with the observers of `shellmb run`, each timed.

    Args:
        scene: The scene.
        folder: Where its observers write.

    Attributes:
        simulation: The simulation.
        kernels: Names of the kernels that each observer compiled for itself.
    """

    def __init__(self, scene: Scene, folder: Path) -> None:
        self.simulation = Simulation(scene)
        make_directory(folder, self.simulation.model.comm)
        standard = StandardObservers(folder)
        self._timed = {name: Timed([observer]) for name, observer in standard.named.items()}
        self._observers: list[Observer] = list(self._timed.values())
        self.kernels: dict[str, set[str]] = {}
        for name, observer in self._timed.items():
            with watched() as self.kernels[name]:
                observer.start(self.simulation)
        self._restart = Restart(self.simulation)
        self._seconds: list[float] = []
        self._observers_seconds: dict[str, float] = {}
        self._total = 0.0

    def round(self, steps: int) -> float:
        """Run the first steps of the scene anew; returns the processor time of one, s.

        Of several ranks the slowest counts. Wall times would tell how busy the machine is.

        Args:
            steps: Their number, or less if the scene is over before.
        """
        self._restart()
        begin = time.process_time()
        _, done = self._advance(steps)
        spent = time.process_time() - begin
        spent = float(self.simulation.model.comm.allreduce(spent, op=MPI.MAX)) / done
        self._seconds.append(spent)
        return spent

    def begin(self, warm: int, steps: int) -> None:
        """Run the first steps, which load libraries and fill caches, then time the observers.

        Args:
            warm: Steps that do not count.
            steps: Steps after them, or none if the scene is over.
        """
        first = self._advance(warm)
        before = {name: timed.seconds for name, timed in self._timed.items()}
        total, done = self._advance(steps)
        if not done:
            # the scene is over: better the first steps than none
            before, (total, done) = dict.fromkeys(before, 0.0), first
        self._total = total if done else 0.0
        self._observers_seconds = {n: t.seconds - before[n] for n, t in self._timed.items()}

    def _advance(self, steps: int) -> tuple[float, int]:
        """Run steps up to the scene's end; returns the time they took, s, and their number."""
        simulation, total, done = self.simulation, 0.0, 0
        while done < steps and simulation.t_end - simulation.t > ROUND_OFF * simulation.size.dt:
            begin = time.perf_counter()
            simulation.advance(self._observers)
            total += time.perf_counter() - begin
            done += 1
        return total, done

    @property
    def step_seconds(self) -> float:
        """Median processor time of a step, s."""
        return median(self._seconds)

    @property
    def seconds(self) -> list[float]:
        """Processor time of a step in each round, s."""
        return list(self._seconds)

    def observer_share(self, name: str) -> float | None:
        """Share of the step time of an observer; None if the scene was over before."""
        return self._observers_seconds[name] / self._total if self._total else None

    def finish(self) -> None:
        """Close the files."""
        for observer in self._observers:
            observer.finish(self.simulation, None)


def share(with_it: Stepping, without: Stepping, steps: int, rounds: int) -> float:
    """Share of the step time that goes when an effect is left out, median over rounds.

    Args:
        with_it: The scene as it is.
        without: The scene without the effect.
        steps: Steps of each in a round.
        rounds: Rounds; in each both are run.
    """
    pairs = in_turn(lambda: with_it.round(steps), lambda: without.round(steps), rounds)
    return median(1 - less / own for own, less in pairs)


def in_turn(
    first: Callable[[], float], second: Callable[[], float], rounds: int
) -> list[tuple[float, float]]:
    """What two measurements say, round by round.

    Args:
        first: One of them.
        second: The other.
        rounds: Their number; in each both are made.
    """
    found = []
    for k in range(rounds):
        # what runs second finds the caches of the first: in turn that is one or the other
        if k % 2:
            other, one = second(), first()
        else:
            one, other = first(), second()
        found.append((one, other))
    return found
