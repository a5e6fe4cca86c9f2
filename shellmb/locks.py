"""Locks between processes that end with the process, however it ends."""

from __future__ import annotations

import fcntl
import os
import platform
from contextlib import suppress
from pathlib import Path

from shellmb.guarding.writing import clear, is_plain


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
            flags = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC
            file = os.open(self._path, flags, 0o644)
            try:
                fcntl.flock(file, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
                if not self._is(file):
                    # who had it removed the file: the lock on it is nobody's
                    os.close(file)
                    continue
                os.ftruncate(file, 0)
                os.pwrite(file, f"process {os.getpid()} on {platform.node()}".encode(), 0)
            except BlockingIOError:
                os.close(file)
                return False
            except BaseException:
                os.close(file)
                raise
            self._held = file
            return True

    def _is(self, file: int) -> bool:
        try:
            return os.path.samestat(os.fstat(file), self._path.stat())
        except FileNotFoundError:
            return False

    def release(self) -> None:
        """Give the lock free and remove its file; nothing if it is not held."""
        if self._held is None:
            return
        file, self._held = self._held, None
        try:
            if self._is(file):
                self._path.unlink()
        except OSError:
            # a lock that nobody holds does no harm
            pass
        finally:
            os.close(file)

    @property
    def owner(self) -> str:
        """Who holds it, as far as can be told."""
        try:
            with self._path.open("rb") as file:
                return file.read(200).decode(errors="replace") or "another process"
        except OSError:
            return "another process"
