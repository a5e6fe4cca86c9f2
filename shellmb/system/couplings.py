"""Forces between unknowns that share no cell, and that come and go: what the system asks of them.

Every rank evaluates all of them, from positions that the ranks tell one another, and takes the rows
of the dofs that it owns.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Protocol

from mpi4py import MPI

import numpy as np
import numpy.typing as npt

from shellmb.arrays import Floats, Ints


@dataclass(frozen=True)
class SharedDofs:
    """Dofs in an order that all ranks agree on.

    Args:
        comm: Communicator.
        count: Number of them.
        mine: Numbers among them of those that this rank owns, shape (n,).
        local: Local dofs of these, shape (n,).
    """

    comm: MPI.Comm
    count: int
    mine: Ints
    local: Ints

    @staticmethod
    def of(comm: MPI.Comm, dofs: Ints, owned: tuple[int, int]) -> SharedDofs:
        """Dofs that are given by their global numbers.

        Args:
            comm: Communicator.
            dofs: Global numbers, the same on all ranks.
            owned: Range of those that this rank owns.
        """
        every, (first, last) = dofs.ravel(), owned
        mine = np.flatnonzero((every >= first) & (every < last))
        return SharedDofs(comm, len(every), mine, every[mine] - first)

    def shifted(self, by: int) -> SharedDofs:
        """Dofs whose local numbers are larger."""
        return SharedDofs(self.comm, self.count, self.mine, self.local + by)

    @cached_property
    def _order(self) -> tuple[Ints, Ints]:
        """Numbers of the dofs of one rank after the other, and how many each one has."""
        parts = self.comm.allgather(self.mine)
        return np.concatenate(parts), np.array([len(part) for part in parts])

    def gathered(self, own: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Values of all dofs from those of own ones, shape (count, ...); collective."""
        if self.comm.size == 1:
            return own
        order, counts = self._order
        width = int(np.prod(own.shape[1:], dtype=int))
        found = np.empty((self.count, *own.shape[1:]), dtype=own.dtype)
        self.comm.Allgatherv(np.ascontiguousarray(own), (found, (counts * width).tolist()))
        out = np.empty_like(found)
        out[order] = found
        return out

    def seen(self, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Values of all dofs from those of local ones, shape (count, ...); collective."""
        return self.gathered(values[self.local])


def joined(comm: MPI.Comm, parts: Sequence[SharedDofs]) -> SharedDofs:
    """Dofs of several lists, one after the other."""
    first = np.cumsum([0, *(part.count for part in parts)])
    none = np.zeros(0, dtype=np.int64)
    mine = [part.mine + begin for part, begin in zip(parts, first, strict=False)]
    local = np.concatenate([none, *(part.local for part in parts)])
    return SharedDofs(comm, int(first[-1]), np.concatenate([none, *mine]), local)


class Entries(NamedTuple):
    """Entries of a matrix.

    Args:
        rows: Their rows, shape (n,).
        columns: Their columns, shape (n,).
        values: They, shape (n,).
    """

    rows: Ints
    columns: Ints
    values: Floats


class Coupling(Protocol):
    """Forces between some unknowns, which may depend on others from step to step."""

    @property
    def dofs(self) -> SharedDofs:
        """Dofs that it may ever act on, local ones of all fields concatenated."""
        ...

    def residual(self) -> tuple[Ints, Floats]:
        """Numbers of its dofs and forces on them at the state that the fields hold; may repeat."""
        ...

    def jacobian(self) -> Entries:
        """Derivatives at the state that the fields hold; places may repeat."""
        ...

    def pattern(self) -> tuple[Ints, Ints]:
        """Rows and columns of all entries that there may be until it says otherwise."""
        ...


class Coupled:
    """All couplings of a system as one, whose dofs are those of one after the other.

    Args:
        comm: Communicator.
        couplings: The couplings.

    Attributes:
        dofs: Their dofs.
    """

    def __init__(self, comm: MPI.Comm, couplings: Sequence[Coupling]) -> None:
        self._couplings = couplings
        self.dofs = joined(comm, [coupling.dofs for coupling in couplings])
        self._first = np.cumsum([0, *(coupling.dofs.count for coupling in couplings)]).tolist()
        self._own = np.zeros(self.dofs.count, dtype=bool)
        self._own[self.dofs.mine] = True

    def forces(self) -> Floats:
        """Forces on all dofs; collective."""
        found = [(c.residual(), c.dofs.count) for c in self._couplings]
        return np.concatenate([np.bincount(at, by, count) for (at, by), count in found])

    def derivatives(self) -> Entries:
        """Entries in the rows of dofs that this rank owns; collective."""
        found = []
        for first, (rows, columns, values) in zip(
            self._first, (c.jacobian() for c in self._couplings), strict=False
        ):
            own = slice(None) if self._own.all() else self._own[first + rows]
            found.append((first + rows[own], first + columns[own], values[own]))
        return Entries(*(np.concatenate(some) for some in zip(*found, strict=True)))

    def times(self, entries: Entries, local: Floats) -> Floats:
        """Multiply what `derivatives` gave with a vector, local dofs with local dofs; collective.

        Args:
            entries: The derivatives.
            local: One number for each local dof of all fields.
        """
        dofs = self.dofs
        by_entry = entries.values * dofs.seen(local)[entries.columns]
        found = np.bincount(entries.rows, by_entry, dofs.count)
        return np.bincount(dofs.local, found[dofs.mine], len(local))

    def pattern(self) -> tuple[Ints, Ints]:
        """Places of all entries that there may be in these rows."""
        found = [
            (first + rows, first + columns)
            for first, (rows, columns) in zip(
                self._first, (c.pattern() for c in self._couplings), strict=False
            )
        ]
        rows, columns = (np.concatenate(some) for some in zip(*found, strict=True))
        own = self._own[rows]
        return rows[own], columns[own]


class MatrixPlaces(NamedTuple):
    """Rows or columns of a reduced matrix that local dofs are combinations of.

    Args:
        numbers: Their numbers in the matrix, -1: none, shape (local dofs, n).
        values: Their shares at the current state, shape (local dofs, n or more).
    """

    numbers: Ints
    values: Floats


class CoupledEntries:
    """Entries of couplings in a reduced matrix.

    Args:
        coupled: The couplings.
        rows: Rows in the matrix of the equations of local dofs.
        columns: Columns of local dofs.
    """

    def __init__(self, coupled: Coupled, rows: MatrixPlaces, columns: MatrixPlaces) -> None:
        self._coupled, self._combined = coupled, (rows, columns)
        self._numbers = [coupled.dofs.seen(of.numbers) for of in self._combined]
        places = [(i, j) for _, _, _, i, j in self._in_matrix(*coupled.pattern())]
        self.rows, self.columns = (np.concatenate(some) for some in zip(*places, strict=True))

    def _in_matrix(self, rows: Ints, columns: Ints) -> Iterator[tuple[int, int, Ints, Any, Any]]:
        """Entries that are in the matrix by parts of their dofs, with their rows and columns."""
        in_rows, in_columns = self._numbers
        for p in range(in_rows.shape[1]):
            row = in_rows[rows, p]
            for q in range(in_columns.shape[1]):
                column = in_columns[columns, q]
                here = np.flatnonzero((row >= 0) & (column >= 0))
                yield p, q, here, row[here].astype(np.int32), column[here].astype(np.int32)

    def at(self, given: Floats, load: Floats) -> Entries:
        """All entries; places may repeat; collective.

        Args:
            given: Given changes of the local dofs.
            load: Gets their forces, on the local dofs.
        """
        found, dofs = self._coupled.derivatives(), self._coupled.dofs
        by_row, by_column = (
            dofs.seen(of.values[:, : of.numbers.shape[1]]) for of in self._combined
        )
        entries = []
        for p, q, here, row, column in self._in_matrix(found.rows, found.columns):
            shares = by_row[found.rows[here], p] * by_column[found.columns[here], q]
            entries.append((row, column, shares * found.values[here]))
        load -= self._coupled.times(found, given)
        return Entries(*(np.concatenate(some) for some in zip(*entries, strict=True)))
