"""Two motions of triangles in their plane: all nodes in the middle of sides against all vertices.

On meshes that are nearly flat each element has next to no strain in them, whatever its shape, where
bubbles follow; only the share of the fully integrated part holds them, which vanishes with the
square of the thickness: a free plate has them among its lowest frequencies. Elements can do so only
all at once and alike, so that one of them which does not is enough. It takes a third of its
membrane energy from the full rule, and does not bend as easily as the others; so it is one at a
corner or a free side, where little bends, and there is none where something else holds middles of
sides in both directions of the surface.
"""

from __future__ import annotations

from mpi4py import MPI

import basix
import numpy as np
from dolfinx import mesh

from shellmb.model.shells.shell import ShellModel

# share of the fully integrated part in that element: with it the two motions of free plates lie
# beyond the first true ones, at any thickness; with 0.5 that element's forces are twice as wrong
HOLDING = 0.3
# of the direction that is held most: an axis of a support that hardly lies in the surface does not
ENOUGH = 1e-3


def hold_middles(body: ShellModel) -> None:
    """Let one element hold the middles of all; collective.

    Args:
        body: A shell, supported and joined.
    """
    domain = body.mixed.space.mesh
    if domain.basix_cell() != basix.CellType.triangle:
        return
    if _held(body):
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


def _held(body: ShellModel) -> bool:
    """Decide whether middles of sides are held in both directions of the surface; collective."""
    middles = np.unique(body.mixed.subspaces["u"].dofmap.list[:, 3:])
    dofs = body.mixed.dofs["u"].reshape(-1, 3)[middles]
    given = [fixed.dofs for fixed in body.fixed] + [link.dofs for link in body.links]
    held = np.isin(dofs, np.concatenate([*given, np.empty(0, dtype=np.int32)]))
    # axes that are held, as they lie in the surface
    D = body.node_directors()[middles, 0]
    along = (np.eye(3) - D[:, :, None] * D[:, None, :])[held]
    both = body.mixed.space.mesh.comm.allreduce(along.T @ along, op=MPI.SUM)
    sizes = np.linalg.eigvalsh(both)
    return bool(sizes[1] > ENOUGH * sizes[2])
