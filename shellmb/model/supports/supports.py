"""Supports as equations for nodal vectors, and loads that only press on them."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.meshes.surfaces.shell_lines import element_edges
from shellmb.model.body import PrescribedTurn, TimeFunction
from shellmb.model.locations.ends import frame_about
from shellmb.model.locations.nodes import ON_NODE, Meshed, Nodes, Place, said_point, shared_nodes
from shellmb.model.shells.shell import ShellModel
from shellmb.model.supports.prescribed import PARALLEL, Prescribed, Rows, plane
from shellmb.scene import Scene
from shellmb.scene.loads import loads
from shellmb.scene.loads import supports as scene_supports
from shellmb.scene.loads.supports import Support
from shellmb.scene.lookup import by_kind, of_kind, said
from shellmb.scene.multibody.offsets import Offset, arm_components, node_of
from shellmb.scene.values.user_functions import numbers_at
from shellmb.scene.values.validate import as_names, show

# part of a unit vector below which a direction counts as held
NOTHING = 1e-9

# loads at edges and points: the part that they work on, and the name of their components where
# their direction stays; those of the others turns with what they act on
WORKS_ON: dict[type, tuple[str, str | None]] = {
    loads.EdgeForce: ("u", "force"),
    loads.PointForce: ("u", "force"),
    loads.FollowerEdgeForce: ("u", None),
    loads.FollowerForce: ("u", None),
    loads.EdgeMoment: ("w", None),
    loads.PointMoment: ("w", None),
    loads.FollowerMoment: ("w", None),
}


def refuse_idle_loads(scene: Scene, bodies: Mapping[str, Meshed], prescribed: Prescribed) -> None:
    """Refuse loads at edges and points that supports hold against them.

    Args:
        scene: The scene.
        bodies: Shells and beams by name.
        prescribed: What the supports hold.

    Raises:
        SceneError: Names the load and the supports.
    """
    for load in scene.loads:
        if by_kind(WORKS_ON, load) is None:
            continue
        (described,) = scene.bodies_of(load)
        if described.name not in bodies:
            continue
        supports = _holding(load, bodies[described.name], prescribed)
        if supports:
            where = getattr(load, "at", None)
            raise SceneError(
                f"{said(load)}: it has no effect at {show(where)} of {said(described)}, where "
                f"{' and '.join(supports)} holds it; it must act elsewhere, or be left out"
            )


def _holding(load: Any, body: Meshed, prescribed: Prescribed) -> list[str]:
    """The supports that hold everything that a load works on; none if something is free."""
    part, components = of_kind(WORKS_ON, load)
    given = None if components is None else getattr(load, components)
    force = None if given is None or callable(given) else np.array(given)
    if force is not None and not force.any():
        return []
    # at the end of an arm a force turns the node, too
    works = {part: force} | ({"w": None} if isinstance(load.at, Offset) else {})
    nodes = shared_nodes(body, node_of(load.at), said(load))
    found: dict[str, None] = {}
    for part, along in works.items():
        for dofs in nodes.dofs[part]:
            basis, supports = prescribed.held(body.name, dofs)
            if not _held(basis, along):
                return []
            found |= dict.fromkeys(supports)
    return list(found)


def _held(basis: Floats, force: Floats | None) -> bool:
    """Decide whether a direction, or all of them, is in the span of a basis."""
    if force is None:
        return len(basis) == basis.shape[1]
    free = force - basis.T @ (basis @ force)
    return bool(np.linalg.norm(free) < NOTHING * np.linalg.norm(force))


Values = Callable[[float], Floats]


class SupportRows:
    """Equations of one support on one body, which it adds to all where it is made.

    Args:
        support: The support.
        body: The body.
        described: Its description in the scene.
        prescribed: Collects the equations.
        dynamic: Whether the scene moves in time.

    Raises:
        SceneError: If the support's edge or point does not exist.
    """

    def __init__(
        self, support: Support, body: Meshed, described: Any, prescribed: Prescribed, dynamic: bool
    ) -> None:
        self._support, self._body, self._described = support, body, described
        self._prescribed, self._dynamic = prescribed, dynamic
        where = support.at
        label = said(support)
        self._who = f"{label} {show(where)}" if "edge" in label else f"{label} at {show(where)}"
        prescribed.rows += of_kind(_EQUATIONS, support)(self, support)

    def at_offset(self, directions: Any, otherwise: list[Rows]) -> list[Rows]:
        """Hold the ends of arms, if there are any: in motion their directors need inertia."""
        support: Any = self._support
        if not np.any(support.offset):
            return otherwise
        body, nodes = self._body, self._nodes(support.at)
        if self._dynamic and "lam" not in body.jump_parts:
            raise SceneError(
                f"{self._who}: offset is {show(support.offset)} and the directors of "
                f"'{body.name}' have no inertia; it must have rotary_inertia=True and a section "
                "with second moments, or the offset must be 0"
            )
        who = self._who, f"'{body.name}'"
        arms = [arm_components(support.offset, D, *who) for D in nodes.directors]
        count = len(directions)
        u, w = (np.tile(nodes.dofs[part], (count, 1)) for part in ("u", "w"))
        turns = {f"w{k}": w[:, 3 * k : 3 * k + 3] for k in range(len(arms[0]))}
        units = [np.asarray(d) / np.linalg.norm(d) for d in directions]
        normals = np.repeat(units, len(nodes.x), axis=0)
        self._prescribed.planes.append(
            plane(
                f"displacement plane of '{body.name}' off {show(support.at)}",
                body.domain.mesh.comm,
                body.name,
                {"u": u, **turns},
                normals,
                body.force_size,
                np.tile(nodes.x, (count, 1)),
                body.domain.length,
                np.tile(arms, (count, 1)),
            )
        )
        return []

    def symmetric(self, support: scene_supports.SymmetryPlane) -> list[Rows]:
        """Displacement and director stay in a plane; a director along its normal cannot."""
        body = self._body
        normal = np.asarray(support.normal) / np.linalg.norm(support.normal)
        shared = self._nodes(support.at)
        along = np.abs(np.abs(shared.director @ normal) - 1) < PARALLEL
        if along.any():
            at = said_point(shared.x[int(np.argmax(along))], body.domain.length)
            raise SceneError(
                f"{self._who}: normal is {show(support.normal)}; it must not be the normal of the "
                f"shell '{body.name}' itself, as it is at {at}: a shell crosses its planes of "
                "symmetry"
            )
        return self.across("u", normal) + self.across("w", normal)

    def _nodes(self, where: Place) -> Nodes:
        return shared_nodes(self._body, where, said(self._support))

    def _of(
        self, nodes: Nodes, part: str, normals: Floats, *value: Any, each: int = 1
    ) -> list[Rows]:
        """Equations for `each` rows of every node, those of a node one after the other."""
        if not self._body.mixed.parts[part][1]:
            return []
        of = self._who, self._body, self._described, part
        which = np.repeat(np.arange(len(nodes.x)), each)
        return [Rows(*of, nodes.take(which), normals, *value)]

    def hold(self, part: str, *value: Any) -> list[Rows]:
        """All components, of a beam of all its directors; with values over time and their turn."""
        nodes, size = self._nodes(self._support.at), self._body.mixed.parts[part][1]
        return self._of(nodes, part, np.tile(np.eye(size), (len(nodes.x), 1)), *value, each=size)

    def across(self, part: str, normal: Any, *value: Any) -> list[Rows]:
        """Components along a normal; with values over time."""
        nodes, direction = self._nodes(self._support.at), np.asarray(normal, dtype=float)
        direction = direction / np.linalg.norm(direction)
        return self._of(nodes, part, np.tile(direction, (len(nodes.x), 1)), *value)

    def along_edge(self) -> list[Rows]:
        """The director does not lean along the edge."""
        body: Any = self._body
        who = said(self._support)
        if self._described.directors != 1:
            raise SceneError(f"{who}: '{body.name}' is no shell; it must be one")
        edges = [(name, self._nodes(name)) for name in as_names(self._support.at)]
        tangents = [(nodes, edge_tangents(body, name, nodes.x, who)) for name, nodes in edges]
        return [row for nodes, along in tangents for row in self._of(nodes, "w", along)]

    def components(self, part: str, components: tuple[Any, ...]) -> list[Rows]:
        """Single components, as numbers or over time."""
        who = f"{said(self._support)} of '{self._body.name}': prescribed value"
        count, found = len(self._nodes(self._support.at).x), list[Rows]()
        for axis, component in zip(np.eye(3), components, strict=True):
            if component is not None:
                given = callable(component) or component
                found += self.across(part, axis, _uniform(component, count, who) if given else None)
        return found

    def driven(self, support: scene_supports.Driven) -> list[Rows]:
        """All of an edge, moved as by a rigid motion."""
        nodes = self._nodes(support.at)
        origin = np.asarray(support.about, dtype=float)
        who = f"the support Driven({support.at!r}) of '{self._body.name}'"
        rotation, turned = turning(support, who)

        def displacement(t: float) -> Floats:
            moved = support.translation
            shift = numbers_at(moved(t), t, f"{who}: translation", 3) if moved else np.zeros(3)
            return np.asarray(turned(nodes.x - origin, t) + shift).ravel()

        turn = PrescribedTurn(who, rotation, unknown=False) if support.rotation else None
        directors = self.hold("w", lambda t: turned(nodes.director, t).ravel())
        return self.hold("u", displacement, turn) + directors


_EQUATIONS: dict[type, Callable[[SupportRows, Any], list[Rows]]] = {
    scene_supports.Clamped: lambda of, s: of.hold("u") + of.hold("w"),
    scene_supports.Hinged: lambda of, s: of.at_offset(np.eye(3), of.hold("u")),
    scene_supports.SoftSupport: lambda of, s: of.at_offset([s.axis], of.across("u", s.axis)),
    scene_supports.Diaphragm: lambda of, s: [
        row for normal in frame_about(s.axis)[:2] for row in of.across("u", normal)
    ],
    scene_supports.HardSupport: lambda of, s: of.across("u", s.axis) + of.along_edge(),
    scene_supports.SymmetryPlane: SupportRows.symmetric,
    scene_supports.Fixed: lambda of, s: (
        of.components("u", s.displacement) + of.components("w", s.director)
    ),
    scene_supports.Driven: SupportRows.driven,
}


def turning(
    support: scene_supports.Driven, who: str
) -> tuple[TimeFunction, Callable[[Floats, float], Floats]]:
    """Angle of a support over time, and what it changes vectors by, shape (..., 3)."""
    axis, given = np.asarray(support.axis, dtype=float), support.rotation
    axis = axis / np.linalg.norm(axis)

    def rotation(t: float) -> float:
        return 0.0 if given is None else float(numbers_at(given(t), t, f"{who}: rotation"))

    def turned(v: Floats, t: float) -> Floats:
        angle = rotation(t)
        # Rodrigues' formula for the change of v, accurate for small angles
        cross = np.cross(axis, v)
        return np.sin(angle) * cross + 2 * np.sin(angle / 2) ** 2 * np.cross(axis, cross)

    return rotation, turned


def _uniform(component: Any, count: int, who: str) -> Values:
    if callable(component):
        return lambda t: np.full(count, float(numbers_at(component(t), t, who)))
    return lambda t: np.full(count, float(component))


def edge_tangents(body: ShellModel, edge: str, x: Floats, who: str) -> Floats:
    """Unit tangents of an edge at given nodes on it, mean of the facets that meet there.

    Args:
        body: The shell.
        edge: Name of the edge.
        x: Positions of nodes, the same on all ranks, shape (n, 3).
        who: Who asks, for the error.
    """
    facets = body.surface_mesh.facets(edge, who)
    sides = element_edges(body.surface_mesh, body.mixed, body.node_directors()[:, 0], facets)
    sums, tolerance = np.zeros_like(x), ON_NODE * body.domain.length
    for nodes, (first, *_, last) in zip(sides["x"], sides["corners"], strict=True):
        tangent = (last - first) / np.linalg.norm(last - first)
        hit = (np.linalg.norm(x[:, None] - nodes[None], axis=2) < tolerance).any(axis=1)
        # facets carry no common direction: turn each towards what is there already
        sign = np.where(sums @ tangent < 0, -1.0, 1.0)
        sums[hit] += (sign[:, None] * tangent)[hit]
    return sums / np.linalg.norm(sums, axis=1, keepdims=True)
