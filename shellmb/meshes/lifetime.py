"""Meshes that nobody uses any more are freed before communicators run out.

Each mesh has some communicators, and each function space on it: MPI has about 2000 for a process,
which are those of thirty simulations of a mechanism, and ends the program when there are no more.
A mesh of DOLFINx is freed only when Python looks for objects that hold one another, and it does so
by the number of its own objects, of which few may be left over. Results that a user keeps hold the
simulations that computed them: the oldest ones let go of theirs.
"""

import gc
import weakref
from collections.abc import Iterator, Sized
from contextlib import contextmanager
from typing import Any

from mpi4py import MPI

from shellmb.errors import RunError

# meshes that may be there without a look, and how many more after it
MOST, MORE = 40, 10
# communicators of a mesh with what is built on it: eleven to twenty-two are there together
EACH = 14


class _LiveMeshes(weakref.WeakSet[Any]):
    """The meshes of this process.

    Attributes:
        most: Number of them from which on unused ones are looked for.
    """

    most = MOST


_MESHES = _LiveMeshes()
# results that let go of what computed them by their method `release`, the oldest one first
_HOLDERS = list[weakref.ref[Any]]()


def count_in(mesh: Any) -> None:
    """Count a new mesh."""
    _MESHES.add(mesh)


def count_holder(result: Any) -> None:
    """Count a result that holds what computed it, until its method `release` is called."""
    _HOLDERS.append(weakref.ref(result))


def make_room(comm: MPI.Comm, bodies: int = 1) -> None:
    """Free meshes that nobody uses, if there are many, and then those of old results; collective.

    Args:
        comm: Communicator.
        bodies: Number of meshes that will be made.

    Raises:
        RunError: If what is in use leaves too few communicators.
    """
    if _most(comm, _MESHES) < _MESHES.most:
        return
    gc.collect()
    while _most(comm, _MESHES) >= MOST and _most(comm, _HOLDERS):
        oldest = _HOLDERS.pop(0)() if _HOLDERS else None
        if oldest is not None:
            oldest.release()
            gc.collect()
    # those that are in use are no reason to look again for each new one
    used = _most(comm, _MESHES)
    _MESHES.most = MORE + used
    if used and not room_for(comm, EACH * bodies):
        raise RunError(
            f"MPI has about 2000 communicators for a program, and simulations with {used} meshes "
            f"are in use: too few are left for one of {bodies}; delete motions and matrices "
            "that are not needed any more"
        )


def _most(comm: MPI.Comm, items: Sized) -> int:
    return int(comm.allreduce(len(items), op=MPI.MAX))


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
