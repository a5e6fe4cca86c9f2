"""Directories of runs: given ones, or temporary ones that go with what holds them."""

from __future__ import annotations

import atexit
import shutil
import tempfile
import weakref
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


def place(out: Path | str | None, comm: MPI.Comm) -> tuple[Path, bool]:
    """Directory of a run, and whether it is a temporary one; collective.

    Args:
        out: As given.
        comm: Communicator.
    """
    if out is not None:
        return path_of(out), False
    made = None
    if comm.rank == 0:
        made = Path(tempfile.mkdtemp(prefix="shellmb-"))
        for rank in range(comm.size):
            (made / HELD.format(rank=rank)).touch()
    directory = Path(comm.bcast(made), "run")
    # also where the run fails, and nobody holds it
    atexit.register(_let_go, directory, comm.rank)
    return directory, True


def gone_with(owner: object, directory: Path, rank: int) -> None:
    """Remove a temporary directory when no rank uses its run any more.

    A run is read when it is requested, on each rank by itself: the last one removes it.

    Args:
        owner: The run.
        directory: Its directory.
        rank: That of this process.
    """
    weakref.finalize(owner, _let_go, directory, rank)


def _let_go(directory: Path, rank: int) -> None:
    """Let go of a temporary directory; without any rank that holds it, it is removed."""
    (directory.parent / HELD.format(rank=rank)).unlink(missing_ok=True)
    if not any(directory.parent.glob(HELD.format(rank="*"))):
        shutil.rmtree(directory.parent, ignore_errors=True)
