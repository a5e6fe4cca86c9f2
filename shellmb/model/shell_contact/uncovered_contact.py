"""Places where bodies come too near to each other between the points that touch."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from shellmb.arrays import Bools, Floats, Ints
from shellmb.model.shell_contact.facets import Facets, around, nearest, pairs_near

# part of the distance at which bodies touch by which lines are deeper than the nodes at their ends:
# as of obstacles (`diagnostics.contacts`)
BETWEEN = 0.1
# parts of a line, or of an element, by which something may miss it
BESIDE = 1e-9


class Meeting(NamedTuple):
    """Place where bodies are too near.

    Args:
        depth: By how much they should be further apart there, m.
        place: The place, shape (3,), m.
        intersect: Whether mid-surfaces pass through each other.
    """

    depth: float
    place: Floats
    intersect: bool


@dataclass(frozen=True)
class Lines:
    """Lines between nodes of one body, and the facets of the other one.

    Args:
        lines: Nodes at the ends of lines, shape (l, 2).
        facets: Facets.
        apart: Which cells of the facets may touch which nodes, shape (n, cells); None: all.
    """

    lines: Ints
    facets: Facets
    apart: Bools | None

    def may(self, line: Ints, cell: Ints) -> Bools:
        """Decide which lines and cells are not parts of one place of a shell."""
        if self.apart is None:
            return np.ones(len(line), dtype=bool)
        return np.asarray(self.apart[self.lines[line], cell[:, None]].all(axis=1))

    @cached_property
    def _rim(self) -> tuple[Ints, Ints]:
        """Sides that one cell has alone, shape (m, 2), and their cells."""
        every = np.sort(_every_side(self.facets), axis=1)
        _, first, counts = np.unique(every, axis=0, return_index=True, return_counts=True)
        alone = first[counts == 1]
        return every[alone], alone % len(self.facets.cells)

    def through(self, y: Floats, x: Floats) -> list[Meeting]:
        """Places where lines pass through facets.

        Args:
            y: Positions of the nodes of the lines, m.
            x: Positions of the nodes of the facets, m.
        """
        if not len(self.lines):
            return []
        ends = y[self.lines]
        half = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / 2
        line, triangle = around(self.facets, ends.mean(axis=1), x, half)
        ends, v = ends[line], self.facets.places(x, triangle)
        normal = np.cross(v[:, 1] - v[:, 0], v[:, 2] - v[:, 0])
        sides = np.vecdot(normal[:, None], ends - v[:, :1])
        here = (sides[:, 0] * sides[:, 1] < 0) & self.may(line, self.facets.cell[triangle])
        ends, v, sides, normal = ends[here], v[here], sides[here], normal[here]
        share = sides[:, 0] / (sides[:, 0] - sides[:, 1])
        at = ends[:, 0] + share[:, None] * (ends[:, 1] - ends[:, 0])
        sizes = np.linalg.norm(v - np.roll(v, 1, axis=1), axis=2).max(axis=1)
        hits = nearest(at, v).distance <= BESIDE * sizes
        deep = abs(sides).min(axis=1) / np.linalg.norm(normal, axis=1)
        found = []
        for place, depth in zip(at[hits], deep[hits], strict=True):
            rest = x[self._rim[0]]
            far = float("inf")
            if len(rest):
                _, away = closest(np.array([place, place])[None].repeat(len(rest), 0), rest)
                far = float(np.linalg.norm(away, axis=1).min())
            found.append(Meeting(min(float(depth), far), place, True))
        return found

    def beside(self, y: Floats, x: Floats, reach: float) -> list[Meeting]:
        """Places where lines are nearer to the rim of the facets than nodes at their ends are.

        Args:
            y: Positions of the nodes of the lines, m.
            x: Positions of the nodes of the facets, m.
            reach: Distance at which nodes touch, m.
        """
        sides, cells = self._rim
        if not len(sides) or not len(self.lines):
            return []
        ends, edges = y[self.lines], x[sides]
        half, widest = (np.linalg.norm(e[:, 1] - e[:, 0], axis=1) / 2 for e in (ends, edges))
        middles = edges.mean(axis=1)
        line, edge = pairs_near(middles, ends.mean(axis=1), half + widest.max() + reach)
        may = self.may(line, cells[edge])
        line, edge = line[may], edge[may]
        share, away = closest(ends[line], edges[edge])
        depth = reach - np.linalg.norm(away, axis=1)
        within = (share > BESIDE) & (share < 1 - BESIDE) & (depth > BETWEEN * reach)
        found = []
        for k in np.flatnonzero(within):
            both = ends[line[k]]
            owner, triangle = around(self.facets, both, x, np.full(2, reach))
            near = nearest(both[owner], self.facets.places(x, triangle)).distance
            more = float(depth[k] - max(0.0, reach - near.min(initial=reach)))
            if more > BETWEEN * reach:
                place = both[0] + share[k] * (both[1] - both[0])
                found.append(Meeting(float(depth[k]), place, False))
        return found


@dataclass(frozen=True)
class Between:
    """Two bodies between their nodes.

    Args:
        segments: Gives lines between neighbouring points of the body.
        facets: Facets of the shell.
        own: Facets of the body, of its points; None: it is a beam, only parts of it touch, or it is
            the shell itself.
        apart: Which cells of the shell may touch which points; None: all.
        reach: Distance at which they touch, m.
    """

    segments: Callable[[], Ints]
    facets: Facets
    own: Facets | None
    apart: Bools | None
    reach: float

    @cached_property
    def _lines(self) -> tuple[Lines, Lines | None]:
        first = Lines(self.segments(), self.facets, self.apart)
        if self.own is None:
            return first, None
        sides = np.unique(np.sort(_every_side(self.facets), axis=1), axis=0)
        return first, Lines(sides, self.own, None)

    def meeting(self, y: Floats, x: Floats, slack: float) -> Meeting | None:
        """Deepest place between the points, if there is one; intersections come first.

        Args:
            y: Positions of all points of the body, m.
            x: Positions of the nodes of the shell, m.
            slack: Distance that no point is nearer than, m; zero: it is not known.
        """
        one, other = self._lines
        pairs = [(one, y, x), *([] if other is None else [(other, x, y)])]
        longest = max(
            float(np.max(np.linalg.norm(a[of.lines[:, 1]] - a[of.lines[:, 0]], axis=1), initial=0))
            for of, a, _ in pairs
        )
        if slack > longest:
            return None
        depth = attrgetter("depth")
        found = [m for of, a, b in pairs for m in of.through(a, b)]
        if found:
            deepest = max(found, key=depth)
            return deepest._replace(depth=deepest.depth + self.reach)
        return max(one.beside(y, x, self.reach), default=None, key=depth)


def _every_side(facets: Facets) -> Ints:
    """Sides of all cells: first ones, then second ones, and so on."""
    following = np.roll(facets.cells, -1, axis=1)
    return np.stack([facets.cells.T.ravel(), following.T.ravel()], axis=1)


def closest(one: Floats, other: Floats) -> tuple[Floats, Floats]:
    """Closest places of lines, shape (n, 2, 3) each.

    Args:
        one: Ends of the first line of each pair, m.
        other: Ends of the second one, m.

    Returns:
        Share of the first line, shape (n,), and vectors from the second one, shape (n, 3), m.
    """
    d, e, r = one[:, 1] - one[:, 0], other[:, 1] - other[:, 0], one[:, 0] - other[:, 0]
    dd, de, ee = np.vecdot(d, d), np.vecdot(d, e), np.vecdot(e, e)
    dr, er = np.vecdot(d, r), np.vecdot(e, r)
    det = dd * ee - de**2
    oblique = det > 1e-12 * dd * ee
    share = np.clip(np.where(oblique, de * er - dr * ee, 0.0) / np.where(oblique, det, 1.0), 0, 1)
    t = np.clip((de * share + er) / ee, 0.0, 1.0)
    share = np.clip((de * t - dr) / np.where(dd > 0, dd, 1.0), 0.0, 1.0)
    return share, r + share[:, None] * d - t[:, None] * e
