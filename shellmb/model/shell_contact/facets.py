"""Facets of a shell's mid-surface, and the places on them that are nearest to points.

Elements are split at their nodes into small quadrilaterals or triangles, and the quadrilaterals
into four triangles about their centre. A place is within a triangle, or on the nearest of its
sides.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.model.locations.nodes import Meshed, part_dofs

# parts of a triangle by which a point above its edge counts as above it: slopes are a plane's there
EDGE = 1e-12
SIDES = np.array([[0, 1], [0, 2], [1, 2]])
# vertices of the triangles of a small quadrilateral by its corners, which are in a circle
CENTRE = np.full(4, 0.25)
FOUR = np.array([[np.eye(4)[k], np.eye(4)[(k + 1) % 4], CENTRE] for k in range(4)])
ONE = np.eye(3)[None]


@dataclass(frozen=True)
class Facets:
    """Triangles of a mid-surface.

    Args:
        cells: Nodes of each small cell, shape (c, n), n is 3 or 4.
        cell: Cell of each triangle, shape (t,).
        vertices: Vertices of each triangle as combinations of its cell's nodes, shape (t, 3, n).
    """

    cells: Ints
    cell: Ints
    vertices: Floats

    def places(self, x: Floats, which: Ints) -> Floats:
        """Vertices of some triangles, shape (m, 3, 3), for nodes at (n, 3)."""
        return np.asarray(self.vertices[which] @ x[self.cells[self.cell[which]]])


def facets_of(shell: Meshed, first: Ints) -> Facets:
    """Facets of a shell, the same on all ranks and on any number of them; collective.

    Args:
        shell: The shell; its displacement is of any degree, on quadrilaterals or triangles.
        first: First global dofs of its nodes in their order.
    """
    space, domain = shell.mixed.subspaces["u"], shell.domain.mesh
    table = np.asarray(space.dofmap.list)[: domain.topology.index_map(2).size_local]
    points = np.asarray(space.ufl_element().sub_elements[0].basix_element.points)
    steps = np.unique(np.round(points, 9))
    k = len(steps) - 1
    grid = np.argmin(abs(points[:, :, None] - steps), axis=2)
    number = {(int(a), int(b)): n for n, (a, b) in enumerate(grid)}
    corners = [(i, j) for i in range(k) for j in range(k)]
    if len(points) == (k + 1) ** 2:
        ring, parts = ((0, 0), (1, 0), (1, 1), (0, 1)), FOUR
        small = [[number[i + a, j + b] for a, b in ring] for i, j in corners]
    else:
        up, down = ((0, 0), (1, 0), (0, 1)), ((1, 0), (1, 1), (0, 1))
        found = [[(i + a, j + b) for a, b in ring] for i, j in corners for ring in (up, down)]
        small = [[number[p] for p in some] for some in found if all(p in number for p in some)]
        parts = ONE
    order, local = np.argsort(first), np.arange(len(shell.mixed.nodes("u")), dtype=np.int32)
    own = shell.mixed.space.dofmap.index_map.local_to_global(part_dofs(shell, local, "u")[:, 0])
    node = order[np.searchsorted(first[order], own)]
    mine = node[table][:, np.array(small)].reshape(-1, len(small[0]))
    cells = np.concatenate(domain.comm.allgather(mine))
    cells = cells[np.lexsort(cells.T[::-1])]
    return Facets(
        cells, np.repeat(np.arange(len(cells)), len(parts)), np.tile(parts, (len(cells), 1, 1))
    )


class Nearest(NamedTuple):
    """Places of triangles that are nearest to points.

    Args:
        weights: Of the vertices, shape (m, 3).
        distance: From the points, shape (m,), m.
        turns: How the weights may change along the triangle, or along its edge: two directions,
            shape (m, 2, 3), of which some are zero on an edge or at a vertex.
        inverse: Inverse of the products of these directions as vectors, shape (m, 2, 2).
    """

    weights: Floats
    distance: Floats
    turns: Floats
    inverse: Floats

    def only(self, which: Any) -> Nearest:
        """Some of them."""
        return Nearest(*(values[which] for values in self))


def nearest(y: Floats, v: Floats) -> Nearest:
    """Places of triangles nearest to points.

    Args:
        y: Points, shape (m, 3), m.
        v: Vertices, shape (m, 3, 3), m.
    """
    ab, ac, away = v[:, 1] - v[:, 0], v[:, 2] - v[:, 0], y - v[:, 0]
    bb, bc, cc = np.vecdot(ab, ab), np.vecdot(ab, ac), np.vecdot(ac, ac)
    first, second = np.vecdot(ab, away), np.vecdot(ac, away)
    area = bb * cc - bc**2
    one, two = (cc * first - bc * second) / area, (bb * second - bc * first) / area
    inside = np.stack([1 - one - two, one, two], axis=1)
    face = (inside >= -EDGE).all(axis=1)
    # of what is not above it, the nearest side
    starts, ends = v[:, SIDES[:, 0]], v[:, SIDES[:, 1]]
    sides, off = ends - starts, y[:, None] - starts
    along = np.clip(np.vecdot(sides, off) / np.vecdot(sides, sides), 0.0, 1.0)
    rest = off - along[:, :, None] * sides
    side = np.argmin(np.vecdot(rest, rest), axis=1)
    along = along[np.arange(len(y)), side]
    eye = np.eye(3)
    start, end = eye[SIDES[side, 0]], eye[SIDES[side, 1]]
    weights = np.where(face[:, None], inside, start + along[:, None] * (end - start))
    edge = ~face & (along > 0) & (along < 1)
    turns = np.zeros((len(y), 2, 3))
    turns[edge, 0] = (end - start)[edge]
    turns[face] = [[-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]]
    tangents = turns @ v
    products = tangents @ tangents.transpose(0, 2, 1)
    inverse = np.zeros((len(y), 2, 2))
    inverse[face] = np.linalg.inv(products[face])
    inverse[edge, 0, 0] = 1 / products[edge, 0, 0]
    away = y - np.einsum("mk,mki->mi", weights, v)
    return Nearest(weights, np.linalg.norm(away, axis=1), turns, inverse)
