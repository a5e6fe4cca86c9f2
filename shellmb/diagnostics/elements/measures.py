"""Measures of meshes by which shells lock, or are too coarse."""

from mpi4py import MPI

import basix
import numpy as np
from dolfinx import mesh

from shellmb.arrays import Floats
from shellmb.meshes.shared import space_on, sums_at_nodes
from shellmb.model.shells.shell import ShellModel

# `d` below which meshes are regular
REGULAR = {"quadrilateral": 0.06, "triangle": 0.08}
# `kappa h^2/t`, the normal of an element turning by `kappa h`, below which a body counts as flat
CURVED = 0.3


class Mesh:
    """Measures of a mesh by which a shell locks in bending; collective.

    Args:
        body: The shell.

    Attributes:
        distorted: Whether it is not regular, or the body does not stretch.
        triangles: Whether it is of triangles.
        areas: Those of this rank's cells.
    """

    def __init__(self, body: ShellModel) -> None:
        self._body, domain = body, body.mixed.space.mesh
        count = domain.topology.index_map(2).size_local
        self.triangles = domain.basix_cell() == basix.CellType.triangle
        corners = 3 if self.triangles else 4
        # corners come first, of quadrilaterals in the order of a tensor product
        x = domain.geometry.x[domain.geometry.dofmaps[0][:count, :corners]]
        self._comm = domain.comm
        self._corners = body.mixed.subspaces["u"].dofmap.list[:count, :corners]
        if corners == 3:
            self._sides = [1, 2, 0], [0, 1, 2]
            normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
        else:
            self._sides = [3, 2], [0, 1]
            # half the product of the diagonals
            normal = np.cross(x[:, 3] - x[:, 0], x[:, 1] - x[:, 2]) / 2
        self.areas = np.linalg.norm(normal, axis=1)
        size = np.sqrt(self.areas)
        # h/t
        self._slender = size / body.section.sizes.thickness
        every = self._mean(size)
        # without stretching regular ones may lock, too
        if body.shell.stretching:
            size = size * _unlike_neighbours(domain, self.areas)
        self.distorted = self._mean(size) > REGULAR[domain.topology.cell_name()] * every
        # d h/t, with d over h
        self._shape = size / body.section.sizes.thickness

    def _mean(self, values: Floats) -> float:
        """Root of the mean square over the surface; collective."""
        here = np.array([np.sum(values**2 * self.areas), np.sum(self.areas)])
        self._comm.Allreduce(MPI.IN_PLACE, here)
        return float(np.sqrt(here[0] / here[1]))

    def proneness(self, directors: Floats) -> float:
        """`p`; collective.

        Args:
            directors: At the nodes, shape (n, 3).
        """
        return self._mean(self._shape * self._turned(directors))

    @property
    def curved(self) -> bool:
        """True for a thin and curved body; collective."""
        turned = self._turned(self._body.node_directors()[:, 0])
        return self._mean(self._slender * turned) >= CURVED

    def _turned(self, directors: Floats) -> Floats:
        d, (ends, starts) = directors[self._corners], self._sides
        return np.asarray(np.linalg.norm(d[:, ends] - d[:, starts], axis=2).max(axis=1))


def _unlike_neighbours(domain: mesh.Mesh, areas: Floats) -> Floats:
    """Part that areas of cells differ by from those around their vertices; collective.

    Args:
        domain: The mesh.
        areas: Those of this rank's cells, shape (cells,).
    """
    space = space_on(domain, ("Lagrange", 1, (2,)))
    cells = space.dofmap.list[: len(areas)]
    sums = sums_at_nodes(space, np.stack([areas, np.ones_like(areas)], axis=1)[:, None])
    around = (sums[:, 0] / np.maximum(sums[:, 1], 1.0))[cells].mean(axis=1)
    return np.asarray(np.abs(areas / around - 1))
