"""The mesh of one shell, distributed over the ranks, with its edges, points and positive side."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

from mpi4py import MPI

import basix
import basix.ufl
import dolfinx.mesh
import numpy as np
import numpy.typing as npt

from shellmb.arrays import Floats, Int32s, Ints
from shellmb.errors import SceneError, of_first
from shellmb.meshes import raw as plain
from shellmb.meshes.raw import CELLS, RawMesh, cell_cross, check_extent, vertex_count
from shellmb.meshes.shared import Described, shared_mesh
from shellmb.meshes.surfaces.structured import map_normals, structured_mesh
from shellmb.scene import MeshFile, Shell, Surface
from shellmb.scene.shells.gmsh_surfaces import Meshed


@dataclass(frozen=True)
class SurfaceMesh:
    """A meshed mid-surface.

    Args:
        name: Name of the shell.
        mesh: Mesh with tdim 2 and gdim 3.
        edges: Local indices of the facets (owned and ghost) of each named edge, sorted.
        points: Position of each named point, shape (3,) [m].
        vertices: Local indices of the vertex (owned or ghost) at each named point: one, or none on
            ranks that do not hold it.
        normal: Exact unit normals, (3, n) at positions (3, n); None where unknown.
        cell_normal_sign: For each local cell (owned and ghost) the sign with which
            ``cross(J[:, 0], J[:, 1])`` points to the positive side of the surface.
        length: Diagonal of the box around the surface [m].
        areas: Local indices of the cells (owned and ghost) of each named area, sorted.
    """

    name: str
    mesh: dolfinx.mesh.Mesh
    edges: dict[str, Int32s]
    points: dict[str, Floats]
    vertices: dict[str, Int32s]
    normal: Callable[[Floats], Floats] | None
    cell_normal_sign: npt.NDArray[np.int8]
    length: float
    areas: dict[str, Int32s]

    kind: ClassVar[str] = "shell"

    @property
    def regions(self) -> frozenset[str]:
        """Names of edges and areas."""
        return frozenset({*self.edges, *self.areas})

    def entities(self, names: str | tuple[str, ...], who: str) -> list[tuple[int, Int32s]]:
        """Facets of edges and cells of areas: dimension and sorted local indices of each.

        Args:
            names: Name or names of edges and areas.
            who: Who asks, for the error.

        Raises:
            SceneError: If there is no such edge or area.
        """
        each = (names,) if isinstance(names, str) else names
        edges = tuple(name for name in each if name not in self.areas)
        found = [(2, self.areas[name]) for name in each if name in self.areas]
        return [*([(1, self.facets(edges, who))] if edges else []), *found]

    def facets(self, edge: str | tuple[str, ...], who: str) -> Int32s:
        """Local indices of the facets of an edge or of several, sorted.

        Args:
            edge: Name or names.
            who: Who asks, for the error.

        Raises:
            SceneError: If there is no such edge.
        """
        names = (edge,) if isinstance(edge, str) else edge
        for name in names:
            if name not in self.edges:
                raise SceneError(
                    f"{who}: shell '{self.name}' has no edge '{name}'; its edges are "
                    f"{', '.join(f"'{n}'" for n in self.edges) or 'none'}"
                    + (f", its areas {', '.join(map(repr, self.areas))}" if self.areas else "")
                )
        return np.unique(np.concatenate([self.edges[name] for name in names]))

    def point(self, point: str | tuple[float, float, float], who: str) -> Floats:
        """Coordinates of a named point, or the coordinates given, shape (3,) [m].

        Args:
            point: Name or coordinates.
            who: Who asks, for the error.

        Raises:
            SceneError: If there is no such point.
        """
        if not isinstance(point, str):
            return np.array(point, dtype=float)
        if point not in self.points:
            raise SceneError(
                f"{who}: shell '{self.name}' has no point '{point}'; its points are "
                f"{', '.join(f"'{n}'" for n in self.points) or 'none'}"
            )
        return self.points[point]


def build_surface(shell: Shell, comm: MPI.Comm) -> SurfaceMesh:
    """Mesh the mid-surface of a shell.

    The mesh is made on rank 0 and then distributed, so that it is the same on any number of ranks.

    Args:
        shell: The shell.
        comm: Communicator of the mesh; the call is collective.

    Raises:
        SceneError: On every rank alike, if the surface cannot be meshed as described.
    """
    raw = of_first(comm, lambda: _raw(shell))
    corners = raw.x[raw.vertices]
    check_extent(np.abs(cell_cross(corners)).max(axis=1), "m^2", f"shell '{shell.name}'")
    mesh = _distribute(raw, comm)
    return SurfaceMesh(
        name=shell.name,
        mesh=mesh,
        edges=_local_edges(raw, mesh),
        points={name: raw.x[node].copy() for name, node in raw.points.items()},
        vertices=_local_vertices(raw, mesh),
        normal=_normal(shell.surface),
        cell_normal_sign=_signs(raw, mesh),
        length=float(np.linalg.norm(raw.x.max(axis=0) - raw.x.min(axis=0))),
        areas={
            name: np.flatnonzero(np.isin(mesh.topology.original_cell_index, cells)).astype(np.int32)
            for name, cells in raw.areas.items()
        },
    )


def _raw(shell: Shell) -> RawMesh:
    surface = shell.surface
    if not isinstance(surface, Meshed):
        return plain.with_areas(structured_mesh(shell), shell.areas, shell.name)
    # gmsh takes a second to load
    if isinstance(surface, MeshFile):
        from shellmb.meshes.files.shellmesh import file_mesh as read
    else:
        from shellmb.meshes.surfaces.gmsh_mesh import gmsh_mesh as read
    raw = plain.with_edges(read(shell), surface.edges_where, shell.name)
    return plain.refined(plain.with_areas(raw, shell.areas, shell.name), surface.refine)


def _normal(surface: Surface) -> Callable[[Floats], Floats] | None:
    """Exact normals: the surface's own, by its map, or none for a mesh of gmsh's."""
    if isinstance(surface, Meshed):
        return None
    if type(surface).normal is Surface.normal:
        return map_normals(surface)
    return surface.normal  # type: ignore[return-value]


def _distribute(raw: RawMesh, comm: MPI.Comm) -> dolfinx.mesh.Mesh:
    variant = basix.LagrangeVariant.equispaced
    element = basix.ufl.element("P", CELLS[raw.cell], raw.order, variant, shape=(3,))
    first = comm.rank == 0
    partitioner: Any = None
    if comm.size > 1:
        shared = dolfinx.mesh.GhostMode.shared_facet
        partitioner = dolfinx.mesh.create_cell_partitioner(shared, 2)  # type: ignore[call-arg]
    mesh = shared_mesh(
        Described(comm, element, raw.cells, raw.x),
        lambda e: dolfinx.mesh.create_mesh(
            comm,
            raw.cells if first else raw.cells[:0],
            e,
            raw.x if first else raw.x[:0],
            partitioner=partitioner,
        ),
    )
    for dim in ((1, 0), (1, 2), (2, 1), (0, 2), *([(2, 2)] if raw.areas else [])):
        mesh.topology.create_connectivity(*dim)
    return mesh


def _entities(mesh: dolfinx.mesh.Mesh, dim: int) -> tuple[Int32s, Ints]:
    """Local facets or vertices (owned and ghost), and the input numbers of their vertices.

    By these they are found without communication, the same on every rank.
    """
    index = mesh.topology.index_map(dim)
    every = np.arange(index.size_local + index.num_ghosts, dtype=np.int32)
    if not len(every):
        return every, np.zeros((0, dim + 1), dtype=np.int64)
    nodes = dolfinx.mesh.entities_to_geometry(mesh, dim, every)[:, : dim + 1]
    return every, mesh.geometry.input_global_indices[nodes]


def _local_edges(raw: RawMesh, mesh: dolfinx.mesh.Mesh) -> dict[str, Int32s]:
    """Facets of the named edges."""
    every, pairs = _entities(mesh, 1)
    key = np.array([len(raw.x), 1])
    keys = np.sort(pairs, axis=1) @ key
    return {
        name: every[np.isin(keys, np.sort(edge, axis=1) @ key)] for name, edge in raw.edges.items()
    }


def _local_vertices(raw: RawMesh, mesh: dolfinx.mesh.Mesh) -> dict[str, Int32s]:
    """Vertices at the named points."""
    every, numbers = _entities(mesh, 0)
    return {name: every[numbers[:, 0] == node] for name, node in raw.points.items()}


def _signs(raw: RawMesh, mesh: dolfinx.mesh.Mesh) -> npt.NDArray[np.int8]:
    """Compare each local cell's own normal with that of the input cell it came from."""
    nodes = mesh.geometry.dofmaps[0][:, : vertex_count(raw.cell)]
    cross = cell_cross(mesh.geometry.x[nodes])
    wanted = raw.normals[mesh.topology.original_cell_index]
    return np.where((cross * wanted).sum(axis=1) < 0, -1, 1).astype(np.int8)
