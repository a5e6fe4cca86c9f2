"""Meetings of ranks: waits without work, as others may need the cores, and what one found."""

from __future__ import annotations

import sys
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from shellmb.errors import ShellmbError

if TYPE_CHECKING:
    from mpi4py import MPI

# between two looks, s: nothing beside what is worth waiting for in this way
PAUSE = 1e-3
# how long a rank that fails waits for the others to fail, too [s]
MEETING = 8.0
# tag of the message that a rank ends
FAILED = 3011


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
    for rank in every:
        comm.recv(source=rank, tag=FAILED)
    for request in sent:
        request.wait()
    return True


@contextmanager
def failing_together(comm: MPI.Comm) -> Iterator[None]:
    """Context in which an error that one rank has alone ends all: the others would wait for ever.

    Our own errors are those of all ranks, if they do not say that they may be of one, and others
    may be.

    Args:
        comm: The ranks.
    """
    try:
        yield
    except Exception as error:
        shared = isinstance(error, ShellmbError) and not getattr(error, "alone", False)
        if comm.size > 1 and not shared and not met(comm):
            if not isinstance(error, ShellmbError | OSError):
                traceback.print_exc()
            said = f"error: rank {comm.rank} fails alone, and all ranks end with it: {error}"
            print(said, file=sys.stderr, flush=True)
            comm.Abort(1)
        raise
