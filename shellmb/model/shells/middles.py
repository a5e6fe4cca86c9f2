"""Two motions of triangles in their plane: all nodes in the middle of sides against all vertices.

On meshes that are nearly flat each element has next to no strain in them, whatever its shape, where
bubbles follow; only the share of the fully integrated part holds them, which vanishes with the
square of the thickness: a free plate has them among its lowest frequencies. Elements can do so only
all at once and alike, so that one of them which does not is enough. It takes more than half of its
membrane and shear energy from the full rule, and does not bend as easily as the others; so it is
one at a corner or a free side, where little bends, and there is none where something else holds the
middle of a side.
"""

from __future__ import annotations

from mpi4py import MPI

import basix
import numpy as np
from dolfinx import mesh

from shellmb.model.shells.shell import ShellModel

# share of the fully integrated part in that element: with it the two motions of free plates lie
# beyond the true ones, at any thickness
HOLDING = 0.5


def hold_middles(body: ShellModel) -> None:
    """Let one element hold the middles of all; collective.

    Args:
        body: A shell, supported and joined.
    """
    domain = body.mixed.space.mesh
    if domain.basix_cell() != basix.CellType.triangle:
        return
    middles = np.unique(body.mixed.subspaces["u"].dofmap.list[:, 3:])
    dofs = body.mixed.dofs["u"].reshape(-1, 3)[middles]
    given = [fixed.dofs for fixed in body.fixed] + [link.dofs for link in body.links]
    held = any(bool(np.isin(dofs, each).any()) for each in given)
    if domain.comm.allreduce(held, op=MPI.LOR):
        return
    topology, share = domain.topology, body.section.share
    count = topology.index_map(2).size_local
    # number of free sides; of those with most of them the first one, whoever has it
    topology.create_connectivity(1, 2)
    topology.create_connectivity(2, 1)
    boundary = mesh.exterior_facet_indices(topology)
    sides = topology.connectivity(2, 1).array.reshape(-1, 3)[:count]
    free = np.isin(sides, boundary).sum(axis=1)
    first = np.asarray(topology.original_cell_index[:count])
    here = min(zip(-free, first, range(count), strict=True), default=None)
    key = (1, 0) if here is None else (int(here[0]), int(here[1]))
    chosen = domain.comm.allreduce(key, op=MPI.MIN) == key
    if here is not None and chosen:
        share.x.array[here[2]] = max(float(share.x.array[here[2]]), HOLDING)
    share.x.scatter_forward()
