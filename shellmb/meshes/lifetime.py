"""Meshes that nobody uses any more are freed before communicators run out.

Each mesh has some communicators, and each function space on it: MPI has about 2000 for a process,
which are those of thirty simulations of a mechanism, and ends the program when there are no more.
A mesh of DOLFINx is freed only when Python looks for objects that hold one another, and it does so
by the number of its own objects, of which few may be left over.
"""

import gc
import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from mpi4py import MPI

# meshes that may be there without a look, and how many more after it: each has eleven to
# twenty-two communicators with what is built on it
MOST, MORE = 40, 10


class _LiveMeshes(weakref.WeakSet[Any]):
    """The meshes of this process.

    Attributes:
        most: Number of them from which on unused ones are looked for.
    """

    most = MOST


_MESHES = _LiveMeshes()


def count_in(mesh: Any) -> None:
    """Count a new mesh."""
    _MESHES.add(mesh)


def make_room(comm: MPI.Comm) -> None:
    """Free meshes that nobody uses, if there are many; collective.

    Args:
        comm: Communicator.
    """
    if comm.allreduce(len(_MESHES), op=MPI.MAX) >= _MESHES.most:
        gc.collect()
        # those that are in use are no reason to look again for each new one
        _MESHES.most = MORE + comm.allreduce(len(_MESHES), op=MPI.MAX)


def free(comm: MPI.Comm = MPI.COMM_WORLD) -> None:
    """Free the meshes and matrices that nothing refers to any more, on all ranks together."""
    gc.collect()
    comm.Barrier()


@contextmanager
def uncollected() -> Iterator[None]:
    """Python looks for no objects that hold one another: of what is made here, most live on.

    To look through forms and programs again and again is a tenth of the time in which they are
    made.
    """
    before = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if before:
            gc.enable()


def room_for(comm: MPI.Comm, count: int) -> bool:
    """Decide whether MPI has so many communicators left; collective.

    Args:
        comm: Communicator.
        count: How many.
    """
    taken: list[MPI.Comm] = []
    try:
        while len(taken) < count:
            taken.append(comm.Dup())
    except MPI.Exception:
        # there is no other way to ask
        pass
    finally:
        for each in taken:
            each.Free()
    return bool(comm.allreduce(len(taken), op=MPI.MIN) == count)
