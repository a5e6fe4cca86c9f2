"""Nodes that lie on one another become one; cells without area, cells that are twice, and sides.

A whole surface has one side: normals of its cells are consistently oriented.
"""

from collections.abc import Sequence

import numpy as np
import scipy.sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from shellmb.arrays import Floats, Ints
from shellmb.errors import SceneError
from shellmb.meshes.files.kinds import Block
from shellmb.meshes.raw import FACETS, Cell, cell_cross, vertex_count

# sides shorter than this part of the longest side of their cell are none, and cells with less
# height than this part of their longest side have no area
NOTHING = 1e-6


def sides(x: Floats, cells: Ints, cell: Cell) -> Floats:
    """Lengths of the sides of cells, shape (c, sides).

    Args:
        x: Positions of the nodes.
        cells: Cells in the order of DOLFINx.
        cell: Their type.
    """
    ends = x[cells[:, np.array(FACETS[cell])]]
    return np.asarray(np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2))


def joined(x: Floats, blocks: Sequence[Block], part: float) -> tuple[Ints, float]:
    """For each node the one that it becomes, and how far it goes, in parts of its sides.

    Nodes become one that are closer than a part of the shortest side of the cells around them.

    Args:
        x: Positions of the nodes.
        blocks: Cells of each type.
        part: The part.
    """
    size = np.full(len(x), np.inf)
    for block in blocks:
        rows, length = block.rows, sides(x, block.rows, block.cell)
        longest = length.max(axis=1, initial=0.0)
        shortest = np.where(length > NOTHING * longest[:, None], length, np.inf).min(axis=1)
        np.minimum.at(size, rows.ravel(), np.repeat(shortest, rows.shape[1]))
    used = np.flatnonzero(np.isfinite(size))
    same = np.arange(len(x))
    if part == 0 or not len(used):
        return same, 0.0
    tree = cKDTree(x[used])
    pairs = used[tree.query_pairs(part * size[used].max(), output_type="ndarray")]
    away = np.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1)
    room = size[pairs].min(axis=1)
    near = away <= part * room
    pairs, far = pairs[near], float((away / room)[near].max(initial=0.0))
    graph = scipy.sparse.coo_array(
        (np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(x), len(x))
    )
    _, label = connected_components(graph, directed=False)
    _, first = np.unique(label, return_index=True)
    return np.asarray(first[label], dtype=np.int64), far


def empty(x: Floats, cells: Ints, cell: Cell) -> np.ndarray:
    """Cells without area: their corners are on one line, or are fewer than three.

    Args:
        x: Positions of the nodes.
        cells: Cells in the order of DOLFINx.
        cell: Their type.
    """
    corners = x[cells[:, : vertex_count(cell)]]
    longest = sides(x, cells, cell).max(axis=1, initial=0.0)
    # the largest triangle of corners counts, so that no sides are taken from one another
    thirds = [(0, 1, 2)] if cell == "tri" else [(0, 1, 2), (1, 3, 2), (0, 1, 3), (0, 3, 2)]
    areas = [
        np.linalg.norm(
            np.cross(corners[:, b] - corners[:, a], corners[:, c] - corners[:, a]), axis=1
        )
        for a, b, c in thirds
    ]
    return np.asarray(np.max(areas, axis=0) <= NOTHING * longest**2)


def doubles(cells: Ints, cell: Cell) -> Ints:
    """Cells whose corners another one has before them.

    Args:
        cells: Cells in the order of DOLFINx.
        cell: Their type.
    """
    corners = np.sort(cells[:, : vertex_count(cell)], axis=1)
    _, first = np.unique(corners, axis=0, return_index=True)
    return np.setdiff1d(np.arange(len(cells)), first)


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
    # each cell twice, as it is and turned over, and neighbours joined as they have one side
    turned = np.where(opposite, 0, count)
    ends = np.hstack([(first, second + turned), (first + count, second + count - turned)])
    graph = scipy.sparse.coo_array((np.ones(ends.shape[1]), tuple(ends)), shape=(2 * count,) * 2)
    label, over = connected_components(graph, directed=False)[1].reshape(2, count)
    if np.any(label == over):
        raise SceneError(
            f"shell '{name}': its mesh has one side only, like a Moebius strip; "
            "cut it into shells that have two and join them"
        )
    # the first cell of a part, as it is, has the smaller label
    sign, part = np.where(label < over, 1.0, -1.0), np.minimum(label, over)
    sign *= np.where(np.bincount(part, sign) < 0, -1.0, 1.0)[part]
    return np.asarray(cell_cross(x[cells[:, : vertex_count(cell)]]) * sign[:, None])


def _neighbours(cells: Ints, cell: Cell, name: str) -> tuple[Ints, Ints, np.ndarray]:
    """Pairs of cells that share a facet, and whether they run along it in opposite directions.

    Cells with one sense of rotation run along a common facet in opposite directions.
    """
    around = cells[:, ROUND[cell]]
    directed = np.stack([around, np.roll(around, -1, axis=1)], axis=2).reshape(-1, 2)
    owner = np.repeat(np.arange(len(cells)), around.shape[1])
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
    a, b = by_facet[np.cumsum(uses)[uses == 2] - np.array([[2], [1]])]
    return owner[a], owner[b], rising[a] != rising[b]
