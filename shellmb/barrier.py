"""Waiting for other ranks without work: what they wait for may need the cores."""

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
