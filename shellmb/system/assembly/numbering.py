"""Global numbering of the unknowns of all fields, and their values on ranks that see them.

Every rank numbers the dofs it owns, field after field, leaving out those that are linked to dofs
of another field;
linked dofs take the number of their target. This is the local-to-global map through which
everything is assembled, so nothing else in the system needs to know about links.
"""

from collections.abc import Iterable, Sequence

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import numpy.typing as npt
from dolfinx import la

from shellmb.arrays import Floats, Int32s, Ints
from shellmb.native.library import cell_dofs
from shellmb.system.assembly.fields import Field


class Numbering:
    """Numbers of the unknowns.

    Args:
        comm: Communicator.
        fields: Fields in their order in the system. Links must point to dofs that are not linked
            themselves.

    Attributes:
        offsets: First entry of each field in the concatenated local arrays, shape (n + 1,).
        local_to_global: Number of every local dof of every field, concatenated.
        owned: Count of the unknowns this rank owns.
        start: Number of the first of them.
    """

    def __init__(self, comm: MPI.Comm, fields: list[Field]) -> None:
        self.offsets = np.concatenate([[0], np.cumsum([f.size_all for f in fields])]).astype(int)
        maps = [f.function.function_space.dofmap.index_map for f in fields]
        free = []
        for field in fields:
            mask = np.ones(field.size_all, dtype=bool)
            for link in field.links:
                mask[link.dofs] = False
            free.append(mask)
        own = [int(np.count_nonzero(m[: f.size_local])) for m, f in zip(free, fields, strict=True)]
        self.owned = sum(own)
        # the first rank receives nothing
        self.start = int(comm.exscan(self.owned) or 0)  # type: ignore[attr-defined]
        numbers: list[Ints] = []
        first = self.start
        for field, mask, count, index_map in zip(fields, free, own, maps, strict=True):
            vector = la.vector(index_map, 1, dtype=np.int64)
            values = vector.array
            values[:] = -1
            place = np.flatnonzero(mask[: field.size_local])
            values[place] = first + np.arange(count)
            first += count
            vector.scatter_forward()
            numbers.append(values.copy())
        for k, field in enumerate(fields):
            for link in field.links:
                numbers[k][link.dofs] = _look_up(
                    comm, numbers[link.field], maps[link.field], link.targets
                )
        self.by_field = numbers
        self.local_to_global = np.concatenate(numbers) if numbers else np.zeros(0, dtype=np.int64)
        if np.any(self.local_to_global < 0):
            raise ValueError("a linked dof points to a dof that is linked itself")

    def own(self, k: int, dofs: Int32s) -> Ints:
        """Unknowns of this rank among some dofs of field `k`, counted from its first one."""
        numbers = self.by_field[k][dofs] - self.start
        return numbers[(numbers >= 0) & (numbers < self.owned)]

    def slice(self, k: int) -> slice:
        """Place of field `k` in the concatenated local arrays."""
        return slice(int(self.offsets[k]), int(self.offsets[k + 1]))


def _look_up(comm: MPI.Comm, numbers: Ints, index_map, targets: Ints) -> Ints:  # type: ignore[no-untyped-def]
    """Numbers of dofs given by their index in a field's own index map, wherever they are owned."""
    first, last = index_map.local_range
    wanted = np.unique(np.concatenate(comm.allgather(targets)))
    mine = wanted[(wanted >= first) & (wanted < last)]
    pairs = comm.allgather((mine, numbers[mine - first]))
    keys = np.concatenate([p[0] for p in pairs])
    values = np.concatenate([p[1] for p in pairs])
    order = np.argsort(keys)
    return values[order][np.searchsorted(keys[order], targets)]


def most_entries(
    comm: MPI.Comm,
    numbering: Numbering,
    fields: Sequence[Field],
    places: Iterable[tuple[int, int]],
) -> npt.NDArray[np.int32] | None:
    """Bound on the entries of each row: all columns of all cells around its unknown.

    Args:
        comm: Communicator.
        numbering: Numbers of the unknowns.
        fields: The fields.
        places: Blocks that are not empty, by row and column field.

    Returns:
        The bounds, shape (owned,). None on several ranks, whose rows have entries from cells of
        others, and where a block has its rows and columns from different meshes.
    """
    n = numbering
    if comm.size > 1:
        return None
    found = np.ones(n.owned, dtype=np.int64)
    tables = [cell_dofs(field.function.function_space) for field in fields]
    for i, j in places:
        rows, columns = tables[i], tables[j]
        if len(rows) != len(columns):
            return None
        numbers = n.local_to_global[rows.ravel() + n.offsets[i]]
        found += columns.shape[1] * np.bincount(numbers, minlength=n.owned)
    return np.minimum(found, n.owned).astype(PETSc.IntType)


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
