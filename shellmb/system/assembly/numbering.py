"""Global numbering of the unknowns of all fields, with linked dofs numbered once.

Every rank numbers the dofs it owns, field after field, leaving out those that are linked to dofs
of another field;
linked dofs take the number of their target. This is the local-to-global map through which
everything is assembled, so nothing else in the system needs to know about links.
"""

from mpi4py import MPI

import numpy as np
from dolfinx import la

from shellmb.arrays import Ints
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
