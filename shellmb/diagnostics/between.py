"""Obstacles that come between the nodes or points of a body, which alone touch them."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.barrier import first_found
from shellmb.diagnostics.base import Cautions, Watch
from shellmb.model.potentials.contact import ContactGroup
from shellmb.observers.files.solids import body_solid
from shellmb.scene.lookup import said
from shellmb.simulate.simulation import Simulation

# depth that nodes miss, part of the radius of a ball or rod, or of half the thickness of a box: of
# a ball that lies between two nodes it is an eighth of the square of their distance in radii
MISSED = 0.1


class Between(Watch):
    """Watches what is between nodes, or points of rigid bodies, against obstacles they touch."""

    name = "between nodes"
    remembered = ("_largest",)

    def start(self, simulation: Simulation) -> None:
        """Find what is between nodes and points, and what is missed at the start."""
        self._lines: list[_Nodes | Outline] = []
        rigid = {body.name for body in simulation.model.scene.rigid_bodies}
        for group in simulation.model.contacts:
            if np.isfinite(group.shape.depth):
                segments = group.points.segments()
                if len(segments):
                    self._lines.append(_Nodes(group, segments))
                elif group.owner in rigid:
                    self._lines.append(Outline(simulation, group))
        self.idle = not self._lines
        self.accepted(simulation)

    def accepted(self, simulation: Simulation) -> None:
        """Take the step."""
        for lines in self._lines:
            # part of the radius
            self._note(lines.group.item.name, lines.missed(simulation), simulation.t)

    def cautions(self, simulation: Simulation) -> Cautions:
        """The contacts whose obstacles come between nodes."""
        for lines in self._lines:
            group, item = lines.group, lines.group.item
            missed, when = self._noted(item.name)
            if missed <= MISSED:
                continue
            says = (
                f"{said(item)}: between its {lines.what} '{group.owner}' is deeper in the "
                f"{group.shape.label} than at them, by {missed:.0%} of its "
                f"{group.shape.extent} (at t = {when:.4g} s): only {lines.what} touch, so the "
                f"{group.shape.label} passes between them; {lines.advice}"
            )
            yield self.caution(group.owner, missed, MISSED, says)


@dataclass(frozen=True)
class _Nodes:
    """Lines between neighbouring nodes.

    Args:
        group: The contact.
        segments: Pairs of neighbours, shape (m, 2).
    """

    group: ContactGroup
    segments: Ints

    what = "nodes"
    advice = "use smaller elements there"

    def missed(self, simulation: Simulation) -> float:
        """By how much lines are deeper than the nodes, part of the obstacle's depth; collective."""
        group, segments = self.group, self.segments
        q = simulation.problem.levels[group.name].q.x.array
        x = group.everywhere(group.seen_positions(q))
        depth = group.penetrations(x)[segments].max(axis=1)
        a, b = x[segments[:, 0]], x[segments[:, 1]]
        near = depth > -np.linalg.norm(b - a, axis=1)
        if not near.any():
            return 0.0
        between = group.penetrations(group.shape.nearest(a[near], b[near]))
        missed = np.max(between - np.maximum(depth[near], 0.0), initial=0.0)
        return float(missed) / group.shape.depth


# lines across a triangle: so many in the depth of an obstacle, and at most
FINE, ACROSS = 4, 64
# parts of the largest extent: points are on a line, or in a plane
FLAT = 1e-9


class Outline:
    """Lines across the shape of a rigid body, or across the hull of the points that touch.

    Args:
        simulation: The run.
        group: A contact of the points of the body.
    """

    what = "points"
    advice = "give the body more points there, and name them in at"

    def __init__(self, simulation: Simulation, group: ContactGroup) -> None:
        self.group = group
        points = np.array([end.point for end in group.points.ends])
        bodies = {body.name: body for body in simulation.model.scene.rigid_bodies}
        body = bodies[group.owner]
        self._solid = None if body.shape is None else body_solid(body)
        self._points, self._middle = points, points.mean(axis=0, keepdims=True)
        self._corners = points if self._solid is None else self._solid.points
        self._reach = float(np.max(np.linalg.norm(self._corners - self._middle, axis=1)))

    @cached_property
    def _across(self) -> tuple[Floats, Floats]:
        """Ends of the lines, once the obstacle is near: for a hull much of SciPy is imported."""
        triangles = hull(self._corners) if self._solid is None else self._solid.triangles
        return _lines(self._corners[triangles], self.group.shape.depth / FINE)

    def missed(self, simulation: Simulation) -> float:
        """By how much lines are deeper than the points, part of the obstacle's depth; collective.

        Args:
            simulation: The run.
        """
        move, shape = _motion(simulation, self.group), self.group.shape
        if shape.normals(move(self._middle))[1][0] > self._reach or not len(self._across[0]):
            return 0.0
        depth = max(float(np.max(self.group.penetrations(move(self._points)))), 0.0)
        surface = shape.nearest(*map(move, self._across))
        # the surface is where it is, and points touch at their radius
        return (float(np.max(-shape.normals(surface)[1])) - depth) / shape.depth


def _motion(simulation: Simulation, group: ContactGroup) -> Any:
    """The motion of a rigid body as an obstacle sees it, of positions in the reference."""
    X, D, x, d = _frame(simulation, group.owner)
    carrier = group.item.obstacle_body
    seen = None if carrier is None else _frame(simulation, carrier)

    def move(at: Floats) -> Floats:
        now = x + (at - X) @ D.T @ d
        if seen is not None:
            now = seen[0] + (now - seen[2]) @ seen[3].T @ seen[1]
        return np.asarray(now)

    return move


def _frame(simulation: Simulation, name: str) -> tuple[Floats, Floats, Floats, Floats]:
    """Place and directors of a rigid body in the reference, and now; collective."""
    body, nodes, X, D = simulation.model.nodes_of(name)
    found = None
    if len(nodes):
        q, node = simulation.problem.levels[body.name].q.x.array, nodes[0]
        u, w = (q[body.mixed.dofs[part].reshape(-1, n)[node]] for part, n in (("u", 3), ("w", 9)))
        found = X[0], D[0], X[0] + u, D[0] + w.reshape(3, 3)
    found = first_found(simulation.model.comm, found)
    assert found is not None
    return found


def hull(points: Floats) -> Ints:
    """Triangles of the convex hull of points, in numbers of these; of a line the line twice.

    Args:
        points: The points, shape (n, 3), m.
    """
    from scipy.spatial import ConvexHull, Delaunay

    r = points - points.mean(axis=0)
    _, sizes, axes = np.linalg.svd(r, full_matrices=False)
    rank = int(np.sum(sizes > FLAT * sizes[0])) if len(points) > 1 else 0
    if rank == 0:
        return np.zeros((0, 3), dtype=np.int64)
    if rank == 1:
        order = np.argsort(r @ axes[0])
        ends = order[0], order[-1]
        return np.array([[ends[0], ends[1], ends[1]]])
    if rank == 2:
        return np.asarray(Delaunay(r @ axes[:2].T).simplices, dtype=np.int64)
    return np.asarray(ConvexHull(r).simplices, dtype=np.int64)


def _lines(corners: Floats, apart: float) -> tuple[Floats, Floats]:
    """Lines across triangles (n, 3, 3), at most so far apart, m, but of not too many."""
    first, last = [np.zeros((0, 3))], [np.zeros((0, 3))]
    for a, b, c in corners:
        longest = max(float(np.linalg.norm(b - a)), float(np.linalg.norm(c - a)))
        count = min(int(np.ceil(longest / apart)), ACROSS) if len(corners) <= ACROSS else 1
        share = np.arange(1, max(count, 1) + 1)[:, None] / max(count, 1)
        first += [a[None], a[None], a + share * (b - a)]
        last += [b[None], c[None], a + share * (c - a)]
    return np.concatenate(first), np.concatenate(last)
