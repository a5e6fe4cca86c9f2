"""Meetings of ranks: waits without work, as others may need the cores, and what one found."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mpi4py import MPI

# between two looks, s: nothing beside what is worth waiting for in this way
PAUSE = 1e-3


def arrive(comm: MPI.Comm) -> None:
    """Wait until all ranks are here; collective.

    MPI's own barrier looks for the others all the time. Where one rank compiles or draws, which
    takes seconds, that costs it a core (docs/theory/built.md).

    Args:
        comm: The ranks.
    """
    if comm.size > 1:
        here = comm.Ibarrier()
        while not here.Test():
            time.sleep(PAUSE)


def first_found[T](comm: MPI.Comm, found: T | None) -> T | None:
    """Finding of the first rank that has one, on all of them; collective.

    Args:
        comm: The ranks.
        found: Of this rank; None: nothing.
    """
    return next((each for each in comm.allgather(found) if each is not None), None)
