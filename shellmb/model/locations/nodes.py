"""Places on bodies by edge, area, name or coordinates, the same on every rank."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Protocol

from mpi4py import MPI

import basix
import numpy as np
from dolfinx import fem

from shellmb.arrays import Floats, Int32s, Ints
from shellmb.errors import SceneError
from shellmb.meshes.curve_mesh import LineMesh
from shellmb.meshes.spaces import MixedSpace
from shellmb.meshes.tying import coordinate_element
from shellmb.model.body import FixedDofs
from shellmb.model.locations.ends import End
from shellmb.scene import Scene
from shellmb.scene.multibody.joints import GROUND
from shellmb.scene.multibody.offsets import Offset, arm_components, node_of

# a point must lie on a node to within this fraction of the body's length
ON_NODE = 1e-6

Place = str | tuple[str, ...] | tuple[float, float, float]


class Meshed(Protocol):
    """A body with a mesh: a shell, a beam or a placed body of a user's own."""

    name: str
    mixed: MixedSpace
    fixed: list[FixedDofs]

    @property
    def force_size(self) -> float:
        """Size of its resultants, N."""

    @property
    def jump_parts(self) -> frozenset[str]:
        """Parts that have equations for the jump of velocities."""

    @property
    def domain(self) -> Any:
        """Mesh of the body with names: a `SurfaceMesh`, `LineMesh` or `FieldMesh`."""

    def node_directors(self) -> Floats:
        """Reference directors of the local nodes (owned and ghost), shape (n, m, 3)."""


@dataclass(frozen=True)
class Nodes:
    """Nodes of one body on every rank, sorted by position.

    Args:
        x: Reference positions, shape (n, 3), m.
        dofs: Part name to global dofs in the body's mixed space, shape (n, size).
        directors: Reference directors, shape (n, m, 3): one of a shell, three of a beam.
    """

    x: Floats
    dofs: dict[str, Ints]
    directors: Floats

    @property
    def director(self) -> Floats:
        """Reference director of a shell, shape (n, 3); of none without directors."""
        return np.asarray(self.directors[:, :1].reshape(-1, 3))

    def take(self, which: Ints) -> "Nodes":
        """Some of the nodes, by their numbers."""
        dofs = {part: rows[which] for part, rows in self.dofs.items()}
        return Nodes(self.x[which], dofs, self.directors[which])

    def off(self, where: Any, who: str, body: str) -> Floats:
        """The place of the first node, or of an offset from it, shape (3,), m."""
        x, D = self.x[0], self.directors[0]
        if not isinstance(where, Offset):
            return np.asarray(x)
        return np.asarray(x + arm_components(where.by, D, who, f"'{body}'") @ D)

    def end(self, k: int, body: str, point: Floats | None = None) -> End:
        """A node as a place on a body, perhaps with a point off it."""
        dofs, x = {part: self.dofs[part][k] for part in ("u", "w")}, self.x[k]
        return End(body, body, dofs, x, self.directors[k], x if point is None else point)


def local_nodes(body: Meshed, where: Place | None, who: str) -> Int32s:
    """Local numbers (owned and ghost) of the nodes at a place; they count nodes, not dofs.

    Args:
        body: The shell.
        where: Name or names of edges and areas, or of points; or coordinates; None: all nodes.
        who: Who asks, for the error.

    Raises:
        SceneError: If there is no such edge or point, or no node at the coordinates.
    """
    mesh = body.domain
    if where is None:
        return np.arange(len(body.mixed.nodes("u")), dtype=np.int32)
    if isinstance(where, str) and where in mesh.points:
        if isinstance(mesh, LineMesh):
            return _node_at(body, mesh.points[where], who)
        # a vertex and no place: where a surface is slit another one lies on it
        vertices = mesh.vertices[where]
        space = body.mixed.subspaces["u"]
        return np.asarray(fem.locate_dofs_topological(space, 0, vertices), dtype=np.int32)
    if isinstance(mesh, LineMesh) and isinstance(where, str):
        known = ", ".join(f"'{name}'" for name in mesh.points)
        raise SceneError(f"{who}: beam '{body.name}' has no point '{where}'; it has {known}")
    if isinstance(where, str) or all(isinstance(item, str) for item in where):
        if isinstance(mesh, LineMesh) or all(item in mesh.points for item in where):
            return np.unique(np.concatenate([local_nodes(body, item, who) for item in where]))  # type: ignore[arg-type]
        space = body.mixed.subspaces["u"]
        entities = mesh.entities(where, who)
        found = [fem.locate_dofs_topological(space, dim, which) for dim, which in entities]
        return np.unique(np.concatenate(found)).astype(np.int32)
    return _node_at(body, np.asarray(where, dtype=float), who)


def local_point(body: Meshed, point: Any, who: str) -> tuple[Int32s, Floats | None]:
    """Local nodes of a point, and the components of its arms along their directors, (n, m), m.

    Args:
        body: The shell or beam.
        point: A place, or an offset from one.
        who: Who asks, for the error.

    Raises:
        SceneError: If there is no such point.
    """
    nodes = local_nodes(body, node_of(point), who)
    if not isinstance(point, Offset):
        return nodes, None
    directors = body.node_directors()
    arms = [arm_components(point.by, directors[n], who, f"'{body.name}'") for n in nodes]
    return nodes, np.array(arms).reshape(len(nodes), directors.shape[1])


def _node_at(body: Meshed, point: Floats, who: str) -> Int32s:
    """The node at a point; empty on ranks that do not hold it."""
    nodes = body.mixed.nodes("u")
    distance, close = np.linalg.norm(nodes - point, axis=1), ON_NODE * body.domain.length
    comm = body.domain.mesh.comm
    nearest = comm.allreduce(
        min(zip(distance, map(tuple, nodes), strict=True), default=(np.inf, ())), op=MPI.MIN
    )
    if nearest[0] > close:
        raise SceneError(
            f"{who}: {body.domain.kind} '{body.name}' has no node at {shown(point)}; "
            f"the nearest one is at {shown(nearest[1])}"
        )
    here = np.flatnonzero(distance <= close).astype(np.int32)
    owned = body.mixed.subspaces["u"].dofmap.index_map.size_local
    count = comm.allreduce(int(np.sum(here < owned)))
    if count > 1:
        names = [n for n, x in body.domain.points.items() if np.linalg.norm(x - point) <= close]
        known = f", {' or '.join(map(repr, names))}" if names else ""
        raise SceneError(
            f"{who}: {body.domain.kind} '{body.name}' has {count} nodes at {shown(point)}, because "
            f"it is slit there and its edges lie on each other; give the name of a point{known}, "
            "or of an edge where one is possible"
        )
    return here


def shown(point: Iterable[float]) -> str:
    """A point or vector for a message; the round-off of a position is no digit of it."""
    return f"({', '.join(f'{round(float(c), 12) + 0.0:g}' for c in point)})"


def said_point(x: Floats, size: float) -> str:
    """A position for messages; what is round-off of a scene of that size is zero."""
    return f"({', '.join(f'{c:g}' for c in np.where(np.abs(x) < ON_NODE * size, 0.0, x))})"


def shared_nodes(body: Meshed, where: Place | None, who: str) -> Nodes:
    """The nodes at a place, or all, gathered from all ranks and sorted by position."""
    local = local_nodes(body, where, who)
    owned = body.mixed.subspaces["u"].dofmap.index_map.size_local
    local = local[local < owned]
    parts = [p for p in ("u", "w", "lam") if p in body.mixed.parts]
    record = (
        body.mixed.nodes("u")[local],
        {p: body.mixed.numbers(body.mixed.nodal(p)[local]) for p in parts},
        body.node_directors()[local],
    )
    gathered = body.domain.mesh.comm.allgather(record)
    x = np.concatenate([g[0] for g in gathered])
    # sort by rounded coordinates, so that every rank and every body of a join agrees
    rounded = np.round(x / (ON_NODE * body.domain.length)).astype(np.int64)
    order = np.lexsort(rounded.T[::-1])
    dofs: dict[str, Ints] = {p: np.concatenate([g[1][p] for g in gathered]) for p in parts}
    return Nodes(x, dofs, np.concatenate([g[2] for g in gathered])).take(order)


def values_at(body: Meshed, numbers: Ints, *values: Floats) -> list[Floats]:
    """Values at nodes that their first global dofs name, the same on all ranks; collective.

    Args:
        body: The body.
        numbers: The dofs, shape (n,).
        values: Each of them at the nodes of this rank, shape (nodes, ...).
    """
    owned = body.mixed.subspaces["u"].dofmap.index_map.size_local
    own = body.mixed.numbers(body.mixed.nodal("u")[:owned, 0])
    parts = body.domain.mesh.comm.allgather((own, *(each[:owned] for each in values)))
    every, *found = (np.concatenate(each) for each in zip(*parts, strict=True))
    order = np.argsort(every)
    here = order[np.searchsorted(every[order], numbers)]
    return [each[here] for each in found]


# elements of a curved body are polynomials: a point of it may be off its element by this part of
# its size times what directors turn by along it, an eighth for a circle in straight pieces
SAG = 1 / 6
# a node with less of a point has nothing of it
NOTHING = 1e-12
SIMPLICES = (basix.CellType.triangle, basix.CellType.tetrahedron)
# elements that are tried, the nearest ones by their middles, and steps of Newton's method in each
TRIED, STEPS = 12, 25


def surrounding(body: Meshed, point: Any, who: str) -> tuple[list[tuple[float, ...]], Floats]:
    """Nodes that a point lies between, by their coordinates, and the weights of their values.

    A point that is a node has only itself. The call is collective.

    Args:
        body: The shell or beam.
        point: Coordinates, shape (3,), m.
        who: Who asks, for the error.

    Returns:
        Coordinates of k nodes, and weights, shape (k,), whose sum is 1.

    Raises:
        SceneError: If the point is not on the body.
    """
    x, size = np.asarray(point, dtype=float), body.domain.length
    comm, nodes = body.domain.mesh.comm, body.mixed.nodes("u")
    near = float(np.min(np.linalg.norm(nodes - x, axis=1), initial=np.inf))
    if comm.allreduce(near <= ON_NODE * size, op=MPI.LOR):
        return [tuple(x.tolist())], np.ones(1)
    best = min(((*found, comm.rank) for found in _projections(body, x)), default=None)
    every = [one for one in comm.allgather(best) if one is not None]
    off, allowed, place, cell, local, rank = min(every)
    if off > max(allowed, ON_NODE * size):
        raise SceneError(
            f"{who}: {shown(x)} is not on {body.domain.kind} '{body.name}'; it is {off:.3g} m away "
            f"from its nearest point {shown(place)}"
        )
    mine: Any = None
    if comm.rank == rank:
        space = body.mixed.subspaces["u"]
        element: Any = space.element.basix_element
        weights = np.asarray(element.tabulate(0, np.array([local])))[0, 0, :, 0]
        there = nodes[space.dofmap.cell_dofs(cell)]
        kept = np.abs(weights) > NOTHING
        mine = ([tuple(p) for p in there[kept].tolist()], weights[kept])
    names, weights = comm.bcast(mine, root=rank)
    return names, weights


def is_point(where: Any) -> bool:
    """Decide whether a place is given by coordinates."""
    return isinstance(where, tuple) and not isinstance(where[0], str)


def _projections(body: Meshed, x: Floats) -> list[tuple[float, float, tuple, int, tuple]]:
    """Distances from the nearest own elements: distance, what is allowed, place, number, local."""
    mesh = body.domain.mesh
    dofs = mesh.geometry.dofmaps[0][: mesh.topology.index_map(mesh.topology.dim).size_local]
    if not len(dofs):
        return []
    corners = mesh.geometry.x[dofs]
    sizes = np.linalg.norm(np.ptp(corners, axis=1), axis=1)
    order = np.argsort(np.linalg.norm(corners.mean(axis=1) - x, axis=1) - sizes)[:TRIED]
    element, directors = coordinate_element(mesh), body.node_directors()
    found = []
    for cell in order:
        local, place = _nearest(element, corners[cell], x)
        off = float(np.linalg.norm(place - x))
        along = directors[body.mixed.subspaces["u"].dofmap.cell_dofs(cell)]
        turn = float(np.linalg.norm(np.ptp(along, axis=0), axis=1).max(initial=0.0))
        found.append((off, SAG * turn * float(sizes[cell]), tuple(place), int(cell), tuple(local)))
    return found


def _nearest(element: Any, corners: Floats, x: Floats) -> tuple[Floats, Floats]:
    """The point of one element that is nearest: local coordinates and position.

    By Gauss and Newton's method, kept in the element.
    """
    inside = _simplex if element.cell_type in SIMPLICES else _box
    local = basix.geometry(element.cell_type).mean(axis=0)
    for _ in range(STEPS):
        table = element.tabulate(1, local[None])[:, 0, :, 0]
        gap, slopes = x - table[0] @ corners, table[1:] @ corners
        new = inside(local + np.linalg.lstsq(slopes.T, gap, rcond=None)[0])
        done, local = np.abs(new - local).max() < 1e-14, new
        if done:
            break
    return local, element.tabulate(0, local[None])[0, 0, :, 0] @ corners


def _box(local: Floats) -> Floats:
    return np.asarray(np.clip(local, 0.0, 1.0))


def _simplex(local: Floats) -> Floats:
    local = np.maximum(local, 0.0)
    return np.asarray(local / max(float(local.sum()), 1.0))


# finds a place: the name of a body, where on it, and who asks
FindEnd = Callable[[str, Any, str], End]


def place_on(
    scene: Scene,
    meshed: Mapping[str, Meshed],
    rigid: Mapping[str, End],
    body: str,
    where: Any,
    who: str,
) -> End:
    """A place on a body; collective.

    Args:
        scene: The scene.
        meshed: Shells and beams by name.
        rigid: Centres of mass of rigid bodies, and ground if there is any, by name.
        body: Name of a body, or "ground".
        where: Name of a point, reference coordinates, an offset from one of these, or None for a
            rigid body's own point.
        who: Who asks, for the error.

    Raises:
        SceneError: If there is no single node there.
    """
    if body == GROUND:
        origin = np.zeros(3) if where is None else np.asarray(where, dtype=float)
        return replace(rigid[body], point=origin)
    if body in rigid:
        of: Any = scene.body(body)
        return replace(rigid[body], point=of.place(where))
    node = node_of(where)
    nodes = shared_nodes(meshed[body], node, who)
    if len(nodes.x) != 1:
        raise SceneError(
            f"{who}: there are {len(nodes.x)} nodes of '{body}' at '{node}'; give a single point"
        )
    return nodes.end(0, body, nodes.off(where, who, body))
