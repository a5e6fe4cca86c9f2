"""Checks that all ranks have the same scene.

What is random, or requested otherwise, may differ. A function of the user's may have the same code
on all ranks and give other values, because it asks for its rank, for a random number or for a file
of the machine. So its values are compared, too.
"""

from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import RunError, SceneError, alike
from shellmb.scene import Scene
from shellmb.scene.fingerprint import differences, fingerprint
from shellmb.scene.values.user_functions import GivenFunction, given_functions

# so many differences are named
NAMED = 3
# of the value: processors of other kinds compute a sine in other ways
CLOSE = 1e-9
# where functions of time are compared, in parts of a step: within it and at its end
INSTANTS = 0.21, 0.79, 1.0
SEED = "give random numbers a seed, and ask for no rank in a function"


def same_on_all(scene: Scene, comm: MPI.Comm) -> None:
    """Refuse scenes that differ from rank to rank, before anything is built of them; collective.

    Each rank would build its part of another scene: a mixture, or ranks that wait for one another
    for ever.

    Args:
        scene: The scene of this rank.
        comm: The ranks.

    Raises:
        SceneError: On all ranks, if they differ; says in what.
    """
    if comm.size == 1:
        return
    own = fingerprint(scene, whole=True)
    first: dict[str, Any] = comm.bcast(own)
    found = differences(first, own)
    said = ", ".join(
        f"{path} is {was} on rank 0 and {now} on rank {comm.rank}"
        for path, was, now in found[:NAMED]
    )
    more = f", and {len(found) - NAMED} more" if len(found) > NAMED else ""
    with alike(comm):
        if found:
            raise SceneError(
                f"scene '{scene.name}' differs from rank to rank: {said}{more}; all ranks must "
                "describe the same scene: give random numbers a seed, and all ranks the same "
                "options"
            )
    # functions have the same code: their values are compared where they are tried
    mine = [f.trial(scene.t_end) for f in given_functions(scene)]
    theirs = comm.bcast(mine)
    with alike(comm):
        for function, a, b in zip(given_functions(scene), theirs, mine, strict=True):
            if not _close(a, b):
                raise SceneError(
                    f"scene '{scene.name}': {function.path} gives other values from rank to rank; "
                    f"it must give the same on all: {SEED}"
                )


def _close(a: Any, b: Any) -> bool:
    """Decide whether values are the same to round-off."""
    if isinstance(a, list):
        return all(_close(x, y) for x, y in zip(a, b, strict=True))
    if not (isinstance(a, np.ndarray) and isinstance(b, np.ndarray)):
        return type(a) is type(b) and a == b
    return a.shape == b.shape and bool(np.all(np.abs(a - b) <= CLOSE * np.abs(a).max(initial=0.0)))


class TimesAlike:
    """Compares functions of time from rank to rank, in each step; without other ranks nothing.

    Args:
        scene: The scene.
        comm: The ranks.
    """

    def __init__(self, scene: Scene, comm: MPI.Comm) -> None:
        self._comm, self._name = comm, scene.name
        self._given: list[tuple[GivenFunction, int]] = []
        if comm.size > 1:
            tried = ((f, f.at(0.0)) for f in given_functions(scene) if f.arguments == 1)
            self._given = [(f, len(v)) for f, v in tried if isinstance(v, np.ndarray)]

    def check(self, t: float, dt: float) -> None:
        """Compare their values in a step; collective.

        Args:
            t: Time at its start, s.
            dt: Its length, s.

        Raises:
            RunError: On all ranks, if a function gives other values on one of them.
        """
        if not self._given:
            return
        values = np.concatenate([self._values(f, n, t, dt) for f, n in self._given])
        bounds = np.concatenate([values, -values])
        self._comm.Allreduce(MPI.IN_PLACE, bounds, MPI.MAX)
        most, least = bounds[: len(values)], -bounds[len(values) :]
        apart = most - least > CLOSE * np.maximum(np.abs(most), np.abs(least))
        if apart.any():
            k = int(np.argmax(apart))
            owners = [f.path for f, n in self._given for _ in range(n * len(INSTANTS))]
            raise RunError(
                f"scene '{self._name}': {owners[k]} gives {least[k]:.6g} on one rank and "
                f"{most[k]:.6g} on another between t = {t:.6g} and {t + dt:.6g}; it must give the "
                f"same on all: {SEED}"
            )

    @staticmethod
    def _values(given: GivenFunction, size: int, t: float, dt: float) -> Floats:
        """Values of one function at the instants; what has no such value fails in its place."""
        found = np.full((len(INSTANTS), size), np.inf)
        for row, part in zip(found, INSTANTS, strict=True):
            value = given.at(t + part * dt)
            if isinstance(value, np.ndarray) and len(value) == size:
                row[:] = value
        return np.nan_to_num(found).ravel()
