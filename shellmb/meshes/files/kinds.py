"""Content of a file or of gmsh, and its cells of several kinds as cells of one.

Middle nodes are added, quadrilaterals and triangles cut.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from dolfinx.io.gmsh import cell_perm_array
from dolfinx.mesh import CellType

from shellmb.arrays import Floats, Ints
from shellmb.meshes.raw import HALVES, Cell, Part, divided, uniform, vertex_count

# number of nodes -> cell; they are numbered as gmsh does: corners around, middles of the sides in
# this order, middle
CELLS: dict[int, Cell] = {3: "tri", 6: "tri", 4: "quad", 8: "quad", 9: "quad"}


@dataclass
class FileContent:
    """Everything of a mesh that a shell may be made of.

    Args:
        x: Positions of all nodes, shape (n, 3).
        cells: Rows of the nodes of each cell, as many as one of `CELLS` has.
        groups: Numbers of the cells of each named group.
        lines: Ends of the sides of cells on each named line, shape (m, 2).
        points: Row of the node of each named point.
        left_out: Number of what else there is, by its name in the file.
        directed: Numbers of the cells whose material direction the file gives.
        directions: What the file calls these directions.
    """

    x: Floats
    cells: list[Sequence[int] | Ints] = field(default_factory=list)
    groups: dict[str, list[int]] = field(default_factory=dict)
    lines: dict[str, Ints] = field(default_factory=dict)
    points: dict[str, int] = field(default_factory=dict)
    left_out: Counter[str] = field(default_factory=Counter)
    directed: list[int] = field(default_factory=list)
    directions: str = ""


DOLFINX = {"quad": CellType.quadrilateral, "tri": CellType.triangle}
# three quadrilaterals of a triangle, and a triangle by itself
THIRDS = np.array(
    [
        [(0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (1 / 3, 1 / 3)],
        [(0.5, 0.0), (1.0, 0.0), (1 / 3, 1 / 3), (0.5, 0.5)],
        [(0.0, 0.5), (1 / 3, 1 / 3), (0.0, 1.0), (0.5, 0.5)],
    ]
)
WHOLE = uniform("tri", 1)


@dataclass(frozen=True)
class Block:
    """Cells of one type.

    Args:
        cell: The type.
        rows: Their nodes, in the order of DOLFINx.
        parents: Number of each, or of the one that it is a part of, among those that were read.
    """

    cell: Cell
    rows: Ints
    parents: Ints

    @property
    def vertices(self) -> Ints:
        """Vertices of each cell, shape (c, 3 or 4)."""
        return self.rows[:, : vertex_count(self.cell)]

    def take(self, which: Any) -> Block:
        """Some of the cells."""
        return Block(self.cell, self.rows[which], self.parents[which])


def by_type(blocks: Sequence[Block]) -> list[Block]:
    """One block of each type, of several."""
    found = []
    for cell in dict.fromkeys(block.cell for block in blocks):
        some = [block for block in blocks if block.cell == cell]
        rows = np.concatenate([block.rows for block in some])
        found.append(Block(cell, rows, np.concatenate([block.parents for block in some])))
    return found


def of_one_order(
    found: FileContent, chosen: Sequence[int], scale: float
) -> tuple[Floats, list[Block], int]:
    """Cells with the nodes that they lack.

    The middle of a quadrilateral with eight nodes is where its (serendipity) shape functions put
    it; cells without nodes on their sides among others that have them get straight ones.

    Args:
        found: What was read.
        chosen: Numbers of the cells that are taken.
        scale: Factor of the positions.

    Returns:
        Positions with those of new nodes behind them, the cells, and the order of the geometry.
    """
    numbers: dict[int, list[int]] = {}
    for number in chosen:
        numbers.setdefault(len(found.cells[number]), []).append(number)
    order = 2 if max(numbers) > 4 else 1
    x, blocks = found.x * scale, []
    for count, own in numbers.items():
        rows, cell = np.array([found.cells[k] for k in own]), CELLS[count]
        corners = vertex_count(cell)
        if order == 2 and rows.shape[1] == corners:
            ends = x[rows[:, :corners]]
            sides = (ends + np.roll(ends, -1, axis=1)) / 2
            x, rows = _with(x, rows, sides)
        if order == 2 and rows.shape[1] == 8:
            middle = x[rows[:, 4:]].sum(axis=1) / 2 - x[rows[:, :4]].sum(axis=1) / 4
            x, rows = _with(x, rows, middle[:, None])
        rows = rows[:, cell_perm_array(DOLFINX[cell], rows.shape[1])]
        blocks.append(Block(cell, rows, np.array(own)))
    return x, by_type(blocks), order


def _with(x: Floats, rows: Ints, more: Floats) -> tuple[Floats, Ints]:
    """New nodes of cells, shape (c, k, 3), behind those that they have."""
    numbers = len(x) + np.arange(more.shape[0] * more.shape[1]).reshape(more.shape[:2])
    return np.concatenate([x, more.reshape(-1, 3)]), np.concatenate([rows, numbers], axis=1)


def cut(x: Floats, blocks: Sequence[Block], order: int, into: Cell) -> tuple[Floats, Ints, Ints]:
    """All cells cut into those of one type, which fit together.

    Into quadrilaterals: quadrilaterals in four and triangles in three. Into triangles:
    quadrilaterals in two, along the shorter diagonal.

    Args:
        x: Positions of the nodes.
        blocks: Cells of each type.
        order: Order of the geometry.
        into: The type.

    Returns:
        Positions with those of new nodes behind them, the parts, and the number of the cell that
        each is of.
    """
    parts, origins = list[Part](), list[Ints]()
    for block in blocks:
        for some, pattern in _patterns(x, block.rows, block.cell, into):
            parts.append(Part(block.rows[some], block.cell, pattern))
            origins.append(np.repeat(block.parents[some], len(pattern)))
    x, found, _ = divided(x, parts, order, into)
    return x, np.concatenate(found), np.concatenate(origins)


def _patterns(x: Floats, rows: Ints, cell: Cell, into: Cell) -> list[tuple[Any, Floats]]:
    """Cells of a type that are cut alike, and how."""
    if into == "quad":
        return [(np.s_[:], uniform("quad", 2) if cell == "quad" else THIRDS)]
    if cell == "tri":
        return [(np.s_[:], WHOLE)]
    a, b, c, d = np.moveaxis(x[rows[:, :4]], 1, 0)
    first = np.linalg.norm(d - a, axis=1) <= np.linalg.norm(c - b, axis=1)
    return [(first, HALVES[0]), (~first, HALVES[1])]
