"""Nonzero entries of cells' matrices, and their places in the whole matrix."""

import numpy as np

from shellmb.arrays import Bools, Int32s

# cells at a time when the pattern is looked for: their matrices are kept meanwhile
CHUNK = 64


class Lists:
    """Entries of the matrices of cells that are not always zero; cells may have the same.

    Attributes:
        of_cell: Number of the list of each cell so far.
        entries: The lists.
    """

    def __init__(self) -> None:
        self.of_cell: list[int] = []
        self.entries: list[Int32s] = []
        self._known: dict[bytes, int] = {}

    def add(self, found: Bools) -> None:
        """Add cells.

        Args:
            found: Whether each entry of each cell is one, shape (cells, n).
        """
        for row in found:
            number = self._known.setdefault(np.packbits(row).tobytes(), len(self.entries))
            if number == len(self.entries):
                self.entries.append(np.flatnonzero(row).astype(np.int32))
            self.of_cell.append(number)

    def of(self, first: int, last: int) -> list[Int32s]:
        """Lists of some cells, one after the other."""
        return [self.entries[k] for k in self.of_cell[first:last]]


def find_runs(lists: Lists, places: Int32s, first: Bools) -> tuple[Int32s, Int32s]:
    """Entries that follow one another both in a cell's matrix and in the whole one.

    One number for many entries takes less memory than one for each, and a loop over neighbours
    less time. Nor does the whole matrix have to be set to zero before entries are added: what is
    the first to come to its place is put there.

    Args:
        lists: Entries of all cells.
        places: Place of each in the whole matrix.
        first: Whether it is the first that comes there.

    Returns:
        Runs (place in the cell's matrix, place in the whole one, length), shape (r, 3): of each
        cell those that are first, then the others. And where each of these two begins, and the
        last one ends, shape (2 cells + 1,).
    """
    runs, counts, begin = [np.zeros((0, 3), dtype=np.int32)], [np.zeros(1, dtype=np.int64)], 0
    for cell in range(0, len(lists.of_cell), CHUNK):
        entries = lists.of(cell, cell + CHUNK)
        sizes = [len(e) for e in entries]
        end = begin + sum(sizes)
        group = 2 * np.repeat(np.arange(len(entries)), sizes) + ~first[begin:end]
        order = np.argsort(group, kind="stable")
        found = np.stack([np.concatenate(entries), places[begin:end], group], axis=1)[order]
        new = np.ones(len(found), dtype=bool)
        new[1:] = np.any(np.diff(found, axis=0) != (1, 1, 0), axis=1)
        starts = np.flatnonzero(new)
        lengths = np.diff(starts, append=len(found))
        runs.append(np.column_stack([found[starts, :2], lengths]).astype(np.int32))
        counts.append(np.bincount(found[starts, 2], minlength=2 * len(entries)))
        begin = end
    offsets = np.cumsum(np.concatenate(counts))
    return np.ascontiguousarray(np.concatenate(runs)), offsets.astype(np.int32)
