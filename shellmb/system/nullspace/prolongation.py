"""Unknowns as combinations of few reduced ones: matrices with a fixed number of entries a row."""

from __future__ import annotations

from mpi4py import MPI

import numpy as np
import numpy.typing as npt

from shellmb.system.assembly import native
from shellmb.system.nullspace.ghosts import Numbers

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


class RowMap:
    """A sparse matrix by rows, one for each local dof.

    Args:
        comm: Communicator.
        columns: Number of the column of each entry, -1 behind the last, shape (local dofs, width).
        owned: Count of the columns that this rank owns.

    Attributes:
        values: Entries, shape of `columns`.
    """

    def __init__(self, comm: MPI.Comm, columns: Ints, owned: int) -> None:
        self.columns = columns
        self.values = np.zeros(columns.shape)
        seen = np.unique(columns[columns >= 0])
        self.numbers = Numbers(comm, owned, seen)
        # place of each entry among the columns that this rank sees; what is none is the last one
        places = np.where(columns >= 0, np.searchsorted(seen, columns), len(seen))
        self.places = np.ascontiguousarray(places, dtype=np.int64)
        self._lib = native.cells().lib
        self._pointers = (native.doubles(self.values), native.longs(self.places))

    def seen(self, x: Floats) -> Floats:
        """Values of the columns that this rank sees from those of the columns that it owns."""
        return self.numbers.seen(x)

    def times(self, seen: Floats) -> Floats:
        """Product with what `seen` gives: values of all local dofs."""
        padded, out = np.append(seen, 0.0), np.empty(len(self.values))
        pointers = (*self._pointers, native.doubles(padded), native.doubles(out))
        self._lib.combine(*self.values.shape, *pointers)
        return out

    def transposed(self, b: Floats, rows: Ints) -> Floats:
        """Product of the transposed matrix with some rows' values: those of the owned columns.

        Args:
            b: Values, shape (m,).
            rows: Their local dofs, shape (m,); each unknown once over all ranks.
        """
        sums = np.zeros(len(self.numbers.wanted) + 1)
        b = np.ascontiguousarray(b)
        pointers = (*self._pointers, native.longs(rows), native.doubles(b), native.doubles(sums))
        self._lib.distribute(len(rows), self.values.shape[1], *pointers)
        return self.numbers.summed(sums[:-1])
