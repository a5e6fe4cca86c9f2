"""Nodes of shells and beams found by edge, area, name or coordinates, the same on every rank."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from dolfinx import fem

from shellmb.arrays import Floats, Int32s, Ints
from shellmb.errors import SceneError
from shellmb.meshes.curve_mesh import LineMesh
from shellmb.meshes.spaces import MixedSpace
from shellmb.scene.multibody.offsets import Offset, arm_components, node_of

# a point must lie on a node to within this fraction of the body's length
ON_NODE = 1e-6

Place = str | tuple[str, ...] | tuple[float, float, float]


class Meshed(Protocol):
    """A body with a mesh: a shell, a beam or a placed body of a user's own."""

    name: str
    mixed: MixedSpace

    @property
    def domain(self) -> Any:
        """Mesh of the body with names: a `SurfaceMesh`, `LineMesh` or `FieldMesh`."""
        ...

    def node_directors(self) -> Floats:
        """Reference directors of the local nodes (owned and ghost), shape (n, m, 3)."""
        ...


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
    distance = np.linalg.norm(nodes - point, axis=1)
    comm = body.domain.mesh.comm
    nearest = comm.allreduce(
        min(zip(distance, map(tuple, nodes), strict=True), default=(np.inf, ())), op=_least
    )
    if nearest[0] > ON_NODE * body.domain.length:
        raise SceneError(
            f"{who}: {body.domain.kind} '{body.name}' has no node at {shown(point)}; "
            f"the nearest one is at {shown(nearest[1])}"
        )
    here = np.flatnonzero(distance <= ON_NODE * body.domain.length).astype(np.int32)
    owned = body.mixed.subspaces["u"].dofmap.index_map.size_local
    count = comm.allreduce(int(np.sum(here < owned)))
    if count > 1:
        close = ON_NODE * body.domain.length
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


def _least(a: tuple, b: tuple) -> tuple:
    return min(a, b)


def said_point(x: Floats, size: float) -> str:
    """A position for messages; what is round-off of a scene of that size is zero."""
    return f"({', '.join(f'{c:g}' for c in np.where(np.abs(x) < ON_NODE * size, 0.0, x))})"


def part_dofs(body: Meshed, nodes: Int32s, part: str) -> Int32s:
    """Local dofs of a part at nodes, shape (n, size)."""
    return body.mixed.nodal(part)[nodes]


def shared_nodes(body: Meshed, where: Place | None, who: str) -> Nodes:
    """The nodes at a place, or all, gathered from all ranks and sorted by position."""
    local = local_nodes(body, where, who)
    owned = body.mixed.subspaces["u"].dofmap.index_map.size_local
    local = local[local < owned]
    index_map = body.mixed.space.dofmap.index_map
    parts = [p for p in ("u", "w", "lam") if p in body.mixed.parts]
    record = (
        body.mixed.nodes("u")[local],
        {
            p: index_map.local_to_global(part_dofs(body, local, p).ravel()).reshape(
                len(local), body.mixed.parts[p][1]
            )
            for p in parts
        },
        body.node_directors()[local],
    )
    gathered = body.domain.mesh.comm.allgather(record)
    x = np.concatenate([g[0] for g in gathered])
    # sort by rounded coordinates, so that every rank and every body of a join agrees
    rounded = np.round(x / (ON_NODE * body.domain.length)).astype(np.int64)
    order = np.lexsort(rounded.T[::-1])
    return Nodes(
        x[order],
        {p: np.concatenate([g[1][p] for g in gathered])[order] for p in parts},
        np.concatenate([g[2] for g in gathered])[order],
    )
