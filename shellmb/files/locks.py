"""Locks between processes that end with the process, however it ends, and say who holds them."""

import os
import platform
from contextlib import suppress
from pathlib import Path

import filelock

from shellmb.files.writing import clear, is_plain

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
        self._file: os.stat_result | None = None
        self._lock = filelock.FileLock(
            path, mode=0o644, fallback_to_soft=False, on_acquired=self._sign
        )

    def _sign(self, file: int) -> None:
        """Write into the locked file whose it is."""
        self._file = os.fstat(file)
        os.ftruncate(file, 0)
        os.pwrite(file, f"process {os.getpid()} on {platform.node()}".encode(), 0)

    def acquire(self) -> bool:
        """Take the lock, if nobody holds it; whether it is ours now.

        Raises:
            OSError: If the file cannot be made, or the file system has no locks.
        """
        with suppress(FileNotFoundError):
            if not is_plain(self._path):
                # a link, and what it points to is none of ours
                clear(self._path)
        try:
            self._lock.acquire(blocking=False)
        except filelock.Timeout:
            return False
        return True

    def release(self) -> None:
        """Give the lock free and remove its file; nothing if it is not locked."""
        if self._file is None:
            return
        file, self._file = self._file, None
        # a lock that nobody holds does no harm
        with suppress(OSError):
            if os.path.samestat(file, self._path.stat()):
                self._path.unlink()
        self._lock.release()

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
