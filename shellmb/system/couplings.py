"""Forces between unknowns that share no cell, and that come and go: what the system asks of them.

Their entries are listed by local dofs of all fields, concatenated as everywhere; they are for one
process.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from shellmb.arrays import Floats, Int32s, Ints


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
    def dofs(self) -> Ints:
        """Local dofs that it may ever act on."""
        ...

    def residual(self) -> tuple[Ints, Floats]:
        """Local dofs and forces on them at the state that the fields hold; dofs may repeat."""
        ...

    def jacobian(self) -> Entries:
        """Derivatives at the state that the fields hold; places may repeat."""
        ...

    def pattern(self) -> tuple[Ints, Ints]:
        """Rows and columns of all entries that there may be until it says otherwise."""
        ...


def forces(couplings: Sequence[Coupling], unknown: Ints, count: int) -> Floats:
    """Forces of couplings on all unknowns.

    Args:
        couplings: They.
        unknown: Number of the unknown of each local dof.
        count: Number of unknowns.
    """
    total = np.zeros(count)
    for coupling in couplings:
        dofs, values = coupling.residual()
        total += np.bincount(unknown[dofs], values, count)
    return total


def derivatives(couplings: Sequence[Coupling]) -> Entries:
    """Entries of all couplings."""
    none = Entries(*(np.zeros(0, dtype=np.int64),) * 2, np.zeros(0))
    found = [none, *(coupling.jacobian() for coupling in couplings)]
    return Entries(*(np.concatenate(some) for some in zip(*found, strict=True)))


class Combined(Protocol):
    """Rows or columns of a reduced matrix that local dofs are combinations of."""

    @property
    def numbers(self) -> Ints:
        """Their numbers, -1: none, shape (local dofs, n)."""
        ...

    @property
    def values(self) -> Floats:
        """Their shares at the current state, shape (local dofs, n or more)."""
        ...


class CoupledEntries:
    """Entries of couplings in a reduced matrix of one process.

    Args:
        couplings: The couplings.
        rows: Rows in the matrix of the equations of local dofs.
        columns: Columns of local dofs.
    """

    def __init__(self, couplings: Sequence[Coupling], rows: Combined, columns: Combined) -> None:
        self._couplings, self._rows, self._columns = couplings, rows, columns
        none = np.zeros(0, dtype=np.int64)
        found = [(none, none), *(coupling.pattern() for coupling in couplings)]
        row, column = (np.concatenate(some) for some in zip(*found, strict=True))
        places = [(i, j) for _, _, _, i, j in self._in_matrix(row, column)]
        self.rows, self.columns = (np.concatenate(some) for some in zip(*places, strict=True))

    def _in_matrix(self, rows: Ints, columns: Ints) -> Iterator[tuple[int, int, Ints, Any, Any]]:
        """Entries that are in the matrix by parts of their dofs, with their rows and columns."""
        for p in range(self._rows.numbers.shape[1]):
            row = self._rows.numbers[rows, p]
            for q in range(self._columns.numbers.shape[1]):
                column = self._columns.numbers[columns, q]
                here = np.flatnonzero((row >= 0) & (column >= 0))
                yield p, q, here, row[here].astype(np.int32), column[here].astype(np.int32)

    def add_to(self, matrix: Adding, given: Floats, load: Floats) -> None:
        """Add all entries.

        Args:
            matrix: Takes them.
            given: Given changes of the local dofs.
            load: Gets their forces, on the local dofs.
        """
        found = derivatives(self._couplings)
        entries = []
        for p, q, here, row, column in self._in_matrix(found.rows, found.columns):
            shares = self._rows.values[found.rows[here], p]
            shares = shares * self._columns.values[found.columns[here], q]
            entries.append((row, column, shares * found.values[here]))
        matrix.add(*(np.concatenate(some) for some in zip(*entries, strict=True)))
        forced = found.values * given[found.columns]
        load -= np.bincount(found.rows, forced, len(load))


class Adding(Protocol):
    """A matrix to which entries are added."""

    def add(self, rows: Int32s, columns: Int32s, values: Floats) -> None:
        """Add entries whose places it has; places may repeat."""
        ...
