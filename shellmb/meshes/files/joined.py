"""Nodes that lie on one another become one; cells without area, and cells that are twice."""

from __future__ import annotations

import numpy as np
import scipy.sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from shellmb.arrays import Floats, Ints
from shellmb.meshes.raw import FACETS, Cell, vertex_count

__all__ = ["doubles", "empty", "joined", "sides"]

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


def joined(x: Floats, cells: dict[Cell, Ints], part: float) -> tuple[Ints, float]:
    """For each node the one that it becomes, and how far it goes, in parts of its sides.

    Nodes become one that are closer than a part of the shortest side of the cells around them.

    Args:
        x: Positions of the nodes.
        cells: Cells of each type.
        part: The part.
    """
    size = np.full(len(x), np.inf)
    for cell, rows in cells.items():
        length = sides(x, rows, cell)
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
