"""One side for a whole surface: consistently oriented normals of the cells of a mesh."""

from __future__ import annotations

import numpy as np
import scipy.sparse
from scipy.sparse.csgraph import breadth_first_order, connected_components

from shellmb.arrays import Floats, Ints
from shellmb.errors import SceneError
from shellmb.meshes.raw import FACETS, Cell, cell_cross, vertex_count

__all__ = ["oriented"]

# vertices of a cell going round it
ROUND = {"quad": (0, 1, 3, 2), "tri": (0, 1, 2)}


def oriented(x: Floats, cells: Ints, cell: Cell, name: str) -> Floats:
    """Normal vectors of the cells, all on one side in every connected part, shape (c, 3).

    Each part takes the side on which most of its cells are as they come.

    Args:
        x: Positions of the nodes, shape (n, 3).
        cells: Nodes of the cells in the order of DOLFINx, shape (c, k).
        cell: Cell type.
        name: Name of the shell, for errors.

    Raises:
        SceneError: If more than two cells share a facet, or the surface has one side only.
    """
    first, second, opposite = _neighbours(cells, cell, name)
    count = len(cells)
    weights = np.where(opposite, 1, 2)  # 1: same sense, 2: turned
    graph = scipy.sparse.coo_array((weights, (first, second)), shape=(count, count)).tocsr()
    graph = graph + graph.T
    parts, part = connected_components(graph, directed=False)
    sign = np.zeros(count)
    for p in range(parts):
        order, parent = breadth_first_order(graph, int(np.argmax(part == p)), directed=False)
        sign[order[0]] = 1.0
        if len(order) > 1:
            above = parent[order[1:]]
            same = np.asarray(graph[above, order[1:]]).ravel() == 1
            for c, before, as_before in zip(order[1:], above, same, strict=True):
                sign[c] = sign[before] * (1.0 if as_before else -1.0)
        if sign[order].sum() < 0:
            sign[order] *= -1.0
    if np.any((sign[first] == sign[second]) != opposite):
        raise SceneError(
            f"shell '{name}': its mesh has one side only, like a Moebius strip; "
            "cut it into shells that have two and join them"
        )
    return np.asarray(cell_cross(x[cells[:, : vertex_count(cell)]]) * sign[:, None])


def _neighbours(cells: Ints, cell: Cell, name: str) -> tuple[Ints, Ints, np.ndarray]:
    """Pairs of cells that share a facet, and whether they run along it in opposite directions.

    Cells with one sense of rotation run along a common facet in opposite directions.
    """
    ring = ROUND[cell]
    steps = {frozenset(pair) for pair in FACETS[cell]}
    sides = [(a, b) for a, b in zip(ring, ring[1:] + ring[:1], strict=True)]
    assert {frozenset(s) for s in sides} == steps
    directed = np.stack([cells[:, list(s)] for s in sides], axis=1).reshape(-1, 2)
    owner = np.repeat(np.arange(len(cells)), len(sides))
    rising = directed[:, 0] < directed[:, 1]
    _, facet, uses = np.unique(
        np.sort(directed, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    if uses.max() > 2:
        raise SceneError(
            f"shell '{name}': {uses.max()} cells of its mesh share one facet; a shell must not "
            "branch, so make each part a shell and join them"
        )
    by_facet = np.argsort(facet.ravel(), kind="stable")
    start = np.concatenate([[0], np.cumsum(uses)])[:-1][uses == 2]
    a, b = by_facet[start], by_facet[start + 1]
    return owner[a], owner[b], rising[a] != rising[b]
