"""Content of a file or of gmsh: nodes, cells of all kinds, groups, and what a shell cannot use."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy.typing as npt

from shellmb.arrays import Floats, Ints

__all__ = ["KINDS", "FileContent"]

# kind -> its cell, number of nodes; nodes are numbered as gmsh does: corners around, middles of the
# sides in this order, middle
KINDS = {
    "tri3": ("tri", 3),
    "tri6": ("tri", 6),
    "quad4": ("quad", 4),
    "quad8": ("quad", 8),
    "quad9": ("quad", 9),
}


@dataclass
class FileContent:
    """Everything of a mesh that a shell may be made of.

    Args:
        x: Positions of all nodes, shape (n, 3).
        cells: Kind of each cell, and the rows of its nodes.
        groups: Numbers of the cells of each named group.
        lines: Ends of the sides of cells on each named line, shape (m, 2).
        points: Row of the node of each named point.
        left_out: Number of what else there is, by its name in the file.
        directed: Numbers of the cells whose material direction the file gives.
        directions: What the file calls these directions.
    """

    x: Floats
    cells: list[tuple[str, npt.ArrayLike]] = field(default_factory=list)
    groups: dict[str, list[int]] = field(default_factory=dict)
    lines: dict[str, Ints] = field(default_factory=dict)
    points: dict[str, int] = field(default_factory=dict)
    left_out: Counter[str] = field(default_factory=Counter)
    directed: list[int] = field(default_factory=list)
    directions: str = ""
