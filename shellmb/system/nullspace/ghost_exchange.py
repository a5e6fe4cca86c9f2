"""Values of unknowns from the ranks that compute them to all ranks that see them."""

from __future__ import annotations

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Floats, Ints


class Numbers:
    """Unknowns numbered over all ranks, each rank owning a range of them.

    Args:
        comm: Communicator.
        owned: Count of those that this rank owns.
        wanted: Numbers of those that this rank sees, in its order; negative ones are none.
    """

    def __init__(self, comm: MPI.Comm, owned: int, wanted: Ints) -> None:
        self.comm, self.owned = comm, owned
        self.start = int(comm.exscan(owned) or 0)  # type: ignore[attr-defined]
        self.total = int(comm.allreduce(owned))
        self.serial = comm.size == 1
        self.some = wanted >= 0
        # what there is among what is seen: mostly all
        self._places = slice(None) if self.some.all() else self.some
        self.wanted = np.where(self.some, wanted, 0)
        # all of them in their order: nothing to look up
        self._same = self.serial and np.array_equal(wanted, np.arange(self.total))
        if not self.serial:
            numbers = self.wanted[self.some].astype(PETSc.IntType)
            self._vector = PETSc.Vec().createMPI((owned, PETSc.DETERMINE), comm=comm)
            self._local = PETSc.Vec().createSeq(len(numbers), comm=PETSc.COMM_SELF)
            places = PETSc.IS().createGeneral(numbers, comm=PETSc.COMM_SELF)
            self._scatter = PETSc.Scatter().create(self._vector, places, self._local, None)

    def seen(self, values: Floats) -> Floats:
        """Values of all unknowns that this rank sees, zero where there is none.

        Args:
            values: Those that this rank owns, shape (owned,).
        """
        if self._same:
            return np.array(values)
        if self.serial:
            found = values[self.wanted] if self.total else np.zeros(len(self.wanted))
            return np.where(self.some, found, 0.0)
        self._vector.array[:] = values
        forward = PETSc.ScatterMode.FORWARD
        self._scatter.scatter(self._vector, self._local, PETSc.InsertMode.INSERT, forward)
        out = np.zeros(len(self.wanted))
        out[self._places] = self._local.array_r
        return out

    def summed(self, values: Floats) -> Floats:
        """Sums over all ranks of what they add to unknowns, shape (owned,).

        Args:
            values: One for each unknown that this rank sees.
        """
        if self._same:
            return np.array(values)
        if self.serial:
            return np.bincount(self.wanted, np.where(self.some, values, 0.0), self.total)
        self._vector.set(0.0)
        self._local.array[:] = values[self._places]
        reverse = PETSc.ScatterMode.REVERSE
        self._scatter.scatter(self._local, self._vector, PETSc.InsertMode.ADD, reverse)
        return np.array(self._vector.array_r)

    def set(self, numbers: Ints, values: Floats) -> Floats:
        """Values of the owned unknowns, from whatever rank knows them; zero where none does.

        Args:
            numbers: Unknowns that this rank knows the values of.
            values: Their values.
        """
        if self.serial:
            out = np.zeros(self.owned)
            out[numbers] = values
            return out
        self._vector.set(0.0)
        self._vector.setValues(numbers.astype(PETSc.IntType), values)
        self._vector.assemble()
        return np.array(self._vector.array_r)
