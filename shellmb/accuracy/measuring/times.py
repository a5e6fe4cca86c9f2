"""Times: two clocks, the slowest rank, works that take turns, and what is typical of rounds."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager
from statistics import quantiles

from mpi4py import MPI

from shellmb.clock import timed_by

CLOCKS: dict[str, Callable[[], float]] = {"cpu": time.process_time, "wall": time.perf_counter}


class Stopwatch:
    """Times since it was made, or started anew: wall times tell how busy the machine is, too."""

    def __init__(self) -> None:
        self.start()

    def start(self) -> None:
        """Start anew."""
        self._cpu, self._wall = time.process_time(), time.perf_counter()

    @property
    def cpu(self) -> float:
        """Processor time, s."""
        return time.process_time() - self._cpu

    @property
    def wall(self) -> float:
        """Wall time, s."""
        return time.perf_counter() - self._wall


def measured_in(clock: str) -> AbstractContextManager[None]:
    """Parts of steps are timed by a clock meanwhile.

    On a machine that others use, too, a step is interrupted and a kernel timed alone is not:
    only processor times can be compared there. On an idle machine they are the wall times, the
    process computing on one thread.

    Args:
        clock: "cpu" or "wall".
    """
    return timed_by(CLOCKS[clock])


def slowest(comm: MPI.Comm, seconds: float) -> float:
    """The time of the slowest rank, which the others wait for; collective."""
    return float(comm.allreduce(seconds, op=MPI.MAX))


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


def spread(times: Sequence[float], typical: float) -> float:
    """Difference of the slowest and the fastest round, relative to the typical one."""
    return (max(times) - min(times)) / typical if typical > 0 else 0.0


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


def unbeaten[P](
    points: Iterable[P], time: Callable[[P], float], error: Callable[[P], float]
) -> list[P]:
    """Points that no other one beats in both error and time, the fastest first.

    Args:
        points: Points.
        time: Of a point.
        error: Of a point; infinite ones are left out.
    """
    found: list[P] = []
    least = float("inf")
    for point in sorted(points, key=lambda p: (time(p), error(p))):
        if error(point) < least:
            found.append(point)
            least = error(point)
    return found
