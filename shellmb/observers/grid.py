"""The mesh of a shell with its values, gathered on rank 0 for files and pictures."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

from mpi4py import MPI

import dolfinx.plot
import numpy as np
import numpy.typing as npt

from shellmb.model.shell import ShellModel

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Grid:
    """All nodes and cells of a shell, of the degree of its displacement.

    Args:
        name: Name of the shell.
        nodes: Reference positions of the nodes, shape (n, 3), m.
        vtk_cells: Cells as VTK wants them: the number of nodes before the nodes of each.
        vtk_types: VTK's type of each cell.
        faces: Corners of flat pieces that together make the surface, shape (f, 3 or 4).
        outlines: Nodes around each cell, shape (c, k), closed.
    """

    name: str
    nodes: Floats
    vtk_cells: Ints
    vtk_types: npt.NDArray[np.uint8]
    faces: Ints
    outlines: Ints

    @property
    def border(self) -> Ints:
        """Segments of the boundary of the surface, shape (s, 2)."""
        ends = np.stack([self.outlines[:, :-1], self.outlines[:, 1:]], axis=-1).reshape(-1, 2)
        pairs, counts = np.unique(np.sort(ends, axis=1), axis=0, return_counts=True)
        return np.asarray(pairs[counts == 1])


class Gatherer:
    """Brings nodal values of a shell to rank 0.

    Args:
        body: The shell; the call is collective.

    Attributes:
        grid: The whole grid on rank 0, None elsewhere.
    """

    def __init__(self, body: ShellModel) -> None:
        space = body.mixed.subspaces["u"]
        index_map = space.dofmap.index_map
        self._comm: MPI.Comm = space.mesh.comm
        self._owned = int(index_map.size_local)
        cells, types, _ = dolfinx.plot.vtk_mesh(space)  # type: ignore[arg-type]
        width = space.dofmap.list.shape[1] + 1
        vtk = cells.reshape(-1, width).astype(np.int64)
        vtk[:, 1:] = _numbers(index_map, vtk[:, 1:])
        local = space.mesh.topology.index_map(2).size_local
        own = _numbers(index_map, space.dofmap.list[:local])
        gathered = self._comm.gather((vtk, types, own))
        nodes = self.gather(body.mixed.nodes("u"))
        self.grid: Grid | None = None
        if gathered is None or nodes is None:
            return
        vtk, types, own = (np.concatenate([part[k] for part in gathered]) for k in range(3))
        pieces, around = _lattice(np.asarray(space.element.basix_element.points))
        self.grid = Grid(
            body.name,
            nodes,
            vtk.ravel(),
            types.astype(np.uint8),
            own[:, pieces].reshape(-1, pieces.shape[1]),
            own[:, around],
        )

    def gather(self, values: Floats) -> Floats | None:
        """Values at all nodes on rank 0, None elsewhere.

        Args:
            values: Values at the nodes of this rank (owned and ghost), shape (n, k).
        """
        # the numbers of the nodes go from rank to rank, so the parts only have to be put in a row
        gathered = self._comm.gather(np.asarray(values[: self._owned]))
        return None if gathered is None else np.concatenate(gathered)


def _numbers(index_map, local: npt.NDArray[np.int32]) -> Ints:  # type: ignore[no-untyped-def]
    """Global numbers of nodes, in the shape of the local ones."""
    flat = index_map.local_to_global(np.ascontiguousarray(local, dtype=np.int32).ravel())
    return np.asarray(flat, dtype=np.int64).reshape(local.shape)


def _lattice(points: Floats) -> tuple[Ints, Ints]:
    """Flat pieces of a Lagrange cell and the nodes around it, by the positions of its nodes.

    Args:
        points: Reference positions of the nodes, shape (n, 2).

    Returns:
        Pieces, shape (p, 3 or 4), and the closed way around, shape (k,).
    """
    ij = [np.unique(np.round(points[:, k], 6), return_inverse=True)[1] for k in (0, 1)]
    node = {(int(i), int(j)): n for n, (i, j) in enumerate(zip(*ij, strict=True))}
    k = max(i for i, _ in node)
    steps = range(k)
    if (k, k) in node:
        pieces = [
            [node[i, j], node[i + 1, j], node[i + 1, j + 1], node[i, j + 1]]
            for i in steps
            for j in steps
        ]
        corners = [(0, 0), (k, 0), (k, k), (0, k), (0, 0)]
    else:
        lower = [[(i, j), (i + 1, j), (i, j + 1)] for i in steps for j in steps]
        upper = [[(i + 1, j), (i + 1, j + 1), (i, j + 1)] for i in steps for j in steps]
        pieces = [[node[p] for p in piece] for piece in lower + upper if set(piece) <= node.keys()]
        corners = [(0, 0), (k, 0), (0, k), (0, 0)]
    around = [node[0, 0]]
    for (ai, aj), (bi, bj) in itertools.pairwise(corners):
        around += [node[ai + (bi - ai) * s // k, aj + (bj - aj) * s // k] for s in range(1, k + 1)]
    return np.array(pieces), np.array(around)
