"""Facets of a shell's mid-surface: places nearest to points, candidates of these, and crossings.

Elements are split at their nodes into small quadrilaterals or triangles, and the quadrilaterals
into four triangles about their centre. A place is within a triangle, or on the nearest of its
sides.

Points that cross triangles on straight paths between two states.

A point and the vertices of a triangle that move along straight lines, all at once, are in a plane
where a cubic in time is zero. It is found in Bernstein's form: where all four coefficients have one
sign it has no zero, and nearly all pairs are done with.
"""

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from shellmb.arrays import Bools, Floats, Ints
from shellmb.model.locations.nodes import Meshed

if TYPE_CHECKING:
    from scipy.spatial import cKDTree


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
    own = shell.mixed.numbers(shell.mixed.nodal("u")[local][:, 0])
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

    def only(self, which: Any) -> "Nearest":
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


class Candidates(NamedTuple):
    """Pairs of points and triangles, sorted by points.

    Args:
        point: Number of the point of each, shape (m,).
        triangle: Number of the triangle, shape (m,).
        first: First pair of each of the points that have one.
        y: Positions of all points when they were found, shape (n, 3), m.
        x: Positions of all nodes of the facets, m.
        slack: Points and nodes may have moved by half of it since, m.
    """

    point: Ints
    triangle: Ints
    first: Ints
    y: Floats
    x: Floats
    slack: float

    def moved(self, y: Floats, x: Floats) -> float:
        """Largest motion since then, as part of what is allowed."""
        most = max(
            float(np.max(np.vecdot(now - then, now - then), initial=0.0))
            for now, then in ((y, self.y), (x, self.x))
        )
        return 2 * float(np.sqrt(most)) / self.slack


def find(
    facets: Facets, y: Floats, x: Floats, reach: float, slack: float, apart: Bools | None
) -> Candidates:
    """Pairs that are within `reach` for as long as nothing moves by more than half of a slack.

    Args:
        facets: The facets.
        y: Points, shape (n, 3), m.
        x: Nodes of the facets, m.
        reach: Distance of interest, m.
        slack: Least slack; where all are further apart it is larger, m.
        apart: Which cells may touch which points, shape (n, cells); None: all.
    """
    tree, size = _tree(facets, x)
    far = reach + slack
    # no triangle is nearer than its middle is, less its size
    gap = float(np.min(tree.query(y)[0])) - size - reach
    if gap > slack and apart is None:
        none = np.zeros(0, dtype=np.int64)
        return Candidates(none, none, none, y, x, gap)
    point, triangle = _pairs(tree, y, far + size)
    if apart is not None:
        may = apart[point, facets.cell[triangle]]
        point, triangle = point[may], triangle[may]
    near = nearest(y[point], facets.places(x, triangle)).distance <= far
    point, triangle = point[near], triangle[near]
    _, first = np.unique(point, return_index=True)
    return Candidates(point, triangle, first, y, x, slack)


def around(facets: Facets, y: Floats, x: Floats, distance: Floats) -> tuple[Ints, Ints]:
    """Pairs of places and triangles that are no further apart than distances, or a little more.

    Args:
        facets: The facets.
        y: Places, shape (n, 3), m.
        x: Nodes of the facets, m.
        distance: Distances, shape (n,), m.
    """
    tree, size = _tree(facets, x)
    return _pairs(tree, y, distance + size)


def pairs_near(middles: Floats, y: Floats, distance: Floats) -> tuple[Ints, Ints]:
    """Pairs of places and middles that are no further apart than distances.

    Args:
        middles: The middles, shape (m, 3), m.
        y: Places, shape (n, 3), m.
        distance: Distances, shape (n,), m.
    """
    # loaded where there are such contacts only
    from scipy.spatial import cKDTree

    return _pairs(cKDTree(middles), y, distance)


def _tree(facets: Facets, x: Floats) -> tuple["cKDTree", float]:
    """Middles of all triangles, and the largest distance of a vertex from its one, m."""
    # loaded where there are such contacts only
    from scipy.spatial import cKDTree

    v = facets.places(x, np.arange(len(facets.cell)))
    middles = v.mean(axis=1)
    return cKDTree(middles), float(np.max(np.linalg.norm(v - middles[:, None], axis=2)))


def _pairs(tree: "cKDTree", y: Floats, distance: Any) -> tuple[Ints, Ints]:
    lists = tree.query_ball_point(y, distance, return_sorted=True)
    counts = np.array([len(some) for some in lists])
    found = [np.array(some, dtype=np.int64) for some in lists]
    return np.repeat(np.arange(len(y)), counts), np.concatenate(found)


# halvings of an interval in which the cubic changes its sign: to round-off
HALVINGS = 53


def crossings(y: tuple[Floats, Floats], v: tuple[Floats, Floats]) -> tuple[Ints, Floats]:
    """Moments at which points cross the planes of triangles, within these or beside them.

    Args:
        y: Positions of points at both states, shape (n, 3) each, m.
        v: Vertices of triangles, shape (n, 3, 3) each, m.

    Returns:
        Numbers of the pairs, which may repeat, shape (m,), and parts of the way, shape (m,).
    """
    whole = _bernstein(y, v)
    pairs = np.flatnonzero((whole.min(axis=0) < 0) & (whole.max(axis=0) > 0))
    b = whole[:, pairs]
    ends = _between_extremes(b)
    found, when = [pairs[:0]], [np.zeros(0)]
    for first, last in itertools.pairwise(ends):
        begins = _value(b, first)
        here = np.flatnonzero(begins * _value(b, last) < 0)
        low, high, rises = first[here], last[here], begins[here] < 0
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            before = (_value(b[:, here], middle) < 0) == rises
            low, high = np.where(before, middle, low), np.where(before, high, middle)
        found.append(pairs[here])
        when.append((low + high) / 2)
    return np.concatenate(found), np.concatenate(when)


def _bernstein(y: tuple[Floats, Floats], v: tuple[Floats, Floats]) -> Floats:
    """Coefficients of six times the volume over the way, shape (4, n)."""
    one, two = ([x[:, k] - x[:, 0] for x in v] for k in (1, 2))
    away = [point - x[:, 0] for point, x in zip(y, v, strict=True)]
    found = np.zeros((4, len(y[0])))
    for i, j in itertools.product(range(2), repeat=2):
        normal = np.cross(one[i], two[j])
        for k in range(2):
            found[i + j + k] += np.vecdot(normal, away[k])
    found[1:3] /= 3
    return found


def _value(b: Floats, t: Floats) -> Floats:
    """Value of the cubic at parts of the way, shape (n,)."""
    s = 1 - t
    return np.asarray(((b[0] * s + 3 * b[1] * t) * s + 3 * b[2] * t * t) * s + b[3] * t**3)


def _between_extremes(b: Floats) -> list[Floats]:
    """Ends of intervals without extremes, from 0 to 1, shape (n,) each."""
    d = np.diff(b, axis=0)
    # of the derivative d0 s^2 + 2 d1 s t + d2 t^2
    half, constant, square = d[1] - d[0], d[0], d[0] - 2 * d[1] + d[2]
    root = np.sqrt(np.maximum(half**2 - square * constant, 0.0))
    q = -(half + np.where(half < 0, -root, root))
    with np.errstate(divide="ignore", invalid="ignore"):
        extremes = np.stack([q / square, constant / q])
    inner = np.sort(np.clip(np.nan_to_num(extremes, nan=0.0), 0.0, 1.0), axis=0)
    return [np.zeros(b.shape[1]), *inner, np.ones(b.shape[1])]
