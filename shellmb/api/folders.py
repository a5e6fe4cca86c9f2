"""Directories of runs: where one asked for them, or temporary ones that go with what holds them."""

from __future__ import annotations

import atexit
import shutil
import tempfile
import weakref
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mpi4py import MPI


def place(out: Path | str | None, comm: MPI.Comm) -> tuple[Path, bool]:
    """Directory of a run, and whether it is a temporary one; collective.

    Args:
        out: As given.
        comm: Communicator.
    """
    if out is not None:
        return Path(out), False
    made = tempfile.mkdtemp(prefix="shellmb-") if comm.rank == 0 else None
    directory = Path(comm.bcast(made))
    # also where the run fails, and nobody holds it
    if comm.rank == 0:
        atexit.register(shutil.rmtree, directory, ignore_errors=True)
    return directory, True


def gone_with(owner: object, directory: Path, rank: int) -> None:
    """Remove a directory when its run is not used any more.

    Args:
        owner: The run.
        directory: Its directory.
        rank: That of this process; the first one removes.
    """
    if rank == 0:
        weakref.finalize(owner, shutil.rmtree, directory, ignore_errors=True)
