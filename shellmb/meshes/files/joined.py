"""Nodes that lie on one another become one, or leave gaps; cells without area or twice; sides.

A whole surface has one side: normals of its cells are consistently oriented.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from shellmb.arrays import Floats, Ints
from shellmb.errors import SceneError
from shellmb.meshes.files.kinds import Block
from shellmb.meshes.raw import FACETS, Cell, RawMesh, boundary_facets, cell_cross, ties

# sides shorter than this part of the longest side of their cell are none, and cells with less
# height than this part of their longest side have no area
NOTHING = 1e-6

# a node lies on a side or a cell that is nearer than this part of the sides around both
NEAR = 1e-2
# and on a side that the nodes between its ends pass at this part of its length, as an arc does
ARC = 0.15
# part of a side at its ends where nodes lie on the end
END = 0.02
# of a triangle's area what lies beside it is on its side
SHARP = 1e-9
# triangles that a cell is made of, by its number of nodes in the order of DOLFINx
_QUARTERS = ((0, 4, 5, 8), (4, 1, 8, 6), (5, 8, 2, 7), (8, 6, 7, 3))
PIECES = {
    3: [(0, 1, 2)],
    6: [(0, 5, 4), (5, 1, 3), (4, 3, 2), (5, 3, 4)],
    4: [(0, 1, 3), (0, 3, 2)],
    9: [piece for a, b, c, d in _QUARTERS for piece in ((a, b, d), (a, d, c))],
}


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
    label = components(len(x), *pairs.T)
    _, first = np.unique(label, return_index=True)
    return np.asarray(first[label], dtype=np.int64), far


def components(count: int, first: Ints, second: Ints) -> Ints:
    """A number of each of some things, which is the same for those that pairs tie together.

    Args:
        count: How many things there are.
        first: The first of each pair.
        second: The second of each pair.
    """
    graph = scipy.sparse.coo_array((np.ones(len(first)), (first, second)), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1])


def empty(x: Floats, block: Block) -> np.ndarray:
    """Cells without area: their corners are on one line, or are fewer than three.

    Args:
        x: Positions of the nodes.
        block: The cells.
    """
    longest = sides(x, block.rows, block.cell).max(axis=1, initial=0.0)
    # the largest triangle of corners counts, so that no sides are taken from one another
    thirds = [(0, 1, 2), (1, 3, 2), (0, 1, 3), (0, 3, 2)][: 1 if block.cell == "tri" else 4]
    a, b, c = np.moveaxis(x[block.vertices[:, thirds]], 2, 0)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=2)
    return np.asarray(areas.max(axis=1) <= NOTHING * longest**2)


def doubles(block: Block) -> Ints:
    """Cells whose corners another one has before them."""
    corners = np.sort(block.vertices, axis=1)
    _, first = np.unique(corners, axis=0, return_index=True)
    return np.setdiff1d(np.arange(len(corners)), first)


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
    label, over = components(2 * count, *ends).reshape(2, count)
    if np.any(label == over):
        raise SceneError(
            f"shell '{name}': its mesh has one side only, like a Moebius strip; "
            "cut it into shells that have two and join them"
        )
    # the first cell of a part, as it is, has the smaller label
    sign, part = np.where(label < over, 1.0, -1.0), np.minimum(label, over)
    sign *= np.where(np.bincount(part, sign) < 0, -1.0, 1.0)[part]
    return np.asarray(cell_cross(x[cells[:, : len(ROUND[cell])]]) * sign[:, None])


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


@dataclass(frozen=True)
class Gap:
    """A side with nodes on it that it is not joined to, or a node on a cell or another node.

    Args:
        ends: Ends of the side, or the node, shape (2 or 1, 3).
        nodes: Numbers of the nodes that lie on it.
    """

    ends: Floats
    nodes: tuple[int, ...]

    @property
    def length(self) -> float:
        """Length of the side, 0 of a node on a cell."""
        return float(np.linalg.norm(self.ends[-1] - self.ends[0]))


def crossings(raw: RawMesh) -> Floats:
    """Places where lines between nodes of cells pass through other cells, shape (n, 3).

    Cells are triangles between their nodes. Nodes that lie on cells are gaps.

    Args:
        raw: The mesh.
    """
    triangles, corners, middle, radius, normal = _pieces(raw.x, raw.cells)
    lines = np.unique(np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)), axis=0)
    ends = raw.x[lines]
    half = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / 2
    size, found = np.floor(np.log2(half)), [np.zeros((0, 3))]
    for own in (np.flatnonzero(size == each) for each in np.unique(size)):
        reach = radius + half[own].max()
        for some, k in _candidates(ends[own].mean(axis=1), middle, reach):
            n = own[some]
            # from both of its ends, which are away by more than what lies on it
            away = np.einsum("nex,nx->ne", ends[n] - middle[k][:, None], normal[k])
            far = NEAR * np.minimum(half[n], radius[k]) * np.linalg.norm(normal[k], axis=1)
            through = (away.min(axis=1) < -far) & (away.max(axis=1) > far)
            n, k, away = n[through], k[through], away[through]
            share = (away[:, 0] / (away[:, 0] - away[:, 1]))[:, None]
            place = (1 - share) * ends[n, 0] + share * ends[n, 1]
            other = (lines[n][:, :, None] != triangles[k][:, None]).all(axis=(1, 2))
            found.append(place[other & (_least_share(place, corners[k], normal[k]) > -SHARP)])
    return np.concatenate(found)


def _pieces(x: Floats, cells: Ints) -> tuple[Ints, Floats, Floats, Floats, Floats]:
    """Triangles of cells: nodes, corners, middles, radii about these, normals of twice the area."""
    nodes = cells[:, np.array(PIECES[cells.shape[1]])].reshape(-1, 3)
    corners = x[nodes]
    middle, normal = corners.mean(axis=1), np.cross(*np.diff(corners, axis=1).swapaxes(0, 1))
    return nodes, corners, middle, np.linalg.norm(corners - middle[:, None], axis=2).max(1), normal


def _least_share(place: Floats, corners: Floats, normal: Floats) -> Floats:
    """Least of the shares of the corners of triangles in places there; outside it is negative."""
    sides = np.roll(corners, -1, axis=1) - corners
    areas = np.einsum("nex,nx->ne", np.cross(sides, place[:, None] - corners), normal)
    return np.asarray(areas.min(axis=1) / np.sum(normal**2, axis=1))


def gaps(raw: RawMesh) -> list[Gap]:
    """All places where nodes lie on sides or cells that do not have them.

    Args:
        raw: The mesh.
    """
    search = _Search(raw)
    on_sides, at_ends, done = search.on_sides()
    alone = sorted({*at_ends, *search.on_cells()} - done)
    return on_sides + [Gap(raw.x[[node]], (node,)) for node in alone]


class _Search:
    """Part of a mesh that the search needs."""

    def __init__(self, raw: RawMesh) -> None:
        self.x = raw.x
        self.cells = raw.cells
        self.corners = raw.vertices
        self.short = sides(raw.x, raw.cells, raw.cell).min(axis=1)
        self.size = np.full(len(raw.x), np.inf)
        np.minimum.at(self.size, self.corners.ravel(), np.repeat(self.short, self.corners.shape[1]))
        # the only cell of each side of the boundary
        self.sides, self.owner = boundary_facets(raw.cells, raw.cell)

    def on_sides(self) -> tuple[list[Gap], set[int], set[int]]:
        """Sides of the boundary with nodes of the boundary on them.

        Of two sides that lie on one another the first is listed.

        Returns:
            The sides, nodes at ends of others, and all nodes that the former name.
        """
        at_ends: set[int] = set()
        done: set[int] = set()
        if not len(self.sides):
            return [], at_ends, done
        listed: set[tuple[int, ...]] = set()
        nodes = np.unique(self.sides)
        ends = self.x[self.sides]
        middle, along = ends.mean(axis=1), ends[:, 1] - ends[:, 0]
        length = np.linalg.norm(along, axis=1)
        found, beside = [], ties(self.sides)
        for some, near in _candidates(self.x[nodes], middle, length * (0.5 + ARC)):
            p, s = nodes[some], near
            own = (self.sides[s] == p[:, None]).any(axis=1)
            own |= (self.corners[self.owner[s]] == p[:, None]).any(axis=1)
            p, s = p[~own], s[~own]
            from_start = self.x[p] - ends[s, 0]
            t = np.einsum("ij,ij->i", from_start, along[s]) / length[s] ** 2
            away = np.linalg.norm(from_start - np.clip(t, 0.0, 1.0)[:, None] * along[s], axis=1)
            close = away <= NEAR * np.minimum(self.size[p], self.short[self.owner[s]])
            arc = (away <= ARC * length[s]) & (t > END) & (t < 1 - END)
            for side in np.unique(s[close | arc]):
                on = s == side
                between = on & (t > END) & (t < 1 - END)
                touching = set(p[on & close].tolist())
                inside = set(p[between & (close | arc)].tolist())
                a, b = self.sides[side].tolist()
                partner = set(self._arc(a, b, inside, beside))
                both = (on & close & (t <= END)).any() and (on & close & (t >= 1 - END)).any()
                if not (partner or both or (between & close).any()):
                    at_ends |= touching
                    continue
                nodes_on = tuple(sorted(touching | partner))
                if nodes_on not in listed:
                    listed.add((a, b))
                    done |= {a, b, *nodes_on}
                    found.append(Gap(ends[side], nodes_on))
        return found, at_ends, done

    def _arc(self, a: int, b: int, inside: set[int], beside: dict[int, set[int]]) -> list[int]:
        """Nodes between the ends of a side that lead along the boundary from one to the other.

        What is longer than an arc of its height is no partner of the side but another border.
        """
        for first in beside[a] & inside:
            chain = [a, first]
            while chain[-1] != b:
                ahead = (beside[chain[-1]] & (inside | {b})) - set(chain)
                if not ahead:
                    break
                chain.append(ahead.pop())
            if chain[-1] != b:
                continue
            x = self.x[chain]
            chord = x[-1] - x[0]
            length = float(np.linalg.norm(chord))
            path = float(np.linalg.norm(np.diff(x, axis=0), axis=1).sum())
            unit = chord / length
            height = np.linalg.norm(x - x[0] - np.outer((x - x[0]) @ unit, unit), axis=1).max()
            if path - length <= 4 * height**2 / length + 1e-9 * length:
                return chain[1:-1]
        return []

    def on_cells(self) -> list[int]:
        """Nodes that lie in a cell that they share no neighbouring cell with."""
        nodes, count, found = np.unique(self.corners), len(self.corners), list[Ints]()
        _, corners, middle, radius, normal = _pieces(self.x, self.cells)
        twice, each = np.linalg.norm(normal, axis=1), len(corners) // count
        for some, k in _candidates(self.x[nodes], middle, radius * (1 + NEAR)):
            p = nodes[some]
            away = np.abs(np.einsum("ij,ij->i", self.x[p] - middle[k], normal[k]))
            near = NEAR * np.minimum(self.size[p], self.short[k // each])
            keep = (away <= near * twice[k]) & (twice[k] > 0)
            p, k = p[keep], k[keep]
            inside = _least_share(self.x[p], corners[k], normal[k]) >= -NEAR
            found.append(p[inside] * count + k[inside] // each)
        keys = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *found]))
        # those that are not among the cells around or beside the node
        every = np.repeat(np.arange(count), self.corners.shape[1])
        having = scipy.sparse.coo_array(
            (np.ones(every.size), (every, self.corners.ravel())), shape=(count, len(self.x))
        ).tocsr()
        beside = (having.T @ (having @ having.T)).tocoo()
        alone = np.setdiff1d(keys, beside.coords[0].astype(np.int64) * count + beside.coords[1])
        return np.unique(alone // count).tolist()


def _candidates(points: Floats, middles: Floats, radii: Floats) -> Iterator[tuple[Ints, Ints]]:
    """Pairs of points and spheres that may hold them, class by class of the spheres' size."""
    tree = cKDTree(points)
    classes = np.floor(np.log2(np.maximum(radii, np.finfo(float).tiny)))
    for each in np.unique(classes):
        members = np.flatnonzero(classes == each)
        lists = tree.query_ball_point(middles[members], radii[members])
        counts = np.array([len(some) for some in lists])
        if counts.sum():
            some = np.concatenate([np.array(s, dtype=np.int64) for s in lists if len(s)])
            yield some, np.repeat(members, counts)
