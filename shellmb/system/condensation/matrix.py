"""The reduced matrix: where the entries of cells go."""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Floats, Int32s, Ints
from shellmb.system.condensation.meshreduction import MeshReduction
from shellmb.system.couplings import CoupledEntries
from shellmb.system.nullspace.numbers import ReducedNumbers


class Pattern(NamedTuple):
    """Entries of a matrix, as its parts give them.

    Args:
        owned: Number of rows of this rank.
        rows: Rows of the entries of each part, then of couplings, those of the diagonal last.
        columns: Their columns.
    """

    owned: int
    rows: list[Int32s]
    columns: list[Int32s]

    def ends(self) -> list[int]:
        """Places where the entries of each part begin, and where those of the last one end."""
        return [0, *itertools.accumulate(len(rows) for rows in self.rows)]


class CooMatrix:
    """Entries go to a list, and PETSc adds them up on the ranks that own them.

    Args:
        comm: Communicator.
        pattern: Its entries.
        parts: Reductions of all meshes.

    Attributes:
        A: The matrix.
        targets: What the parts fill, in their order.
        values: Its entries, where one process has all of them.
    """

    def __init__(self, comm: MPI.Comm, pattern: Pattern, parts: Sequence[MeshReduction]) -> None:
        sizes = (pattern.owned, PETSc.DETERMINE)
        self.values: Floats | None = None
        self.A = PETSc.Mat().createAIJ((sizes, sizes), comm=comm)
        self.A.setPreallocationCOO(
            *(np.concatenate(n).astype(PETSc.IntType, copy=False) for n in pattern[1:])
        )
        ends = pattern.ends()
        self._listed = np.zeros(ends[-1])
        self.targets = [self._listed[a:b] for a, b in itertools.pairwise(ends)][: len(parts)]
        # entries of couplings, and where each of their places is listed first
        self._coupled = self._listed[ends[len(parts)] : ends[-2]]
        self._columns = int(self.A.getSize()[1])
        keys = [self._keys(*some) for some in list(zip(*pattern[1:], strict=True))[len(parts) : -1]]
        self._places = np.unique(np.concatenate([*keys, np.zeros(0, np.int64)]), return_index=True)
        for part, own in zip(parts, self.targets, strict=True):
            # entries in their order
            part.add_at(np.arange(len(own), dtype=np.int32), np.ones(len(own), dtype=bool))

    def end(self) -> None:
        """Add them up."""
        self.A.setValuesCOO(self._listed)

    def _keys(self, rows: Ints | Int32s, columns: Ints | Int32s) -> Ints:
        return rows.astype(np.int64) * self._columns + columns

    def add(self, rows: Ints, columns: Ints, values: Floats) -> None:
        """Add entries of couplings.

        Raises:
            IndexError: If the matrix has no place for one.
        """
        known, first = self._places
        places = first[_found(known, self._keys(rows, columns))]
        self._coupled[:] = np.bincount(places, values, len(self._coupled))


class CsrMatrix:
    """Entries are added at once to the values that PETSc works with, in one process.

    Args:
        comm: Communicator.
        pattern: Its entries.
        parts: Reductions of all meshes; they get the places of their entries.
    """

    def __init__(self, comm: MPI.Comm, pattern: Pattern, parts: Sequence[MeshReduction]) -> None:
        owned, rows, columns = pattern
        keys = np.concatenate(
            [r.astype(np.int64) * owned + c for r, c in zip(rows, columns, strict=True)]
        )
        # stable: the entries of a cell come in runs, which that sort merges
        order = np.argsort(keys, kind="stable")
        keys = keys[order]
        new = np.ones(len(keys), dtype=bool)
        new[1:] = keys[1:] != keys[:-1]
        places = np.empty(len(keys), dtype=np.int32)
        places[order] = np.cumsum(new, dtype=np.int32) - np.int32(1)
        first = np.empty_like(new)
        first[order] = new
        keys = keys[new]
        starts = np.searchsorted(keys, owned * np.arange(owned + 1)).astype(PETSc.IntType)
        self.values: Floats | None = np.zeros(len(keys))
        self.A = PETSc.Mat().createAIJWithArrays(
            (owned, owned), (starts, (keys % owned).astype(PETSc.IntType), self.values), comm=comm
        )
        for part, (a, b) in zip(parts, itertools.pairwise(pattern.ends()), strict=False):
            part.add_at(places[a:b], first[a:b])
        self.targets = [self.values] * len(parts)
        # only couplings look for places
        self._owned, self._keys = owned, keys if len(rows) > len(parts) + 1 else keys[:0].copy()
        # what is in no part is put nowhere before couplings are added to it
        self._lonely = places[pattern.ends()[len(parts)] :][first[pattern.ends()[len(parts)] :]]

    def end(self) -> None:
        """Tell PETSc."""
        self.A.stateIncrease()

    def add(self, rows: Ints, columns: Ints, values: Floats) -> None:
        """Add entries of couplings.

        Raises:
            IndexError: If the matrix has no place for one.
        """
        assert self.values is not None
        self.values[self._lonely] = 0.0
        places = _found(self._keys, rows.astype(np.int64) * self._owned + columns)
        self.values += np.bincount(places, values, len(self.values))


ReducedMatrix = CsrMatrix | CooMatrix


def reduced_matrix(
    numbers: ReducedNumbers, parts: Sequence[MeshReduction], coupled: CoupledEntries | None
) -> ReducedMatrix:
    """A matrix with the entries of all parts and a full diagonal: multipliers of joints have none.

    Args:
        numbers: Numbers of the reduced unknowns, and tangent spaces in general position.
        parts: Reductions of all meshes.
        coupled: Entries of couplings; None: there are none.
    """
    entries = [part.find_pattern() for part in parts]
    owned = len(numbers.outer)
    diagonal = (numbers.first_outer + np.arange(owned)).astype(np.int32)
    more = [] if coupled is None else [(coupled.rows, coupled.columns)]
    rows = [*(r for r, _ in (*entries, *more)), diagonal]
    columns = [*(c for _, c in (*entries, *more)), diagonal]
    make = CsrMatrix if numbers.full.serial else CooMatrix
    return make(numbers.full.comm, Pattern(owned, rows, columns), parts)


def _found(known: Ints, keys: Ints) -> Ints:
    """Places of keys among known ones, which are sorted.

    Raises:
        IndexError: If one is not among them.
    """
    places = np.searchsorted(known, keys)
    if len(keys) and not np.array_equal(known[np.minimum(places, len(known) - 1)], keys):
        raise IndexError("an entry of a coupling is not in the pattern of the matrix")
    return places
