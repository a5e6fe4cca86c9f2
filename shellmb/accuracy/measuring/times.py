"""Times: the slowest rank, and what is typical of rounds."""

from collections.abc import Callable, Iterable, Sequence

from mpi4py import MPI


def slowest(comm: MPI.Comm, seconds: float) -> float:
    """The time of the slowest rank, which the others wait for; collective."""
    return float(comm.allreduce(seconds, op=MPI.MAX))


def spread(times: Sequence[float], typical: float) -> float:
    """Difference of the slowest and the fastest round, relative to the typical one."""
    return (max(times) - min(times)) / typical if typical > 0 else 0.0


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
