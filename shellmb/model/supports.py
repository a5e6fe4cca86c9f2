"""Supports as fixed dofs, or as nodal constraints where a direction is not axis-parallel."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
from dolfinx import fem, mesh

from shellmb.errors import SceneError
from shellmb.model.body import FixedDofs, PrescribedTurn
from shellmb.model.nodal import NodalConstraint, plane
from shellmb.model.places import ON_NODE, Meshed, Nodes, Place, local_nodes, part_dofs, shared_nodes
from shellmb.model.shell import ShellModel
from shellmb.scene import supports as scene_supports
from shellmb.scene.supports import Support

Floats = npt.NDArray[np.float64]

# directions closer than this to an axis or to one another count as parallel
PARALLEL = 1e-9


@dataclass
class _Planes:
    """Planes that one part of one shell is held in, collected over all supports."""

    nodes: dict[tuple[int, int, int], list[Floats]] = field(default_factory=dict)
    dofs: list[npt.NDArray[np.int64]] = field(default_factory=list)
    normals: list[Floats] = field(default_factory=list)

    def add(self, key: tuple[int, int, int], normal: Floats) -> bool:
        """Remember a direction at a node; False if the node is already held along it."""
        held = self.nodes.setdefault(key, [])
        if held:
            basis = np.linalg.qr(np.array(held).T)[0]
            if np.linalg.norm(normal - basis @ (basis.T @ normal)) < 1e-6:
                return False
        held.append(normal)
        return True


class Supportable(Meshed, Protocol):
    """A shell or a beam, whose dofs can be fixed."""

    fixed: list[FixedDofs]

    @property
    def force_size(self) -> float:
        """Size of its resultants, N."""
        ...


class Supported:
    """Collects the supports of one shell or beam.

    Args:
        body: The body; its `fixed` list is filled.
    """

    def __init__(self, body: Supportable) -> None:
        self.body = body
        self._planes = {"u": _Planes(), "w": _Planes()}

    def add(self, support: Support) -> None:
        """Apply one support.

        Raises:
            SceneError: If its edge or point does not exist.
        """
        who = type(support).__name__
        match support:
            case scene_supports.Clamped():
                self._hold(support.edge, "u", who)
                self._hold(support.edge, "w", who)
            case scene_supports.Hinged():
                self._hold(support.edge, "u", who)
            case scene_supports.SoftSupport():
                self._plane(support.edge, "u", support.axis, who)
            case scene_supports.HardSupport():
                self._plane(support.edge, "u", support.axis, who)
                self._along_edge(support.edge, who)
            case scene_supports.SymmetryPlane():
                self._plane(support.edge, "u", support.normal, who)
                self._plane(support.edge, "w", support.normal, who)
            case scene_supports.Fixed():
                self._components(support.where, "u", support.displacement, who)
                self._components(support.where, "w", support.director, who)
            case scene_supports.Driven():
                self._drive(support, who)
            case _:
                raise NotImplementedError(f"no form for {who}")

    def constraints(self) -> list[NodalConstraint]:
        """Constraints for the planes that are not axis-parallel, one body for each part."""
        made = []
        for part, planes in self._planes.items():
            if not planes.dofs:
                continue
            body = self.body
            dofs, normals = np.array(planes.dofs), np.array(planes.normals)
            kind = "displacement" if part == "u" else "director"
            name = f"{kind} plane of '{body.name}'"
            scale = body.force_size * (1.0 if part == "u" else body.domain.length)
            vector = (body.name, dofs, np.zeros((len(dofs), 3)))
            comm = body.domain.mesh.comm
            made.append(plane(name, comm, vector, normals, scale))
        return made

    def _fix(
        self,
        dofs: npt.NDArray[np.int32],
        value: Callable[[float], Floats] | None = None,
        turn: PrescribedTurn | None = None,
    ) -> None:
        zeros = np.zeros(len(dofs))
        moving = value is not None
        self.body.fixed.append(FixedDofs(dofs, value or (lambda t: zeros), moving, turn))

    def _hold(self, where: Place, part: str, who: str) -> None:
        """All components zero; the director's multiplier has nothing left to do and goes too."""
        if self.body.mixed.parts[part][1] > 3:
            # all directors of a beam at once
            nodes = local_nodes(self.body, where, who)
            self._fix(part_dofs(self.body, nodes, part).ravel())
        else:
            for axis in np.eye(3):
                self._plane(where, part, tuple(axis), who)
        if part == "w":
            nodes = local_nodes(self.body, where, who)
            self._fix(part_dofs(self.body, nodes, "lam").ravel())

    def _plane(self, where: Place, part: str, normal: tuple[float, ...], who: str) -> None:
        direction = np.asarray(normal, dtype=float)
        direction = direction / np.linalg.norm(direction)
        names = where if isinstance(where, tuple) and isinstance(where[0], str) else (where,)
        for name in names:
            shared = shared_nodes(self.body, name, who)
            self._planes_at(shared, part, np.tile(direction, (len(shared.x), 1)))

    def _planes_at(self, shared: Nodes, part: str, normals: Floats) -> None:
        """Hold nodes in planes: by their components where axis-parallel, else by a multiplier."""
        planes = self._planes[part]
        size = ON_NODE * self.body.domain.length
        index_map = self.body.mixed.space.dofmap.index_map
        fixed: list[int] = []
        for x, dofs, normal in zip(shared.x, shared.dofs[part], normals, strict=True):
            a, b, c = (int(v) for v in np.round(x / size))
            if not planes.add((a, b, c), normal):
                continue
            axis = int(np.argmax(np.abs(normal)))
            if 1 - abs(normal[axis]) < PARALLEL:
                fixed.append(int(dofs[axis]))
            else:
                planes.dofs.append(dofs)
                planes.normals.append(normal)
        local = index_map.global_to_local(np.array(fixed, dtype=np.int64))
        self._fix(np.asarray(local[local >= 0], dtype=np.int32))

    def _shell(self, who: str) -> ShellModel:
        if not isinstance(self.body, ShellModel):
            raise SceneError(f"{who}: '{self.body.name}' is no shell; it must be one")
        return self.body

    def _along_edge(self, edge: str | tuple[str, ...], who: str) -> None:
        """The director does not lean along the edge."""
        for name in (edge,) if isinstance(edge, str) else edge:
            shared = shared_nodes(self.body, name, who)
            self._planes_at(shared, "w", edge_tangents(self._shell(who), name, shared.x, who))

    def _components(self, where: Place, part: str, components: tuple, who: str) -> None:
        if all(c is None for c in components):
            return
        shared = shared_nodes(self.body, where, who)
        local = local_nodes(self.body, where, who)
        for axis, component in enumerate(components):
            if component is None:
                continue
            if not callable(component) and component == 0:
                self._planes_at(shared, part, np.tile(np.eye(3)[axis], (len(shared.x), 1)))
                continue
            dofs = part_dofs(self.body, local, part)[:, axis].copy()
            # a prescribed motion wins over a component held at zero before
            for x in shared.x:
                size = ON_NODE * self.body.domain.length
                a, b, c = (int(v) for v in np.round(x / size))
                self._planes[part].add((a, b, c), np.eye(3)[axis])
            self._fix(dofs, _uniform(component, len(dofs)))
        if part == "w" and all(c is not None for c in components):
            self._fix(part_dofs(self.body, local, "lam").ravel())

    def _drive(self, support: scene_supports.Driven, who: str) -> None:
        body = self.body
        nodes = local_nodes(body, support.edge, who)
        X = body.mixed.nodes("u")[nodes]
        D = body.node_directors()[nodes]
        origin = np.asarray(support.origin, dtype=float)
        axis = np.asarray(support.axis, dtype=float)
        axis = axis / np.linalg.norm(axis)

        def turned(v: Floats, t: float) -> Floats:
            angle = support.angle(t) if support.angle else 0.0
            # Rodrigues' formula for the change of v, accurate for small angles
            cross = np.cross(axis, v)
            return np.sin(angle) * cross + 2 * np.sin(angle / 2) ** 2 * np.cross(axis, cross)

        def displacement(t: float) -> Floats:
            shift = np.asarray(support.translation(t)) if support.translation else np.zeros(3)
            return (turned(X - origin, t) + shift).ravel()

        turn = None
        if support.angle:
            who = f"the support Driven({support.edge!r}) of '{body.name}'"
            turn = PrescribedTurn(who, support.angle, unknown=False)
        self._fix(part_dofs(body, nodes, "u").ravel(), displacement, turn)
        rows = D.reshape(-1, 3)
        self._fix(part_dofs(body, nodes, "w").ravel(), lambda t: turned(rows, t).ravel())
        self._fix(part_dofs(body, nodes, "lam").ravel())


def _uniform(component: Any, count: int) -> Callable[[float], Floats]:
    if callable(component):
        return lambda t: np.full(count, float(component(t)))
    return lambda t: np.full(count, float(component))


def edge_tangents(body: ShellModel, edge: str, x: Floats, who: str) -> Floats:
    """Unit tangents of an edge at given nodes on it, mean of the facets that meet there.

    Args:
        body: The shell.
        edge: Name of the edge.
        x: Positions of nodes, the same on all ranks, shape (n, 3).
        who: Who asks, for the error.
    """
    domain = body.surface_mesh.mesh
    facets = body.surface_mesh.facets(edge, who)
    facets = facets[facets < domain.topology.index_map(1).size_local]
    space = body.mixed.subspaces["u"]
    coordinates = space.tabulate_dof_coordinates()
    found = []
    ends = (
        mesh.entities_to_geometry(domain, 1, facets)[:, :2]
        if len(facets)
        else np.zeros((0, 2), dtype=np.int32)
    )
    for facet, (a, b) in zip(facets, ends, strict=True):
        tangent = domain.geometry.x[b] - domain.geometry.x[a]
        dofs = fem.locate_dofs_topological(space, 1, np.array([facet]), remote=False)
        found.append((coordinates[dofs], tangent / np.linalg.norm(tangent)))
    everywhere = [item for part in domain.comm.allgather(found) for item in part]
    sums = np.zeros_like(x)
    tolerance = ON_NODE * body.domain.length
    for nodes, tangent in everywhere:
        hit = (np.linalg.norm(x[:, None] - nodes[None], axis=2) < tolerance).any(axis=1)
        # facets carry no common direction: turn each towards what is there already
        sign = np.where(sums @ tangent < 0, -1.0, 1.0)
        sums[hit] += (sign[:, None] * tangent)[hit]
    return sums / np.linalg.norm(sums, axis=1, keepdims=True)
