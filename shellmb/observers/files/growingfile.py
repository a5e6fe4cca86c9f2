"""A text file that grows by lines, and when to add them."""

import errno
import os
import time as clock
from collections.abc import Sequence
from pathlib import Path
from typing import BinaryIO

from shellmb.files.writing import open_new

# wall time whose results a killed process may lose, s
BATCH = 0.2


class GrowingFile:
    """Lines behind a head; complete after each addition.

    Args:
        path: The file; what it held is lost when the first lines are added.
        head: The first line.
    """

    def __init__(self, path: Path, head: str) -> None:
        self._path, self._head = path, head
        self._file: BinaryIO | None = None
        # lines behind the head, and bytes: noted together
        self._written = (0, 0)

    @property
    def count(self) -> int:
        """Number of lines behind the head."""
        return self._written[0]

    def add(self, lines: Sequence[str]) -> None:
        """Write lines behind those that are there.

        Args:
            lines: At least one.
        """
        if self._file is None:
            self._file = open_new(self._path)
        elif os.fstat(self._file.fileno()).st_nlink == 0:
            # it would take what nobody finds again
            raise FileNotFoundError(errno.ENOENT, "it was removed during the run", str(self._path))
        count, size = self._written
        text = "".join(f"{line}\n" for line in (lines if count else (self._head, *lines))).encode()
        # at its place: Ctrl-C may come between this and the note of it
        self._file.seek(size)
        self._file.write(text)
        self._file.flush()
        self._written = (count + len(lines), size + len(text))

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()


class Batches:
    """Says when to write what has been collected.

    Writing is cheap in a row, and dear between the steps of a simulation, whose numbers take its
    place in the processor's caches. Long steps are written one by one. What is collected has to be
    written before a state that counts on it, and at the end of the run, however it ends.
    """

    def __init__(self) -> None:
        self._written = -BATCH

    def due(self) -> bool:
        """Decide whether it is time to write."""
        return clock.perf_counter() - self._written > BATCH

    def written(self) -> None:
        """All that was collected is written."""
        self._written = clock.perf_counter()
