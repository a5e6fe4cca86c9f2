"""Contacts that pass through, pull or slip: obstacles, faces of shells, and joints that roll.

Nodes and points of bodies alone touch obstacles, which may come between them.
"""

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.barrier import first_found
from shellmb.diagnostics.base import Cautions, Watch
from shellmb.model.massless import gathered
from shellmb.model.potentials.contact import ContactGroup
from shellmb.observers.files.output_parts import body_solid
from shellmb.scene.lookup import said
from shellmb.simulate.couplings.faces import FacesCoupling
from shellmb.simulate.simulation import Simulation

# part of the radius of a ball or rod, or of half the thickness of a box: deeper, or through it
# within a step, a point soon leaves on the other side
DEEP = 0.5
# part of the largest penetration by which that of a step is too small: the force is too small, too
SLID = 0.1

# part of the largest pressure of a run; the mean of two steps is looked at, since forces of EP
# alternate
PULL = 1e-3
# part of the speeds that it is the difference of: with 0.1 rad in a step it is 4e-3 in EP
SLIP = 2e-2


class Contacts(Watch):
    """Watches how points move in a step, against the obstacles that they touch."""

    name = "contact"
    remembered = ("_largest",)

    def start(self, simulation: Simulation) -> None:
        """Take the places of the points."""
        groups = simulation.model.contacts
        self._before = {group.item.name: _positions(simulation, group) for group in groups}
        self.idle = not groups

    def accepted(self, simulation: Simulation) -> None:
        """Take the step."""
        for group in simulation.model.contacts:
            name = group.item.name
            start, end = self._before[name], _positions(simulation, group)
            self._before[name] = end
            shape, depth = group.shape, group.penetrations(end)
            wrong = np.where(depth > 0, shape.overrated(start, end), 0.0)
            # what is missed of a penetration, m
            self._note(f"slid {name}", float(np.max(wrong, initial=0.0)), simulation.t)
            if np.isfinite(shape.depth):
                depth = group.penetrations(shape.nearest(start, end))
                # part of the radius
                deepest = float(np.max(depth, initial=0.0)) / shape.depth
                self._note(f"deep {name}", deepest, simulation.t)

    def cautions(self, simulation: Simulation) -> Cautions:
        """The contacts that the steps are too long for."""
        for group in simulation.model.contacts:
            item, name = group.item, group.item.name
            deep, when = self._worst(simulation, f"deep {name}")
            kind = item.obstacle.label
            if deep > DEEP:
                says = (
                    f"{said(item)}: a point of '{group.owner}' comes, or goes in one step, as deep "
                    f"as {deep:.0%} of the {group.shape.extent} of the {kind} (at "
                    f"t = {when:.4g} s), and leaves on the wrong side if it passes "
                    "the middle: use a smaller step or a larger stiffness"
                )
                yield self.caution(group.owner, deep, DEEP, says)
            if simulation.scheme.dynamic:
                yield from impacts(self, group.owner, name, said(item))
            most = np.max(self.columns(f"{name}.penetration")[0, 1:], initial=0.0)
            missed, then = self._worst(simulation, f"slid {name}")
            share = missed / most if most > 0 else 0.0
            if share > SLID:
                says = (
                    f"{said(item)}: '{group.owner}' slides along the {kind} by so much in one step "
                    f"(at t = {then:.4g} s) that the distance is too large by {share:.0%} of the "
                    "largest penetration: forces are too small in such steps; use a smaller step"
                )
                yield self.caution(group.owner, share, SLID, says)


def _positions(simulation: Simulation, group: ContactGroup) -> Floats:
    return group.seen_positions(simulation.problem.levels[group.name].q.x.array)


# part of the largest energy of a contact that comes or goes in one step: of an impact that takes
# n steps it is 3/n
SUDDEN = 0.8


def impacts(watch: Watch, owner: str, name: str, who: str) -> Cautions:
    """A sentence if impacts of a contact are too short for the steps.

    Args:
        watch: The watch that says it.
        owner: Name of the body that has the points.
        name: Name of the contact.
        who: Name of it in sentences.
    """
    t, energy = watch.columns("t", f"{name}.energy")
    change = np.abs(np.diff(energy))
    largest = float(np.max(energy[1:], initial=0.0))
    share = float(np.max(change, initial=0.0)) / largest if largest > 0 else 0.0
    if share > SUDDEN:
        says = (
            f"{who}: {share:.0%} of the largest energy of the contact comes or goes in one step "
            f"(at t = {t[1 + np.argmax(change)]:.4g} s): impacts are shorter than four steps, and "
            "when and where bodies rebound is coarse; use a smaller step or a smaller stiffness"
        )
        yield watch.caution(owner, share, SUDDEN, says)


class TouchingFaces(Watch):
    """Watches how deep points come in a shell, and whether the bodies pass between them."""

    name = "faces of shells"
    remembered = ("_between",)

    def _begin(self) -> None:
        # by contact: first time at which bodies are too near between points, and of the deepest of
        # these intersection, depth, time, place
        self._between: dict[str, tuple[float, tuple[Any, ...]]] = {}

    def start(self, simulation: Simulation) -> None:
        """Take the start."""
        self.idle = not simulation.problem.couplings
        self.accepted(simulation)

    def accepted(self, simulation: Simulation) -> None:
        """See whether bodies intersect."""
        for faces in simulation.problem.couplings:
            found = faces.meeting()
            if found is not None:
                now = (found.intersect, found.depth, simulation.t, *found.place.tolist())
                first, deepest = self._between.get(faces.name, (simulation.t, now))
                self._between[faces.name] = first, max(deepest, now)

    def cautions(self, simulation: Simulation) -> Cautions:
        """Say what is wrong with contacts."""
        for faces in simulation.problem.couplings:
            yield from self._cautions(faces, simulation.scheme.dynamic)

    def _cautions(self, faces: FacesCoupling, dynamic: bool) -> Cautions:
        name, contact = faces.name, faces.contact
        who = said(contact.item)
        if name in self._between:
            first, (intersect, depth, when, *place) = self._between[name]
            what = "intersect" if intersect else "come too near to each other"
            how = "have passed through" if intersect else "meet"
            says = (
                f"{who}: '{contact.body}' and '{contact.shell}' {what} between the points that "
                f"touch (first at t = {first:.4g} s), where edges {how} edges or come between "
                f"nodes: they are {depth:.3g} m too deep at "
                f"({', '.join(f'{c:.4g}' for c in place)}) at t = {when:.4g} s. Only nodes touch; "
                f"use elements whose nodes are nearer to each other than {contact.law.reach:.3g} m "
                "there, or a second contact with both bodies exchanged"
            )
            yield self.caution(contact.body, depth, 0.0, says)
        t, depths = self.columns("t", f"{name}.penetration")
        # in the distance at which it touches
        deep, when = float(depths.max() / contact.law.reach), t[depths.argmax()]
        if deep > DEEP:
            says = (
                f"{who}: a point of '{contact.body}' comes to {1 - deep:.0%} of the distance from "
                f"the mid-surface of '{contact.shell}' at which it begins to touch (at "
                f"t = {when:.4g} s); behind the mid-surface it would leave on the other side: use "
                "a larger stiffness"
            )
            yield self.caution(contact.body, deep, DEEP, says)
        if dynamic:
            yield from impacts(self, contact.body, name, who)


class Lifting(Watch):
    """Watches the normal forces of rolling and knife-edge joints."""

    name = "lifting"
    remembered = ("_last", "_press", "_largest")

    def _begin(self) -> None:
        self._last: dict[str, float] = {}
        # the largest pressure
        self._press: dict[str, float] = {}

    def start(self, simulation: Simulation) -> None:
        """Find the joints."""
        self._groups = simulation.model.mechanism.contacts
        self.idle = not self._groups

    def accepted(self, simulation: Simulation) -> None:
        """Take the forces of the step."""
        for group in self._groups:
            q = simulation.problem.levels[group.name].q.x.array
            forces = gathered(group.nodes, group.sliding(q, 0 * q)[:, 4])
            for name, force in zip(group.labels, forces.tolist(), strict=True):
                mean = (force + self._last.get(name, force)) / 2
                self._last[name] = force
                self._press[name] = max(self._press.get(name, 0.0), abs(mean))
                self._note(name, -mean, simulation.t)

    def cautions(self, simulation: Simulation) -> Cautions:
        """The contacts that pull."""
        for name, (pull, when) in self._largest.items():
            share = pull / self._press[name]
            if share > PULL:
                bound = simulation.model.mechanism.joints[name]
                says = (
                    f"{bound.joint.said} pulls at '{bound.joint.second}' by up to {pull:.3g} N (at "
                    f"t = {when:.4g} s): it would lift off, and the joint holds it down; load it "
                    "more, or move it more slowly"
                )
                yield self.caution(bound.joint.second, share, PULL, says)


class Slipping(Watch):
    """Looks at the end of a run at the slip of contacts, which EP leaves."""

    name = "slipping"

    def cautions(self, simulation: Simulation) -> Cautions:
        """The contacts that slip by more than that."""
        for group in simulation.model.mechanism.contacts:
            levels = simulation.problem.levels[group.name]
            slips = group.sliding(levels.q.x.array, levels.rates["v"].x.array)
            shares = gathered(group.nodes, slips[:, 0] / np.maximum(slips[:, 1], 1e-300))
            for share, bound in zip(shares.tolist(), group.joints, strict=True):
                if share > SLIP:
                    joint = bound.joint
                    says = (
                        f"{joint.said} slips by {share:.1%} of its speeds at the end of the run: "
                        "use --scheme ep4, --scheme ed3 or a smaller step"
                    )
                    yield self.caution(joint.second, share, SLIP, says)


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


class _Nodes(NamedTuple):
    """Lines between neighbouring nodes.

    Args:
        group: The contact.
        segments: Pairs of neighbours, shape (m, 2).
    """

    group: ContactGroup
    segments: Ints

    what: str = "nodes"
    advice: str = "use smaller elements there"

    def missed(self, simulation: Simulation) -> float:
        """By how much lines are deeper than the nodes, part of the obstacle's depth; collective."""
        group, segments = self.group, self.segments
        q = simulation.problem.levels[group.name].q.x.array
        x = gathered(group.nodes, group.seen_positions(q))
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
