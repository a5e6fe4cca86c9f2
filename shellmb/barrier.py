"""Meetings of ranks: waits without work, as others may need the cores, and what one found."""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mpi4py import MPI

# between two looks, s: nothing beside what is worth waiting for in this way
PAUSE = 1e-3
# how long a rank that fails waits for the others to fail, too [s]
MEETING = 8.0
# tag of the message that a rank ends
FAILED = 3011
# how long what a rank writes may take to be read: where one aborts, all that was not is lost [s]
READ = 0.2


def end_all(comm: MPI.Comm, sentence: str, code: int) -> None:
    """End all ranks, of which others may wait for this one.

    Args:
        comm: The ranks.
        sentence: Why; empty where that is written already.
        code: Exit code.
    """
    print(sentence, end="\n" if sentence else "", file=sys.stderr, flush=True)
    time.sleep(READ)
    comm.Abort(code)


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


def met(comm: MPI.Comm) -> bool:
    """Decide whether all ranks have come here, where one ends with an error.

    By messages: the others may be in any collective call, which must not be taken for this one.

    Args:
        comm: The ranks.
    """
    begin = time.monotonic()
    every = [rank for rank in range(comm.size) if rank != comm.rank]
    sent, others = [comm.isend(None, dest=rank, tag=FAILED) for rank in every], every
    while others and time.monotonic() - begin < MEETING:
        others = [rank for rank in others if not comm.iprobe(source=rank, tag=FAILED)]
        time.sleep(10 * PAUSE)
    if others:
        return False
    # nothing may be on its way when MPI ends
    for rank, request in zip(every, sent, strict=True):
        comm.recv(source=rank, tag=FAILED)
        request.wait()
    return True
