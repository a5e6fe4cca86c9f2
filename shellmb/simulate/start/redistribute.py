"""Values of functions cell by cell, in the order of the mesh as it was made, on any ranks.

Ranks number cells and dofs as they like; what a cell was when the mesh was made, and the order of
dofs within it, are the same on any number of them.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from dolfinx import fem

from shellmb.arrays import Floats, Ints

__all__ = ["numbering", "spread"]

CELLS, DOFS, ORIENTATION = "cells", "dofs", "orientation"


def numbering(space: fem.FunctionSpace) -> dict[str, Ints]:
    """Find where the cells that this rank owns have their dofs.

    Args:
        space: The space.

    Returns:
        Numbers of the cells in the mesh as it was made, shape (n,); their local dofs, shape (n, k);
        and how their edges are oriented, shape (n,), where the element asks for it.
    """
    topology = space.mesh.topology
    return _of_cells(space, topology.index_map(topology.dim).size_local)


def spread(
    parts: Sequence[tuple[Mapping[str, Ints], Floats]], space: fem.FunctionSpace
) -> Floats | None:
    """Values at the dofs of this rank, owned and ghost, from those of other ranks.

    Args:
        parts: Of each of those ranks its `numbering`, and its values.
        space: The space on the ranks of today.

    Returns:
        The values; None if they are of another mesh or element.
    """
    topology = space.mesh.topology
    here = _of_cells(space, len(topology.original_cell_index))
    mine = here[DOFS]
    count = int(topology.index_map(topology.dim).size_global)
    if sum(len(there[CELLS]) for there, _ in parts) != count:
        return None
    whole = np.empty((count, mine.shape[1]))
    for there, values in parts:
        if there[DOFS].shape[1:] != mine.shape[1:]:
            return None
        found = values[there[DOFS]]
        if ORIENTATION in there:
            # as the reference element has them
            _turn(space.element.Tt_apply, found, there[ORIENTATION])
        whole[there[CELLS]] = found
    wanted = whole[here[CELLS]]
    if ORIENTATION in here:
        _turn(space.element.Tt_inv_apply, wanted, here[ORIENTATION])
    index_map = space.dofmap.index_map
    to = np.zeros((index_map.size_local + index_map.num_ghosts) * space.dofmap.index_map_bs)
    to[mine] = wanted
    return to


def _of_cells(space: fem.FunctionSpace, count: int) -> dict[str, Ints]:
    topology, size = space.mesh.topology, space.dofmap.index_map_bs
    dofs = np.asarray(space.dofmap.list[:count], dtype=np.int64)
    unrolled = (size * dofs[:, :, None] + np.arange(size)).reshape(count, size * dofs.shape[1])
    found = {CELLS: np.asarray(topology.original_cell_index[:count], dtype=np.int64)}
    found[DOFS] = unrolled
    if space.element.needs_dof_transformations:
        topology.create_entity_permutations()
        found[ORIENTATION] = np.asarray(topology.get_cell_permutation_info()[:count], np.int64)
    return found


def _turn(apply, values: Floats, orientation: Ints) -> None:  # type: ignore[no-untyped-def]
    """Let an element's transformation act on rows of dofs, in place."""
    flat = values.reshape(-1)
    apply(flat, orientation.astype(np.uint32), 1)
    values[:] = flat.reshape(values.shape)
