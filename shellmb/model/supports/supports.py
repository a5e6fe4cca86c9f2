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
from shellmb.scene.values.validate import show

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
    """Collects the equations of one support on one body, where it is made.

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
        of_kind(_EQUATIONS, support)(self, support)

    def _clamped(self, support: scene_supports.Clamped) -> None:
        self._hold(support.at, "u")
        self._hold(support.at, "w")

    def _hinged(self, support: scene_supports.Hinged) -> None:
        if not self._at_offset(support, np.eye(3)):
            self._hold(support.at, "u")

    def _soft(self, support: scene_supports.SoftSupport) -> None:
        if not self._at_offset(support, [support.axis]):
            self._plane(support.at, "u", support.axis)

    def _diaphragm(self, support: scene_supports.Diaphragm) -> None:
        for direction in frame_about(support.axis)[:2]:
            self._plane(support.at, "u", direction)

    def _hard(self, support: scene_supports.HardSupport) -> None:
        self._plane(support.at, "u", support.axis)
        self._along_edge(support.at)

    def _symmetric(self, support: scene_supports.SymmetryPlane) -> None:
        self._plane(support.at, "u", support.normal)
        self._crosses(support)
        self._plane(support.at, "w", support.normal)

    def _fixed(self, support: scene_supports.Fixed) -> None:
        self._components(support.at, "u", support.displacement)
        self._components(support.at, "w", support.director)

    def _at_offset(self, support: Any, directions: Any) -> bool:
        """Hold the ends of arms, if there are any: in motion their directors need inertia."""
        if not np.any(support.offset):
            return False
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
        return True

    def _crosses(self, support: scene_supports.SymmetryPlane) -> None:
        """A director along the normal of its plane cannot stay in it."""
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

    def _nodes(self, where: Place) -> Nodes:
        return shared_nodes(self._body, where, said(self._support))

    def _add(self, nodes: Nodes, part: str, normals: Floats, *value: Any, each: int = 1) -> None:
        """Add `each` rows for every node, those of a node one after the other."""
        if self._body.mixed.parts[part][1]:
            of = self._who, self._body, self._described, part
            which = np.repeat(np.arange(len(nodes.x)), each)
            self._prescribed.rows.append(Rows(*of, nodes.take(which), normals, *value))

    def _hold(self, where: Place, part: str, *value: Any) -> None:
        """All components, of a beam of all its directors; with values over time and their turn."""
        nodes, size = self._nodes(where), self._body.mixed.parts[part][1]
        normals = np.tile(np.eye(size), (len(nodes.x), 1))
        self._add(nodes, part, normals, *value, each=size)

    def _plane(self, where: Place, part: str, normal: Any) -> None:
        nodes, direction = self._nodes(where), np.asarray(normal, dtype=float)
        direction = direction / np.linalg.norm(direction)
        self._add(nodes, part, np.tile(direction, (len(nodes.x), 1)))

    def _along_edge(self, edge: str | tuple[str, ...]) -> None:
        """The director does not lean along the edge."""
        body: Any = self._body
        who = said(self._support)
        if self._described.directors != 1:
            raise SceneError(f"{who}: '{body.name}' is no shell; it must be one")
        for name in (edge,) if isinstance(edge, str) else edge:
            nodes = self._nodes(name)
            self._add(nodes, "w", edge_tangents(body, name, nodes.x, who))

    def _components(self, where: Place, part: str, components: tuple[Any, ...]) -> None:
        for axis, component in enumerate(components):
            if component is None:
                continue
            nodes = self._nodes(where)
            who = f"{said(self._support)} of '{self._body.name}': prescribed value"
            given = callable(component) or component
            value = _uniform(component, len(nodes.x), who) if given else None
            self._add(nodes, part, np.tile(np.eye(3)[axis], (len(nodes.x), 1)), value)

    def _drive(self, support: scene_supports.Driven) -> None:
        nodes = self._nodes(support.at)
        origin = np.asarray(support.about, dtype=float)
        who = f"the support Driven({support.at!r}) of '{self._body.name}'"
        rotation, turned = turning(support, who)

        def displacement(t: float) -> Floats:
            moved = support.translation
            shift = numbers_at(moved(t), t, f"{who}: translation", 3) if moved else np.zeros(3)
            return np.asarray(turned(nodes.x - origin, t) + shift).ravel()

        turn = PrescribedTurn(who, rotation, unknown=False) if support.rotation else None
        self._hold(support.at, "u", displacement, turn)
        self._hold(support.at, "w", lambda t: turned(nodes.director, t).ravel())


_EQUATIONS: dict[type, Callable[[SupportRows, Any], None]] = {
    scene_supports.Clamped: SupportRows._clamped,
    scene_supports.Hinged: SupportRows._hinged,
    scene_supports.SoftSupport: SupportRows._soft,
    scene_supports.Diaphragm: SupportRows._diaphragm,
    scene_supports.HardSupport: SupportRows._hard,
    scene_supports.SymmetryPlane: SupportRows._symmetric,
    scene_supports.Fixed: SupportRows._fixed,
    scene_supports.Driven: SupportRows._drive,
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
