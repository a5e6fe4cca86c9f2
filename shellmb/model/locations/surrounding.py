"""Points between nodes of shells and beams: the nodes of their element, and its functions there."""

from __future__ import annotations

from typing import Any

import basix
import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.model.locations.nodes import ON_NODE, Meshed, shown

__all__ = ["is_point", "surrounding"]

# elements of a curved body are polynomials: a point of it may be off its element by this part of
# its size times what directors turn by along it, an eighth for a circle in straight pieces
SAG = 1 / 6
# a node with less of a point has nothing of it
NOTHING = 1e-12
SIMPLICES = (basix.CellType.triangle, basix.CellType.tetrahedron)
# elements that are tried, the nearest ones by their middles, and steps of Newton's method in each
TRIED, STEPS = 12, 25


def surrounding(body: Meshed, point: Any, who: str) -> tuple[list[tuple[float, ...]], Floats]:
    """Nodes that a point lies between, by their coordinates, and the weights of their values.

    A point that is a node has only itself. The call is collective.

    Args:
        body: The shell or beam.
        point: Coordinates, shape (3,), m.
        who: Who asks, for the error.

    Returns:
        Coordinates of k nodes, and weights, shape (k,), whose sum is 1.

    Raises:
        SceneError: If the point is not on the body.
    """
    x, size = np.asarray(point, dtype=float), body.domain.length
    comm, nodes = body.domain.mesh.comm, body.mixed.nodes("u")
    near = float(np.min(np.linalg.norm(nodes - x, axis=1), initial=np.inf))
    if comm.allreduce(near <= ON_NODE * size, op=_either):
        return [tuple(x.tolist())], np.ones(1)
    best = min(((*found, comm.rank) for found in _projections(body, x)), default=None)
    every = [one for one in comm.allgather(best) if one is not None]
    off, allowed, place, cell, local, rank = min(every)
    if off > max(allowed, ON_NODE * size):
        raise SceneError(
            f"{who}: {shown(x)} is not on {body.domain.kind} '{body.name}'; it is {off:.3g} m away "
            f"from its nearest point {shown(place)}"
        )
    mine: Any = None
    if comm.rank == rank:
        space = body.mixed.subspaces["u"]
        element: Any = space.element.basix_element
        weights = np.asarray(element.tabulate(0, np.array([local])))[0, 0, :, 0]
        there = nodes[space.dofmap.cell_dofs(cell)]
        kept = np.abs(weights) > NOTHING
        mine = ([tuple(p) for p in there[kept].tolist()], weights[kept])
    names, weights = comm.bcast(mine, root=rank)
    return names, weights


def is_point(where: Any) -> bool:
    """Decide whether a place is given by coordinates."""
    return isinstance(where, tuple) and not isinstance(where[0], str)


def _either(a: bool, b: bool) -> bool:
    return a or b


def _projections(body: Meshed, x: Floats) -> list[tuple[float, float, tuple, int, tuple]]:
    """Distances from the nearest own elements: distance, what is allowed, place, number, local."""
    mesh = body.domain.mesh
    dofs = mesh.geometry.dofmaps[0][: mesh.topology.index_map(mesh.topology.dim).size_local]
    if not len(dofs):
        return []
    corners = mesh.geometry.x[dofs]
    sizes = np.linalg.norm(np.ptp(corners, axis=1), axis=1)
    order = np.argsort(np.linalg.norm(corners.mean(axis=1) - x, axis=1) - sizes)[:TRIED]
    element, directors = _geometry(mesh), body.node_directors()
    found = []
    for cell in order:
        local, place = _nearest(element, corners[cell], x)
        off = float(np.linalg.norm(place - x))
        along = directors[body.mixed.subspaces["u"].dofmap.cell_dofs(cell)]
        turn = float(np.linalg.norm(np.ptp(along, axis=0), axis=1).max(initial=0.0))
        found.append((off, SAG * turn * float(sizes[cell]), tuple(place), int(cell), tuple(local)))
    return found


def _geometry(mesh: Any) -> Any:
    """The element of the geometry."""
    cmap = mesh.geometry.cmaps[0]
    cell = getattr(basix.CellType, mesh.topology.cell_type.name)
    return basix.create_element(
        basix.ElementFamily.P, cell, cmap.degree, basix.LagrangeVariant(cmap.variant)
    )


def _nearest(element: Any, corners: Floats, x: Floats) -> tuple[Floats, Floats]:
    """The point of one element that is nearest: local coordinates and position.

    By Gauss and Newton's method, kept in the element.
    """
    inside = _simplex if element.cell_type in SIMPLICES else _box
    local = basix.geometry(element.cell_type).mean(axis=0)
    for _ in range(STEPS):
        table = element.tabulate(1, local[None])[:, 0, :, 0]
        gap, slopes = x - table[0] @ corners, table[1:] @ corners
        new = inside(local + np.linalg.lstsq(slopes.T, gap, rcond=None)[0])
        done, local = np.abs(new - local).max() < 1e-14, new
        if done:
            break
    return local, element.tabulate(0, local[None])[0, 0, :, 0] @ corners


def _box(local: Floats) -> Floats:
    return np.asarray(np.clip(local, 0.0, 1.0))


def _simplex(local: Floats) -> Floats:
    local = np.maximum(local, 0.0)
    return np.asarray(local / max(float(local.sum()), 1.0))
