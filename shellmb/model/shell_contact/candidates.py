"""Points and facets that may come near to each other, by a tree of the facets' middles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from shellmb.arrays import Bools, Floats, Ints
from shellmb.model.shell_contact.facets import Facets, nearest

if TYPE_CHECKING:
    from scipy.spatial import cKDTree


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


def _tree(facets: Facets, x: Floats) -> tuple[cKDTree, float]:
    """Middles of all triangles, and the largest distance of a vertex from its one, m."""
    # loaded where there are such contacts only
    from scipy.spatial import cKDTree

    v = facets.places(x, np.arange(len(facets.cell)))
    middles = v.mean(axis=1)
    return cKDTree(middles), float(np.max(np.linalg.norm(v - middles[:, None], axis=2)))


def _pairs(tree: cKDTree, y: Floats, distance: Any) -> tuple[Ints, Ints]:
    lists = tree.query_ball_point(y, distance, return_sorted=True)
    counts = np.array([len(some) for some in lists])
    found = [np.array(some, dtype=np.int64) for some in lists]
    return np.repeat(np.arange(len(y)), counts), np.concatenate(found)
