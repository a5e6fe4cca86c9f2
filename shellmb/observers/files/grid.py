"""Nodes and cells of a body for files and pictures, gathered on rank 0."""

from __future__ import annotations

from dataclasses import dataclass

from mpi4py import MPI

import dolfinx.plot
import numpy as np
import numpy.typing as npt

from shellmb.arrays import Floats, Int32s, Ints
from shellmb.model.locations.nodes import Meshed


@dataclass(frozen=True)
class Grid:
    """All nodes and cells of a body; of shells and beams, of the degree of their displacement.

    Args:
        name: Name of the body, or of what is shown as one.
        nodes: Reference positions of the nodes, shape (n, 3), m.
        vtk_cells: Cells as VTK wants them: the number of nodes before the nodes of each.
        vtk_types: VTK's type of each cell.
        labels: Name of the body or joint of each node, or none.
    """

    name: str
    nodes: Floats
    vtk_cells: Ints
    vtk_types: npt.NDArray[np.uint8]
    labels: tuple[str, ...] = ()


class Gatherer:
    """Brings nodal values of a body with a mesh to rank 0.

    Args:
        body: The body; the call is collective.

    Attributes:
        grid: The whole grid on rank 0, None elsewhere; its nodes and cells are in the order in
            which the mesh was made, on any number of ranks.
    """

    def __init__(self, body: Meshed) -> None:
        space = body.mixed.subspaces["u"]
        index_map = space.dofmap.index_map
        self._comm: MPI.Comm = space.mesh.comm
        self._owned = int(index_map.size_local)
        cells, types, _ = dolfinx.plot.vtk_mesh(space)  # type: ignore[arg-type]
        width = space.dofmap.list.shape[1] + 1
        vtk = cells.reshape(-1, width).astype(np.int64)
        vtk[:, 1:] = _numbers(index_map, vtk[:, 1:])
        dim = space.mesh.topology.dim
        local = space.mesh.topology.index_map(dim).size_local
        own = _numbers(index_map, space.dofmap.list[:local])
        made = np.asarray(space.mesh.topology.original_cell_index[:local], dtype=np.int64)
        gathered = self._comm.gather((vtk, types, own, made))
        # of the nodes of all ranks in a row those that come first when the mesh is made, and so on
        self._order: Ints | None = None
        nodes = self.gather(body.mixed.nodes("u"))
        self.grid: Grid | None = None
        if gathered is None or nodes is None:
            return
        vtk, types, own, made = (np.concatenate([part[k] for part in gathered]) for k in range(4))
        cells = np.argsort(made)
        vtk, types, own = vtk[cells], types[cells], own[cells]
        there, first = np.unique(own, return_index=True)
        self._order = there[np.argsort(first)]
        number = np.empty(len(nodes), dtype=np.int64)
        number[self._order] = np.arange(len(nodes))
        nodes, vtk[:, 1:] = nodes[self._order], number[vtk[:, 1:]]
        self.grid = Grid(body.name, nodes, vtk.ravel(), types.astype(np.uint8))

    def gather(self, values: Floats) -> Floats | None:
        """Values at all nodes on rank 0, None elsewhere.

        Args:
            values: Values at the nodes of this rank (owned and ghost), shape (n, k).
        """
        mine = np.asarray(values[: self._owned])
        # the numbers of the nodes go from rank to rank, so the parts only have to be put in a row
        gathered = self._comm.gather(mine) if self._comm.size > 1 else [mine]
        if gathered is None:
            return None
        found = np.concatenate(gathered)
        return found if self._order is None else found[self._order]


def _numbers(index_map, local: Int32s) -> Ints:  # type: ignore[no-untyped-def]
    """Global numbers of nodes, in the shape of the local ones."""
    flat = index_map.local_to_global(np.ascontiguousarray(local, dtype=np.int32).ravel())
    return np.asarray(flat, dtype=np.int64).reshape(local.shape)
