"""Values of unknowns from the ranks that own them to all ranks that see them, and sums back."""

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Floats, Ints


class Numbers:
    """Unknowns numbered over all ranks, each rank owning a range of them.

    Args:
        comm: Communicator.
        owned: Count of those that this rank owns.
        wanted: Numbers of those that this rank sees, in its order; they may repeat.

    Attributes:
        serial: Whether one process has all of them.
    """

    def __init__(self, comm: MPI.Comm, owned: int, wanted: Ints) -> None:
        self.comm, self.owned, self.wanted = comm, owned, wanted.astype(np.int64)
        self.start = int(comm.exscan(owned) or 0)  # type: ignore[attr-defined]
        self.total = int(comm.allreduce(owned))
        self.serial = comm.size == 1
        # all of them in their order: nothing to look up
        self._same = self.serial and np.array_equal(wanted, np.arange(self.total))
        if not self.serial:
            self._vector = PETSc.Vec().createMPI((owned, PETSc.DETERMINE), comm=comm)
            self._local = PETSc.Vec().createSeq(len(wanted), comm=PETSc.COMM_SELF)
            places = PETSc.IS().createGeneral(wanted.astype(PETSc.IntType), comm=PETSc.COMM_SELF)
            self._scatter = PETSc.Scatter().create(self._vector, places, self._local, None)

    def seen(self, values: Floats) -> Floats:
        """Values of all unknowns that this rank sees.

        Args:
            values: Those that this rank owns, shape (owned,).
        """
        if self._same:
            return np.array(values)
        if self.serial:
            return np.asarray(values[self.wanted])
        self._vector.array[:] = values
        forward = PETSc.ScatterMode.FORWARD
        self._scatter.scatter(self._vector, self._local, PETSc.InsertMode.INSERT, forward)
        return np.array(self._local.array_r)

    def summed(self, values: Floats) -> Floats:
        """Sums over all ranks of what they add to unknowns, shape (owned,).

        Args:
            values: One for each unknown that this rank sees.
        """
        if self._same:
            return np.array(values)
        if self.serial:
            return np.bincount(self.wanted, values, self.total)
        self._vector.set(0.0)
        self._local.array[:] = values
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
