"""Run directories."""

from __future__ import annotations

from pathlib import Path

from mpi4py import MPI

from shellmb.errors import SceneError


def refuse_used(directory: Path, comm: MPI.Comm) -> None:
    """Never mix the files of two runs.

    Args:
        directory: A directory to be written; the first rank looks, all ranks learn.
        comm: Communicator.

    Raises:
        SceneError: If it exists and is not empty.
    """
    used = comm.bcast(directory.exists() and (not directory.is_dir() or any(directory.iterdir())))
    if used:
        raise SceneError(
            f"out is {directory}, which exists and is not empty; give another directory, or go on "
            f"with the run in it by `shellmb resume {directory}`"
        )


def make_directory(directory: Path, comm: MPI.Comm) -> None:
    """Make a directory that is there for all ranks when this returns.

    Args:
        directory: It; it may be there already.
        comm: Communicator; the call is collective.
    """
    if comm.rank == 0:
        directory.mkdir(parents=True, exist_ok=True)
    comm.Barrier()
