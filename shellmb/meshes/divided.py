"""Cells divided into others: nodes lie where the cells' maps put them, and those on a side are one.

A pattern has the corners of each part of a cell, in the cell's own coordinates.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.meshes.raw import Cell, geometry_element, shape_functions, vertex_count

# two triangles of a quadrilateral, along one diagonal or the other
HALVES = (
    np.array([[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)], [(0.0, 0.0), (1.0, 1.0), (0.0, 1.0)]]),
    np.array([[(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)], [(1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]]),
)
# shares of vertices are known as so many parts; the odd shift keeps them away from where rounding
# turns
PARTS, SHIFT = 1e9, 0.318309886


class Part(NamedTuple):
    """Cells that are divided alike.

    Attributes:
        rows: Nodes of each cell.
        cell: Their type.
        pattern: Shape (parts, corners, 2).
    """

    rows: Ints
    cell: Cell
    pattern: Floats


def uniform(cell: Cell, times: int) -> Floats:
    """Pattern of equal parts.

    Args:
        cell: Type of the cell and its parts.
        times: So many parts along each side.
    """
    corners = np.asarray(geometry_element(cell, 1).points)
    begin = np.indices((times, times)).reshape(2, -1).T
    if cell == "quad":
        return np.asarray((begin[:, None] + corners) / times)
    level = begin.sum(axis=1)
    # the others are turned by half a turn
    upright, turned = begin[level < times], begin[level < times - 1]
    both = [upright[:, None] + corners, turned[:, None] + 1 - corners]
    return np.asarray(np.concatenate(both) / times)


def nodes_of(pattern: Floats, into: Cell, order: int) -> Floats:
    """Nodes of the parts of a cell, in its own coordinates, shape (parts, nodes, 2).

    Args:
        pattern: The parts, whose sides are straight in these coordinates.
        into: Their type.
        order: Order of the geometry.
    """
    within = shape_functions(into, 1, np.asarray(geometry_element(into, order).points))
    return np.einsum("pk,qkd->qpd", within, pattern)


def divided(
    x: Floats,
    parts: Sequence[Part],
    order: int,
    into: Cell,
    lines: Sequence[tuple[Ints, Floats]] = (),
) -> tuple[Floats, list[Ints], list[Ints]]:
    """Cells of one type in the places of others.

    A node is known by its shares of the vertices around it, the same in all cells that have it.

    Args:
        x: Positions of the nodes.
        parts: The cells.
        order: Order of the geometry.
        into: Type of the new cells.
        lines: Vertices of sides, shape (m, 2), and shares of these in nodes of the new cells along
            each, shape (p, 2).

    Returns:
        Positions, of new nodes behind those of the old ones, of which vertices are used only; the
        new cells of each of the parts, those of one cell after the other; and the nodes of each of
        the lines, shape (m p,).
    """
    keys, places, tables = list[Ints](), [np.zeros((0, 3))], list[Ints]()
    for rows, cell, pattern in parts:
        every = nodes_of(pattern, into, order)
        flat = every.reshape(-1, 2)
        _, first, table = np.unique(flat.round(9), axis=0, return_index=True, return_inverse=True)
        there = flat[first]
        keys.append(_keys(rows[:, : vertex_count(cell)], shape_functions(cell, 1, there)))
        shapes = shape_functions(cell, order, there)
        places.append(np.einsum("pk,ckx->cpx", shapes, x[rows]).reshape(-1, 3))
        tables.append(table.reshape(every.shape[:2]))
    keys += [_keys(*line) for line in lines]
    known, first, number = np.unique(
        np.concatenate(keys), axis=0, return_index=True, return_inverse=True
    )
    # vertices keep their numbers
    names = np.where(known[:, 1] < 0, known[:, 0], len(x) + np.arange(len(known)))
    numbers = np.split(names[number.ravel()], np.cumsum([len(k) for k in keys])[:-1])
    cells = [
        own.reshape(-1, table.max() + 1)[:, table].reshape(-1, table.shape[1])
        for own, table in zip(numbers, tables, strict=False)
    ]
    return np.concatenate([x, np.concatenate(places)[first]]), cells, numbers[len(parts) :]


def _keys(vertices: Ints, shares: Floats) -> Ints:
    """Vertices with a share, the largest number first, and their shares in whole numbers.

    Args:
        vertices: Vertices of cells or sides, shape (c, v).
        shares: Shape (p, v).

    Returns:
        Shape (c p, 8), for up to four vertices.
    """
    room = ((0, 0), (0, 4 - vertices.shape[1]))
    parts = np.rint(PARTS * np.pad(shares, room) + SHIFT).astype(np.int64)
    who = np.where(parts > 0, np.pad(vertices, room)[:, None], -1)
    order = np.argsort(-who, axis=2)
    both = [np.take_along_axis(a, order, axis=2) for a in (who, np.broadcast_to(parts, who.shape))]
    return np.concatenate(both, axis=2).reshape(-1, 8)
