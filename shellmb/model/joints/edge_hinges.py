"""Hinges along edges bound to their meshes: where their points are, and what holds them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.model.joints.coordinates import BoundCoordinate
from shellmb.model.joints.edge_frames import EdgeFrames, Point, Sum
from shellmb.model.joints.joints import BoundJoint
from shellmb.model.locations.ends import End
from shellmb.model.locations.nodes import ON_NODE, FindEnd, Nodes, shared_nodes
from shellmb.model.massless import Scale
from shellmb.model.shells.shell import ShellModel
from shellmb.scene.multibody.joints import EdgeHinge

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
        return self.nodes.end(k, self.shell.name)

    def check_directors(self, joint: EdgeHinge) -> None:
        """Check that directors are across the edge.

        Raises:
            SceneError: If they lean along it.
        """
        along = (self.nodes.x[-1] - self.nodes.x[0]) / np.ptp(self.s)
        tilted = float(np.abs(self.nodes.director @ along).max())
        if tilted > 1e-3:
            raise SceneError(
                f"{joint.said}: a director of shell '{self.shell.name}' is "
                f"{np.degrees(tilted):.3g} degrees away from the plane across the edge; it must be "
                "in that plane, as where no other shell is joined smoothly at an angle"
            )

    def at(self, x: Floats, joint: EdgeHinge, other: "_Edge") -> float:
        """Position along the edge of a node of another edge, m.

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


@dataclass
class Hinge:
    """A hinge along edges.

    Args:
        nodes: What holds places together, as joints.
        coordinates: Its angles: one whose items are all the same, or one for each node.
        several: Names and shares of its angles, if it has several.
    """

    nodes: list[BoundJoint]
    coordinates: list[BoundCoordinate]
    several: list[tuple[str, float]]


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
    scale: Scale,
    dynamic: bool,
) -> tuple[dict[str, Hinge], list[EdgeFrames]]:
    """Find the places of hinges along edges, and make the frames that they need.

    Args:
        hinges: Descriptions.
        find: Gives the place on a body: its name, where on it, and who asks.
        shells: The flexible shells by name.
        scale: Communicator and sizes.
        dynamic: Whether directors need inertia.

    Raises:
        SceneError: If an edge is curved, or the edges do not lie on each other.
    """
    points: dict[tuple[int, int, int], list[Point]] = {}
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
        key: EdgeFrames(f"edge hinges ({'/'.join(map(str, key))})", scale, some)
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
        # moments are about a common point on the frame, which matters also at its origin; without a
        # frame of the first body there is none
        kind, about = ("fixed point", center) if isinstance(one, End) else ("spherical", None)
        nodes.append(BoundJoint(joint, kind, held, axes, about=about))
        name, share = f"{joint.name}.{k + 1}", float(shares[k])
        if joint.rigid_angle:
            name, share = joint.name, float(k == 0)
        both = (frame, vector)
        coordinates.append(BoundCoordinate(name, "rotation", both, axes, 0.0, joint.name, share))
    several = [] if joint.rigid_angle else [(c.name, c.share) for c in coordinates]
    return Hinge(nodes, coordinates, several)


def _sides(
    joint: Any, find: FindEnd, shells: Mapping[str, ShellModel]
) -> tuple[_Edge | End, _Edge, Floats]:
    """Find what has the frames, the edge with the nodes that are held, and the axis."""
    first, second = shells.get(joint.first), shells.get(joint.second)
    if first is None or second is None:
        shell, where = (first, joint.at) if second is None else (second, joint.second_at)
        assert shell is not None
        x = shared_nodes(shell, where, joint.said).x
        axis = hinge_line(joint, x, shell.surface_mesh.length, f"shell '{shell.name}'")
        # the first shell on the second body turns about it the other way round
        axis, body = (-axis, joint.second) if second is None else (axis, joint.first)
        edge = _edge(joint, shell, where, axis)
        edge.check_directors(joint)
        return find(body, None, joint.said), edge, axis
    one, two, axis = _lines(joint, first, second)
    for edge in (one, two):
        edge.check_directors(joint)
    return one, two, axis


def _lines(joint: EdgeHinge, first: ShellModel, second: ShellModel) -> tuple[_Edge, _Edge, Floats]:
    """Edges of both shells, the one with more nodes last, and the axis."""
    at, second_at = str(joint.at), str(joint.second_at)
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
        one, two = (_edge(joint, second, second_at, axis), _edge(joint, first, at, axis))
    return one, two, axis


def edges_together(joint: EdgeHinge, first: ShellModel, second: ShellModel) -> None:
    """Check that the edges of a hinge lie on each other.

    Args:
        joint: Description.
        first: The first shell.
        second: The second shell.

    Raises:
        SceneError: If they are not straight or not parallel, or a node of the one with more nodes
            is not on the other one.
    """
    one, two, _ = _lines(joint, first, second)
    for x in two.nodes.x:
        one.at(x, joint, two)


def _points(joint: EdgeHinge, one: _Edge | End, two: _Edge, axis: Floats) -> list[Point]:
    """Points of a hinge at the nodes of the second edge."""
    found = []
    size = two.shell.surface_mesh.length
    same = False
    if isinstance(one, _Edge) and len(one.s) == len(two.s):
        same = float(np.abs(one.nodes.x - two.nodes.x).max()) < 2 * ON_NODE * size
    for k, x in enumerate(two.nodes.x):
        node = two.end(k)
        second = Sum(node.body, node.dofs["w"][None], np.ones(1))
        d = node.directors[0]
        if isinstance(one, End):
            tangent = Sum(one.body, one.dofs["w"].reshape(3, 3), one.directors @ axis)
            place = Sum(node.body, node.dofs["u"][None], np.ones(1))
            found.append(Point(joint.name, x, axis, np.array([d, d]), tangent, None, place, second))
            continue
        if same:
            around = np.arange(3) + min(max(k - 1, 0), len(one.s) - 3)
            slopes = _weights(one.s[around], float(one.s[k]))[1]
            inner, values = np.array([k]), np.ones(1)
        else:
            s = one.at(x, joint, two)
            degree = one.shell.shell.degree
            before = int(np.searchsorted(one.s[::degree], s)) - 1
            element = min(max(before, 0), len(one.s) // degree - 1)
            around = inner = np.arange(degree + 1) + degree * element
            values, slopes = _weights(one.s[around], s)
        name, dofs = one.shell.name, one.nodes.dofs
        tangent, place = Sum(name, dofs["u"][around], slopes), Sum(name, dofs["u"][inner], values)
        director = Sum(name, dofs["w"][inner], values)
        both = np.array([values @ one.nodes.director[inner], d])
        found.append(Point(joint.name, x, axis, both, tangent, director, place, second))
    return found


def _edge(joint: EdgeHinge, shell: ShellModel, name: str, axis: Floats) -> _Edge:
    nodes = shared_nodes(shell, name, joint.said)
    s = (nodes.x - nodes.x[0]) @ axis
    order = np.argsort(s)
    return _Edge(shell, nodes.take(order), s[order])


def _weights(at: Floats, s: float) -> tuple[Floats, Floats]:
    """Weights of nodes for value and derivative at a place between them."""
    size = float(np.ptp(at))
    powers = np.vander((at - s) / size, increasing=True).T
    value, slope = np.eye(len(at))[:2]
    return np.linalg.solve(powers, value), np.linalg.solve(powers, slope) / size
