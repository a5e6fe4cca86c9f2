"""Directories of runs: given ones, or temporary ones that go with what holds them."""

from __future__ import annotations

import atexit
import shutil
import tempfile
import weakref
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from shellmb.files.locks import HELD

if TYPE_CHECKING:
    from mpi4py import MPI


def path_of(given: Any) -> Path:
    """A directory that is given by its path, or by what stands for it, as a run does.

    Args:
        given: A path, or something with a `directory`.
    """
    return Path(getattr(given, "directory", given))


@dataclass(frozen=True)
class Place:
    """Directory of a run.

    Args:
        directory: It.
        comm: Communicator of the run.
        temporary: Whether it goes with what holds it.
    """

    directory: Path
    comm: MPI.Comm
    temporary: bool

    def held_by[T](self, found: T) -> T:
        """Return what was found; a temporary directory goes when no rank uses it any more.

        A run is read when it is requested, on each rank by itself: the last one removes it.

        Args:
            found: The run.
        """
        if self.temporary:
            weakref.finalize(found, _let_go, self.directory, self.comm.rank)
        return found


def placed(out: Path | str | None, comm: MPI.Comm | None) -> Place:
    """Directory of a run; collective.

    Args:
        out: As given; None: a temporary one.
        comm: Communicator; None: all ranks.
    """
    from mpi4py import MPI

    world = MPI.COMM_WORLD if comm is None else comm
    if out is not None:
        return Place(path_of(out), world, False)
    made = None
    if world.rank == 0:
        made = Path(tempfile.mkdtemp(prefix="shellmb-"))
        for rank in range(world.size):
            (made / HELD.format(rank=rank)).touch()
    directory = Path(world.bcast(made), "run")
    # also where the run fails, and nobody holds it
    atexit.register(_let_go, directory, world.rank)
    return Place(directory, world, True)


def _let_go(directory: Path, rank: int) -> None:
    """Let go of a temporary directory; without any rank that holds it, it is removed."""
    (directory.parent / HELD.format(rank=rank)).unlink(missing_ok=True)
    if not any(directory.parent.glob(HELD.format(rank="*"))):
        shutil.rmtree(directory.parent, ignore_errors=True)
