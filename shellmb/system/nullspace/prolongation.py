"""Unknowns as combinations of few reduced ones: matrices with a fixed number of entries a row."""

from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.native import library as native
from shellmb.system.assembly.numbering import Numbers


class RowMap:
    """A sparse matrix by rows, one for each local dof.

    Args:
        comm: Communicator.
        columns: Number of the column of each entry, -1 behind the last, shape (local dofs, width).
        owned: Count of the columns that this rank owns.
        own: A local dof of each unknown that this rank owns.

    Attributes:
        values: Entries, shape of `columns`.
        there: How many columns this rank sees.
        places: Place of each among these; what is none is behind them.
        members: The matrix for C.
    """

    def __init__(self, comm: MPI.Comm, columns: Ints, owned: int, own: Ints) -> None:
        self.values = np.zeros(columns.shape)
        seen = np.unique(columns[columns >= 0])
        self.numbers = Numbers(comm, owned, seen)
        places = np.where(columns >= 0, np.searchsorted(seen, columns), len(seen))
        self.places, self.there = places.astype(np.int32), len(seen)
        self._lib, self._pointer = native.cells().lib, native.CArrays()
        local = self._entries(every := np.arange(len(columns)))
        self.members = {
            "rows": len(columns),
            "columns": self.there,
            "values": self._pointer(self.values),
            "local": local,
            "own": local if np.array_equal(own, every) else self._entries(own),
        }
        self._struct = self._pointer.many("Rows", [self.members])

    def _entries(self, rows: Ints) -> dict[str, Any]:
        """Entries that there are in some of the rows, by their number among them."""
        row, k = np.nonzero(self.places[rows] < self.there)
        at = rows[row] * self.places.shape[1] + k
        lists = {"row": row, "column": self.places[rows[row], k], "at": at}
        pointers = {name: self._pointer(a.astype(np.int32)) for name, a in lists.items()}
        return {"count": len(row), **pointers}

    def seen(self, x: Floats) -> Floats:
        """Values of the columns that this rank sees from those of the columns that it owns."""
        return self.numbers.seen(x)

    def times(self, seen: Floats) -> Floats:
        """Product with what `seen` gives: values of all local dofs."""
        out = np.empty(len(self.values))
        self._lib.combine(self._struct, *map(native.doubles, (seen, out)))
        return out

    def transposed(self, b: Floats) -> Floats:
        """Product of the transposed matrix with values of unknowns: those of the owned columns.

        Args:
            b: Values of the unknowns that this rank owns.
        """
        sums = np.empty(len(self.numbers.wanted))
        self._lib.distribute(self._struct, *map(native.doubles, (b, sums)))
        return self.numbers.summed(sums)
