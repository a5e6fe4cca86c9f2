"""Locks between processes that end with the process, however it ends, and say who holds them."""

import fcntl
import os
import platform
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TextIO

from shellmb.files.writing import is_plain

# a file for each rank that has not let go of a temporary directory, beside it
HELD = "held-{rank}"


class FileLock:
    """A file that one process at a time holds.

    The system gives the lock of a killed process free; its file stays and means nothing.

    Args:
        path: The file; its folder exists.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file: TextIO | None = None

    def acquire(self) -> bool:
        """Take the lock, if nobody holds it; whether it is ours now.

        Raises:
            OSError: If the file cannot be made, or the file system has no locks.
        """
        with suppress(FileNotFoundError):
            if not is_plain(self._path):
                # a link, and what it points to is none of ours
                self._path.unlink(missing_ok=True)
        flags = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW
        with ExitStack() as failed:
            file = failed.enter_context(os.fdopen(os.open(self._path, flags, 0o644), "r+"))
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                return False
            if not os.fstat(file.fileno()).st_nlink:
                # whoever held it has removed it meanwhile
                return self.acquire()
            file.truncate()
            print(f"process {os.getpid()} on {platform.node()}", end="", file=file, flush=True)
            self._file = file
            failed.pop_all()
        return True

    def release(self) -> None:
        """Give the lock free and remove its file; nothing if it is not locked."""
        if self._file is None:
            return
        file, self._file = self._file, None
        # a lock that nobody holds does no harm
        with file, suppress(OSError):
            if os.path.samestat(os.fstat(file.fileno()), self._path.stat()):
                self._path.unlink()

    @property
    def owner(self) -> str:
        """Describe who holds the lock, as far as is known."""
        try:
            with self._path.open("rb") as file:
                return file.read(200).decode(errors="replace") or "another process"
        except OSError:
            return "another process"


def is_temporary(directory: Path) -> bool:
    """Decide whether a run directory is one that goes with the process that made it.

    Args:
        directory: The directory.
    """
    return (directory.parent / HELD.format(rank=0)).exists()
