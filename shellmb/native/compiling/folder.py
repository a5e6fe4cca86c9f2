"""Folder of the library of loops, and what fails there or on the rank that compiles."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from shellmb.barrier import arrive
from shellmb.errors import RunError

# the installation is here without MPI
if TYPE_CHECKING:
    from mpi4py import MPI

SAY = "name another folder by the environment variable XDG_CACHE_HOME"


def cache_folder() -> Path:
    """Folder for what is compiled at first use, in `$XDG_CACHE_HOME` or `~/.cache`; it is made.

    Raises:
        RunError: If it cannot be made, or others can write it, whose programs we would execute.
    """
    given = os.environ.get("XDG_CACHE_HOME", "")
    # relative ones mean nothing, says the XDG Base Directory Specification
    root = Path(given) if os.path.isabs(given) else Path(os.path.expanduser("~"), ".cache")
    folder = root / "shellmb"
    with writing(folder):
        root.mkdir(mode=0o700, parents=True, exist_ok=True)
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.stat()
    others = status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    if others or status.st_uid not in (os.getuid(), 0):
        raise RunError(
            f"the cache of loops, {folder}, is not used: other users can write it, and put "
            f"programs there; remove that permission (chmod go-w), or {SAY}"
        )
    return folder


@contextmanager
def writing(folder: Path) -> Iterator[None]:
    """Error of the system when the loops cannot be written, as a sentence.

    Args:
        folder: The cache.

    Raises:
        RunError: If they cannot be.
    """
    try:
        yield
    except OSError as error:
        raise RunError(
            f"the compiled loops cannot be written to {folder} ({error.strerror or error}); make "
            f"room, or {SAY}"
        ) from error


def raise_together(failure: Exception | None, what: str, comm: MPI.Comm) -> None:
    """Raise on all ranks what failed on the first one.

    Args:
        failure: On the first rank: a compiler's is told as it is; None elsewhere, or for none.
        what: What could not be done.
        comm: The ranks.

    Raises:
        RunError: If the C compiler failed.
        RuntimeError: If something else did.
    """
    said = failure if failure is None or isinstance(failure, RunError) else RuntimeError(what)
    arrive(comm)
    if (told := comm.bcast(said)) is not None:
        raise told from (None if told is failure else failure)
