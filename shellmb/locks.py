"""Locks between processes that end with the process, however it ends, and say who holds them.

They are not those of the package `filelock`: it hooks into every call of Python's `id`, of which
UFL makes many, and forms take 7 % longer to write.
"""

from __future__ import annotations

import fcntl
import os
import platform
from contextlib import suppress
from pathlib import Path

from shellmb.guarding.writing import clear, is_plain

FLAGS = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC


class FileLock:
    """A file that one process at a time holds.

    The system gives the lock of a killed process free; its file stays and means nothing.

    Args:
        path: The file; its folder exists.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._held: int | None = None

    def acquire(self, wait: bool = False) -> bool:
        """Take the lock; whether it is ours now.

        Args:
            wait: Whether to wait until the other process gives it free.

        Raises:
            OSError: If the file cannot be made, or the file system has no locks.
        """
        while True:
            with suppress(FileNotFoundError):
                if not is_plain(self._path):
                    # a link, and what it points to is none of ours
                    clear(self._path)
            file = os.open(self._path, FLAGS, 0o644)
            try:
                fcntl.flock(file, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
                if self._is(file):
                    os.ftruncate(file, 0)
                    os.pwrite(file, f"process {os.getpid()} on {platform.node()}".encode(), 0)
                    self._held = file
                    return True
            except BlockingIOError:
                return False
            finally:
                if self._held != file:
                    # also one that was removed by who held it: that lock is nobody's
                    os.close(file)

    def _is(self, file: int) -> bool:
        """Decide whether an open file is the one at our path."""
        try:
            return os.path.samestat(os.fstat(file), self._path.stat())
        except FileNotFoundError:
            return False

    def release(self) -> None:
        """Give the lock free and remove its file; nothing if it is not held."""
        if self._held is None:
            return
        file, self._held = self._held, None
        # a lock that nobody holds does no harm
        with suppress(OSError):
            if self._is(file):
                self._path.unlink()
        os.close(file)

    @property
    def owner(self) -> str:
        """Describe who holds the lock, as far as can be told."""
        try:
            with self._path.open("rb") as file:
                return file.read(200).decode(errors="replace") or "another process"
        except OSError:
            return "another process"
