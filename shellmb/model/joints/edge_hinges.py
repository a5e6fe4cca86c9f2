"""Edges of shells that turn about one another: points along the edges, their frames and angles.

At each node of one edge the place on the other is held (a spherical joint). The angle of the
directors about the edge is that of unit vectors `p` and `r`, across it in either surface, and `n`
completes a frame. All three are unknowns of quadratic rows, with the directors `d1, d2` and the
tangent `t` of the edge, which is linear in the nodes around:

    p . p = 1,  p . t = 0,  p . d1 = 0
    n . n = 1,  n . t = 0,  n . p = 0
    r . r = 1,  r . t = 0,  r . d2 = 0

So `(n . r, p . r)` are cosine and sine of an angle, quadratic in the unknowns, of length one, and
all that is true of rotations of joints (`forms.constraints.coordinates`) is true here. Directors
are free to lean along the edge. On a rigid body or the ground there is a frame already, and `r`
alone is unknown. Where nodes of two edges do not coincide, those of the finer edge are held on the
other one, between its nodes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from mpi4py import MPI

import numpy as np
import ufl
from ufl.core.expr import Expr

from shellmb.arrays import Floats, Ints
from shellmb.errors import SceneError
from shellmb.meshes.nodes import constant_vector, node_mesh, node_space
from shellmb.model.body import PartScale
from shellmb.model.identification import node_links
from shellmb.model.joints.constraints import ConstraintGroup
from shellmb.model.joints.coordinates import BoundCoordinate, global_dofs
from shellmb.model.joints.joints import BoundJoint, FindEnd
from shellmb.model.joints.regions import BoundNode
from shellmb.model.locations.ends import End
from shellmb.model.locations.nodes import ON_NODE, Nodes, shared_nodes
from shellmb.model.shells.shell import ShellModel
from shellmb.scene.multibody.edge_hinges import EdgeHinge

__all__ = ["EdgeFrames", "Hinge", "bind_hinges", "hinge_line"]

# directors and given axes are across and along an edge to this, rad
ALIGNED = 1e-6


@dataclass(frozen=True)
class _Edge:
    """An edge of a shell: its nodes along the axis, and where they are on it.

    Args:
        shell: The shell.
        nodes: Its nodes.
        s: Where they are along the axis, ascending, m.
    """

    shell: ShellModel
    nodes: Nodes
    s: Floats

    def end(self, k: int) -> End:
        """A node as a place."""
        dofs = {part: self.nodes.dofs[part][k] for part in ("u", "w")}
        x = self.nodes.x[k]
        return End(self.shell.name, self.shell.name, dofs, x, self.nodes.directors[k], x)

    def at(self, x: Floats, joint: EdgeHinge, other: _Edge) -> float:
        """Where on it a node of another edge is, m.

        Raises:
            SceneError: If that is not on this edge.
        """
        start, along = self.nodes.x[0], self.s[-1] - self.s[0]
        direction = (self.nodes.x[-1] - start) / along
        s = float((x - start) @ direction)
        away = max(float(np.linalg.norm(x - start - s * direction)), -s, s - along)
        if away > 2 * ON_NODE * self.shell.surface_mesh.length:
            raise SceneError(
                f"{joint.said}: a node of shell '{other.shell.name}' is {away:.3g} away from the "
                f"edge of shell '{self.shell.name}'; the edges must lie on each other, and the one "
                "with more nodes within the other"
            )
        return s + float(self.s[0])

    def shares(self) -> Floats:
        """Share of each node in the length of the edge, by the rule that its nodes are those of."""
        degree = self.shell.shell.degree
        rule = np.array([1, 4, 1]) / 6 if degree == 2 else np.array([1, 3, 3, 1]) / 8
        found = np.zeros(len(self.s))
        for k in range(0, len(self.s) - 1, degree):
            found[k : k + degree + 1] += rule * (self.s[k + degree] - self.s[k])
        return found / found.sum()


class _Sum(NamedTuple):
    """A vector as a weighted sum of nodal vectors of a body.

    Args:
        body: Name of the body in the system.
        dofs: Global dofs of the nodal vectors, shape (m, 3).
        weights: Their weights, shape (m,).
    """

    body: str
    dofs: Ints
    weights: Floats


@dataclass(frozen=True)
class _Point:
    """A point of a hinge.

    Args:
        label: Name of the hinge.
        x: Its place, shape (3,), m.
        axis: Axis of the hinge, shape (3,).
        normals: Directors of both shells there, of a frame the second one's twice, shape (2, 3).
        tangent: Change of the tangent: of nodes around it on an edge, or directors of a frame.
        director: Change of the director of the first shell; None: it is a frame.
        place: Displacement of the point, of one node or of several around it.
        second: Change of the second shell's director.
    """

    label: str
    x: Floats
    axis: Floats
    normals: Floats
    tangent: _Sum
    director: _Sum | None
    place: _Sum
    second: _Sum

    @property
    def key(self) -> tuple[int, int, int]:
        """What points must have in common to share their kernels: numbers of nodes around them."""
        across = 0 if self.director is None else len(self.director.weights)
        return len(self.tangent.weights), across, len(self.place.weights)

    @property
    def vectors(self) -> Floats:
        """Vectors `n, p, r` in the reference configuration as rows, shape (3, 3)."""
        first, second = self.normals / np.linalg.norm(self.normals, axis=1, keepdims=True)
        p, r = np.cross(self.axis, first), np.cross(self.axis, second)
        p, r = p / np.linalg.norm(p), r / np.linalg.norm(r)
        return np.array([np.cross(p, self.axis), p, r])


@dataclass(frozen=True)
class _OnFrame(BoundNode):
    """A node that is held on a frame, which moments of the hinge are taken on."""

    @property
    def vectors(self) -> tuple[int, int]:
        """The frame matters also where the node is at its origin."""
        return 3, 0


class EdgeFrames(ConstraintGroup):
    """Vectors across edges of shells at points of hinges, as unknowns.

    Args:
        name: Name in the system.
        comm: Communicator.
        points: The points, all of one `key`.
        force: Size of forces, N.
        length: Size of the scene, m.
    """

    def __init__(
        self, name: str, comm: MPI.Comm, points: Sequence[_Point], force: float, length: float
    ) -> None:
        along, across, inside = points[0].key
        between = inside > 1
        nodes = node_mesh(comm, len(points))
        own = [*(("n", "p") if across else ()), "r", *(("u",) if between else ())]
        sums = {"t": [p.tangent for p in points], "d": [p.second for p in points]}
        sums |= {"a": [p.director for p in points if p.director is not None]} if across else {}
        sums |= {} if between else {"u": [p.place for p in points]}
        counts = {"t": along, "a": across, "d": 1, "u": 1}
        # those that are displacements begin with u, by which lengths are told from directions
        linked = {
            f"u{s}{k}" if s == "t" else f"{s}{k}": (s, k) for s in sums for k in range(counts[s])
        }
        sizes = [1.0] * (9 if across else 3) + [length] * 3 * between
        mixed = node_space(nodes, {**dict.fromkeys([*own, *linked], 3), "mu": len(sizes)})
        links = []
        for part, (s, k) in linked.items():
            targets = np.array([item.dofs[k] for item in sums[s]])
            rows = mixed.dofs[part].reshape(-1, 3)
            links += node_links(nodes, rows, [item.body for item in sums[s]], targets)

        def constant(title: str, values: Sequence[Any]) -> Expr:
            return constant_vector(nodes, np.array(values).reshape(len(points), -1), title)

        given = constant("given", [[p.axis, *p.normals, *p.vectors] for p in points])
        weights = {
            s: constant(f"weights_{s}", [i.weights for i in sums[s]]) for s in ("t", *"a"[:across])
        }
        within = constant("within", [p.place.weights for p in points]) if between else None

        def violation(q: Expr) -> Expr:
            part = self.layout.part
            t, first, d, *starts = (
                ufl.as_vector([given[3 * k + i] for i in range(3)]) for k in range(6)
            )
            n, p, r = (
                start + part(q, which) if which in own else start
                for start, which in zip(starts, "npr", strict=True)
            )
            t = t + sum((weights["t"][k] * part(q, f"ut{k}") for k in range(along)), start=0 * t)
            d = d + part(q, "d0")
            rows = [(ufl.dot(r, r) - 1) / 2, ufl.dot(r, t), ufl.dot(r, d)]
            if across:
                one = weights["a"] if across > 1 else None
                moved = [part(q, f"a{k}") for k in range(across)]
                first = first + sum(
                    (one[k] * v if one is not None else v for k, v in enumerate(moved)), start=0 * t
                )
                rows += [(ufl.dot(p, p) - 1) / 2, ufl.dot(p, t), ufl.dot(p, first)]
                rows += [(ufl.dot(n, n) - 1) / 2, ufl.dot(n, p), ufl.dot(n, t)]
            if within is not None:
                inner = sum((within[k] * part(q, f"ut{k}") for k in range(inside)), start=0 * t)
                rows += [part(q, "u")[i] - inner[i] for i in range(3)]
            return ufl.as_vector(rows)

        self.directions = tuple(range(9 if across else 3))
        forces = [force * length / size for size in sizes]
        super().__init__(name, nodes, mixed, tuple(links), violation, forces, sizes)
        scales = (
            PartScale(part, f"vectors of {name}", length if part == "u" else 1.0, "a smaller step")
            for part in own
        )
        self.parts = (*self.parts, *scales)
        self.kinematic = frozenset(mixed.parts) - {"mu"}
        self.jump_parts = frozenset({*own, "mu"})
        self.labels = [point.label for point in points]
        self._points, self._place = list(points), "u" if between else "u0"
        self._dofs = {part: global_dofs(nodes, mixed, part) for part in (*own, self._place)}

    def ends(self, k: int) -> tuple[End | None, End]:
        """Places with two vectors on the first shell, if it is one, and one on the second."""
        point, dofs = self._points[k], self._dofs
        u, x, directors = dofs[self._place][k], point.x, point.vectors
        second = End(self.name, point.second.body, {"u": u, "w": dofs["r"][k]}, x, directors[2:], x)
        if point.director is None:
            return None, second
        w = np.concatenate([dofs["n"][k], dofs["p"][k]])
        first = End(self.name, point.director.body, {"u": u, "w": w}, x, directors[:2], x)
        return first, second


@dataclass
class Hinge:
    """A hinge along edges.

    Args:
        joint: Description.
        nodes: What holds places together, as joints.
        coordinates: Its angles: one whose items are all the same, or one for each node.
    """

    joint: EdgeHinge
    nodes: list[BoundJoint]
    coordinates: list[BoundCoordinate]

    @property
    def several(self) -> list[tuple[str, float]]:
        """Names and shares of its angles, if it has several."""
        return [] if self.joint.rigid_angle else [(c.name, c.share) for c in self.coordinates]


def hinge_line(joint: EdgeHinge, x: Floats, size: float, who: str = "") -> Floats:
    """Axis of a hinge from the nodes of an edge, shape (3,).

    Args:
        joint: Description.
        x: Nodes, in order or not, shape (n, 3), m.
        size: Length of the shell, m.
        who: The shell, for the error.

    Raises:
        SceneError: If the edge is curved, or the given axis is not along it.
    """
    far = x[int(np.argmax(np.linalg.norm(x - x[0], axis=1)))] - x[0]
    axis = far / np.linalg.norm(far)
    off = np.linalg.norm((x - x[0]) - np.outer((x - x[0]) @ axis, axis), axis=1)
    if float(off.max()) > 2 * ON_NODE * size:
        raise SceneError(
            f"{joint.said}: the edge of {who} is {off.max():.3g} away from a straight line; it "
            "must be straight"
        )
    # x grows along it, or else y, or else z
    axis = axis if axis[np.abs(axis) > ALIGNED][0] > 0 else -axis
    if joint.axis is None:
        return np.asarray(axis)
    given = np.asarray(joint.axis) / np.linalg.norm(joint.axis)
    if np.linalg.norm(np.cross(given, axis)) > 1e-3:
        raise SceneError(
            f"{joint.said}: axis is {joint.axis}; it must be along the edge of {who}, which runs "
            f"along ({', '.join(f'{c:.3g}' for c in axis)})"
        )
    return np.asarray(axis if given @ axis > 0 else -axis)


def bind_hinges(
    hinges: Sequence[EdgeHinge],
    find: FindEnd,
    shells: Mapping[str, ShellModel],
    comm: MPI.Comm,
    force: float,
    length: float,
    dynamic: bool,
) -> tuple[dict[str, Hinge], list[EdgeFrames]]:
    """Find the places of hinges along edges, and make the frames that they need.

    Args:
        hinges: Descriptions.
        find: Gives the place on a body: its name, where on it, and who asks.
        shells: The flexible shells by name.
        comm: Communicator.
        force: Size of forces, N.
        length: Size of the scene, m.
        dynamic: Whether directors need inertia.

    Raises:
        SceneError: If an edge is curved, or the edges do not lie on each other.
    """
    points: dict[tuple[int, int, int], list[_Point]] = {}
    found, sides = {}, {}
    for joint in hinges:
        for name in (joint.first, joint.second):
            if dynamic and name in shells and "lam" not in shells[name].jump_parts:
                raise SceneError(
                    f"{joint.said}: the directors of '{name}' have no inertia; it must have "
                    "rotary_inertia=True and a section with second moments"
                )
        sides[joint.name] = one, two, axis = _sides(joint, find, shells)
        mine = _points(joint, one, two, axis)
        points.setdefault(mine[0].key, []).extend(mine)
    groups = {
        key: EdgeFrames(f"edge hinges ({'/'.join(map(str, key))})", comm, some, force, length)
        for key, some in points.items()
    }
    for joint in hinges:
        one, two, axis = sides[joint.name]
        group = next(g for g in groups.values() if joint.name in g.labels)
        start = group.labels.index(joint.name)
        found[joint.name] = _hinge(joint, group, start, one, two, axis)
    return found, list(groups.values())


def _hinge(
    joint: EdgeHinge, group: EdgeFrames, start: int, one: _Edge | End, two: _Edge, axis: Floats
) -> Hinge:
    center = (two.nodes.x[0] + two.nodes.x[-1]) / 2
    nodes: list[BoundJoint] = []
    coordinates, shares = [], two.shares()
    for k, x in enumerate(two.nodes.x):
        frame, vector = group.ends(start + k)
        if isinstance(one, End):
            frame = replace(one, point=x)
        assert frame is not None
        r = vector.directors[0]
        axes = np.array([[r, np.cross(axis, r), axis]] * 2)
        held = (frame, two.end(k))
        # without a frame of the first body there is no common point for moments to be about
        nodes.append(
            _OnFrame(joint, "spherical", held, axes, center=center)
            if isinstance(one, End)
            else BoundJoint(joint, "spherical", held, axes)
        )
        name, share = f"{joint.name}.{k + 1}", float(shares[k])
        if joint.rigid_angle:
            name, share = joint.name, float(k == 0)
        both = (frame, vector)
        coordinates.append(BoundCoordinate(name, "rotation", both, axes, 0.0, joint.name, share))
    return Hinge(joint, nodes, coordinates)


def _sides(
    joint: EdgeHinge, find: FindEnd, shells: Mapping[str, ShellModel]
) -> tuple[_Edge | End, _Edge, Floats]:
    """What has the frames, the edge with the nodes that are held, and the axis."""
    first, second = shells.get(joint.first), shells.get(joint.second)
    at: Any = joint.at
    second_at: Any = joint.second_at
    if first is None or second is None:
        shell, where = (first, at) if second is None else (second, second_at)
        assert shell is not None
        x = shared_nodes(shell, where, joint.said).x
        axis = hinge_line(joint, x, shell.surface_mesh.length, f"shell '{shell.name}'")
        # the first shell on the second body turns about it the other way round
        axis, body = (-axis, joint.second) if second is None else (axis, joint.first)
        return find(body, None, joint.said), _edge(joint, shell, where, axis), axis
    x = shared_nodes(second, second_at, joint.said).x
    axis = hinge_line(joint, x, second.surface_mesh.length, f"shell '{joint.second}'")
    other = shared_nodes(first, at, joint.said).x
    along = hinge_line(replace(joint, axis=None), other, first.surface_mesh.length, joint.first)
    if float(np.linalg.norm(np.cross(axis, along))) > ALIGNED:
        raise SceneError(
            f"{joint.said}: the edges of shells '{joint.first}' and '{joint.second}' are not "
            "parallel; they must lie on each other"
        )
    one, two = _edge(joint, first, at, axis), _edge(joint, second, second_at, axis)
    if len(one.s) > len(two.s):
        # nodes of the finer edge are held on the coarser one
        axis = -axis
        one, two = (
            _edge(joint, second, second_at, axis),
            _edge(joint, first, at, axis),
        )
    return one, two, axis


def _points(joint: EdgeHinge, one: _Edge | End, two: _Edge, axis: Floats) -> list[_Point]:
    """Points of a hinge at the nodes of the second edge."""
    found = []
    size = two.shell.surface_mesh.length
    same = isinstance(one, _Edge) and len(one.s) == len(two.s)
    if same and isinstance(one, _Edge):
        same = float(np.abs(one.nodes.x - two.nodes.x).max()) < 2 * ON_NODE * size
    for k, x in enumerate(two.nodes.x):
        node = two.end(k)
        second = _Sum(node.body, node.dofs["w"][None], np.ones(1))
        d = node.directors[0]
        if isinstance(one, End):
            tangent = _Sum(one.body, one.dofs["w"].reshape(3, 3), one.directors @ axis)
            place = _Sum(node.body, node.dofs["u"][None], np.ones(1))
            found.append(
                _Point(joint.name, x, axis, np.array([d, d]), tangent, None, place, second)
            )
            continue
        if same:
            around = np.arange(3) + min(max(k - 1, 0), len(one.s) - 3)
            slopes = _weights(one.s[around], float(one.s[k]))[1]
            inner, values = np.array([k]), np.ones(1)
        else:
            s = one.at(x, joint, two)
            degree = one.shell.shell.degree
            element = int(
                np.clip(np.searchsorted(one.s[::degree], s) - 1, 0, len(one.s) // degree - 1)
            )
            around = inner = np.arange(degree + 1) + degree * element
            values, slopes = _weights(one.s[around], s)
        name, dofs = one.shell.name, one.nodes.dofs
        tangent, director = (
            _Sum(name, dofs["u"][around], slopes),
            _Sum(name, dofs["w"][inner], values),
        )
        normal = values @ one.nodes.director[inner]
        place = _Sum(name, dofs["u"][inner], values)
        both = np.array([normal, d])
        found.append(_Point(joint.name, x, axis, both, tangent, director, place, second))
    return found


def _edge(joint: EdgeHinge, shell: ShellModel, name: str, axis: Floats) -> _Edge:
    nodes = shared_nodes(shell, name, joint.said)
    s = (nodes.x - nodes.x[0]) @ axis
    order = np.argsort(s)
    dofs = {part: rows[order] for part, rows in nodes.dofs.items()}
    nodes = Nodes(nodes.x[order], dofs, nodes.directors[order])
    tilted = np.abs(nodes.director @ axis)
    if float(tilted.max()) > 1e-3:
        raise SceneError(
            f"{joint.said}: a director of shell '{shell.name}' is {np.degrees(tilted.max()):.3g} "
            "degrees away from the plane across the edge; it must be in that plane, as where no "
            "other shell is joined smoothly at an angle"
        )
    return _Edge(shell, nodes, s[order])


def _weights(at: Floats, s: float) -> tuple[Floats, Floats]:
    """Weights of nodes for value and derivative at a place between them."""
    size = float(np.ptp(at))
    powers = np.vander((at - s) / size, increasing=True).T
    value, slope = np.eye(len(at))[:2]
    return np.linalg.solve(powers, value), np.linalg.solve(powers, slope) / size
