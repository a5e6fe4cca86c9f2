"""Run directories."""

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from mpi4py import MPI

from shellmb.errors import RunError, SceneError
from shellmb.files.locks import FileLock
from shellmb.running.error_origin import user_frame

# name in a run directory
LOCK = "lock"
# what a system says when it does not let a file be written
KINDS = "EACCES EDQUOT EFBIG EIO ENOENT ENOSPC EPERM EROFS".split()
REFUSALS = {getattr(errno, kind) for kind in KINDS}


def refuse_used(directory: Path, comm: MPI.Comm) -> None:
    """Never mix the files of two runs.

    Args:
        directory: A directory to be written; the first rank looks, all ranks learn.
        comm: Communicator.

    Raises:
        SceneError: If it exists and is not empty.
    """
    if comm.bcast(_is_used(directory)):
        raise SceneError(
            f"out is {directory}, which exists and is not empty; give another directory, or go on "
            f"with the run in it by `shellmb resume {directory}`"
        )


def _link(directory: Path) -> str | None:
    """A folder anywhere in a run directory that is a link to another one."""
    for place, folders, _ in os.walk(directory):
        for path in (Path(place, name) for name in folders):
            if path.is_symlink():
                return str(path.relative_to(directory))
    return None


def _is_used(directory: Path) -> bool:
    # of a name that no directory can have Path asks in vain
    if not os.path.isdir(directory):
        return os.path.exists(directory)
    return any(path.name != LOCK for path in directory.iterdir())


@contextmanager
def claimed(directory: Path, comm: MPI.Comm, new: bool) -> Iterator[None]:
    """A run directory that only this run writes, there for all ranks, until the run ends.

    Args:
        directory: It; made where it is not there, and removed again where nothing was written.
        comm: Communicator; the call is collective.
        new: Whether it has to be empty.

    Raises:
        SceneError: If it cannot be written, is of another run, or another run is writing it.
    """
    if os.path.realpath(directory) == Path(os.path.realpath(directory)).anchor:
        raise SceneError(
            f"out is {directory}, the root of all files; give a directory of the run's own"
        )
    lock = FileLock(directory / LOCK)
    missing = [path for path in (directory, *directory.parents) if not os.path.exists(path)]
    wrong = None
    if comm.rank == 0:
        try:
            directory.mkdir(parents=True, exist_ok=True)
            if not lock.acquire():
                wrong = (
                    f"out is {directory}, in which another run is writing ({lock.owner}); wait "
                    "for its end, or give another directory"
                )
            elif (link := _link(directory)) is not None:
                wrong = (
                    f"out is {directory}, in which {link} is a link, and files would be written "
                    "where it points to; put a folder there"
                )
        except FileExistsError:
            wrong = f"out is {directory}, which is no directory; give another name"
        except OSError as error:
            wrong = f"out is {directory}, which cannot be written ({error.strerror}); give another"
    wrong = comm.bcast(wrong)
    if wrong is not None:
        lock.release()
        raise SceneError(wrong)
    try:
        if new:
            refuse_used(directory, comm)
        yield
    finally:
        lock.release()
        if comm.rank == 0:
            _remove_empty(missing)


@contextmanager
def written(directory: Path | None, comm: MPI.Comm) -> Iterator[None]:
    """Context in which files of a run are written: what the system refuses ends it with a sentence.

    Args:
        directory: The run directory, if there is one.
        comm: Communicator of the run.

    Raises:
        RunError: If there is no space left, or something else of the kind.
    """
    try:
        yield
    except OSError as error:
        if directory is None or error.errno not in REFUSALS or user_frame(error) is not None:
            raise
        raise RunError(
            f"{directory} cannot be written ({error.strerror}); the last state written is "
            "complete: free disk space, and `shellmb resume` continues from it",
            alone=comm.size > 1,
        ) from error


def _remove_empty(made: list[Path]) -> None:
    for path in made:
        if not path.is_dir() or any(path.iterdir()):
            return
        path.rmdir()
