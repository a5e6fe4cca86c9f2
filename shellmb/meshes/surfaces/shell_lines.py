"""Lines of a shell's mesh, node by node: where reinforcing beams run, and take their mesh from."""

import itertools
from dataclasses import dataclass
from typing import Any

from mpi4py import MPI

import dolfinx.mesh
import numpy as np
import numpy.typing as npt
from dolfinx import fem

from shellmb.arrays import Floats, Int32s, Ints
from shellmb.errors import SceneError
from shellmb.meshes.curve_mesh import LineMesh, line_mesh_from_nodes
from shellmb.meshes.mesh import SurfaceMesh
from shellmb.meshes.raw import ties
from shellmb.meshes.spaces import MixedSpace
from shellmb.meshes.surfaces.structured import EDGES
from shellmb.scene.beams.beam import Beam
from shellmb.scene.beams.curves import AlongEdge, AlongLine
from shellmb.scene.shells.surfaces import Surface

# nodes closer to a line than this fraction of the shell's length are on it
ON_LINE = 1e-6


# parts of a shell that live at its nodes
NODAL = ("u", "w", "lam")


@dataclass(frozen=True)
class ShellLine:
    """A line of a shell's mesh and the beam's mesh on it; all but the mesh the same on all ranks.

    Args:
        line: The beam's mesh.
        x: Positions of the nodes in the order of the line, shape (n, 3) [m].
        dofs: Part name to the nodes' global dofs in the shell's mixed space, shape (n, size).
    """

    line: LineMesh
    x: Floats
    dofs: dict[str, Ints]


# element edges, each from its first to its second vertex: "vertices", their numbers in the input,
# shape (m, 2); "corners", nodes of the geometry, shape (m, order + 1, 3); and of shape
# (m, k + 1, size) "x", nodes of the displacement, "directors" there, and global dofs by part
type Edges = dict[str, npt.NDArray[Any]]


def shell_line(
    beam: Beam, surface: Surface, shell: SurfaceMesh, mixed: MixedSpace, directors: Floats
) -> ShellLine:
    """Mesh of a beam along a shell; collective.

    Args:
        beam: The beam, of the shell's degree; its curve is ``AlongEdge`` or ``AlongLine`` of the
            shell.
        surface: The shell's surface, whose parameters give edges their direction; the edge of a
            mesh without any begins at the end with the smaller coordinates.
        shell: The shell's mesh.
        mixed: The shell's space.
        directors: The shell's directors at the local nodes (owned and ghost), shape (n, 3).

    Raises:
        SceneError: If the line does not follow element edges from one end to the other.
    """
    name, curve = beam.name, beam.curve
    if isinstance(curve, AlongEdge):
        who = f"beam '{name}': edge '{curve.edge}' of shell '{shell.name}'"
        edges = element_edges(shell, mixed, directors, shell.facets(curve.edge, f"beam '{name}'"))
        if not len(edges["vertices"]):
            raise SceneError(f"{who} has no element edges; it must have some")
        chain, closed = _chain(edges["vertices"], who)
        chain = _along_parameter(chain, closed, edges, surface, curve.edge)
    elif isinstance(curve, AlongLine):
        start, end = (shell.point(p, f"beam '{name}'") for p in (curve.start, curve.end))
        said = " to ".join(f"({', '.join(f'{c:g}' for c in p)})" for p in (start, end))
        who = f"beam '{name}': the straight line from {said} in shell '{shell.name}'"
        edges = element_edges(shell, mixed, directors, _on_line(shell, start, end))
        chain, closed = _straight(edges, start, end, ON_LINE * shell.length, who), False
    else:
        raise SceneError(f"beam '{name}': its curve is not one along a shell's mesh; it must be")
    return _meshed(name, shell.mesh.comm, edges, chain, closed, beam.degree)


def _vertices_of(shell: SurfaceMesh, facets: Int32s) -> Int32s:
    """Nodes of the geometry of edges: the two vertices first, shape (m, order + 1)."""
    if not len(facets):
        return np.zeros((0, 2), dtype=np.int32)
    return np.asarray(dolfinx.mesh.entities_to_geometry(shell.mesh, 1, facets))


def _on_line(shell: SurfaceMesh, start: Floats, end: Floats) -> Int32s:
    """Owned element edges all nodes of which are on a segment."""
    facets = np.arange(shell.mesh.topology.index_map(1).size_local, dtype=np.int32)
    x = shell.mesh.geometry.x[_vertices_of(shell, facets)]
    length = float(np.linalg.norm(end - start))
    along = (x - start) @ (end - start) / length
    away = np.linalg.norm(x - start - along[..., None] * (end - start) / length, axis=-1)
    near = ON_LINE * shell.length
    inside = (away < near) & (along > -near) & (along < length + near)
    return facets[inside.all(axis=1)] if len(facets) else facets


def element_edges(
    shell: SurfaceMesh, mixed: MixedSpace, directors: Floats, facets: Int32s
) -> Edges:
    """Edges of all ranks, each once, in the same order on every rank."""
    mesh, space = shell.mesh, mixed.subspaces["u"]
    facets = facets[facets < mesh.topology.index_map(1).size_local]
    ends = _vertices_of(shell, facets)
    order = mesh.geometry.cmaps[0].degree
    nodes = _displacement_nodes(space, facets)
    corners = mesh.geometry.x[ends].reshape(len(facets), order + 1 if len(facets) else 2, 3)
    x = space.tabulate_dof_coordinates()[nodes].reshape(*nodes.shape, 3)
    dofs: dict[str, Ints] = {}
    for part in NODAL:
        size = mixed.parts[part][1]
        local = mixed.dofs[part].reshape(-1, size)[nodes]
        dofs[part] = mixed.numbers(local)
    # nodes in between by their place along the edge: it is monotone on any sensible element
    first, last = corners[:, :1], corners[:, 1:2]
    chord = last - first

    def sorted_along(points: Floats) -> Ints:
        return np.argsort(np.sum((points - first) * chord, axis=-1), axis=1)

    def take(values: npt.NDArray[Any], by: Ints) -> npt.NDArray[Any]:
        return np.take_along_axis(values, by[..., None], axis=1)

    by = sorted_along(x)
    mine: Edges = {
        "vertices": np.asarray(mesh.geometry.input_global_indices[ends[:, :2]], dtype=np.int64),
        "corners": take(corners, sorted_along(corners)),
        "x": take(x, by),
        "directors": take(directors[nodes], by),
        **{part: take(values, by) for part, values in dofs.items()},
    }
    found = [part for part in mesh.comm.allgather(mine) if len(part["vertices"])] or [mine]
    every = {key: np.concatenate([part[key] for part in found]) for key in mine}
    number = np.lexsort(np.sort(every["vertices"], axis=1).T)
    return {key: values[number] for key, values in every.items()}


def _displacement_nodes(space: fem.FunctionSpace, facets: Int32s) -> Int32s:
    """Local nodes of a space on edges, in any order, shape (m, k + 1)."""
    closure = np.array(space.element.basix_element.entity_closure_dofs[1])
    to_cell, to_facet = (space.mesh.topology.connectivity(*d) for d in ((1, 2), (2, 1)))
    cells = to_cell.array[to_cell.offsets[facets]]
    sides = to_facet.array.reshape(-1, len(closure))[cells] == facets[:, None]
    return np.asarray(space.dofmap.list[cells[:, None], closure[sides.argmax(axis=1)]])


def _chain(vertices: Ints, who: str) -> tuple[list[int], bool]:
    """Vertices in a row, and whether they close; the closed row does not repeat its first.

    Raises:
        SceneError: If the edges do not make one line without branches.
    """
    beside = ties(vertices)
    ends = sorted(v for v, near in beside.items() if len(near) == 1)
    if any(len(near) > 2 for near in beside.values()) or len(ends) not in (0, 2):
        raise SceneError(f"{who} is not one line of element edges; it must be one, unbranched")
    chain = [ends[0] if ends else min(beside)]
    while True:
        ahead = [v for v in beside[chain[-1]] if len(chain) < 2 or v != chain[-2]]
        if not ahead or ahead[0] == chain[0]:
            break
        chain.append(ahead[0])
    if len(chain) != len(beside):
        raise SceneError(f"{who} is in several pieces; it must be one line of element edges")
    return chain, not ends


def _places(edges: Edges) -> dict[int, Floats]:
    """Positions of the vertices."""
    places: dict[int, Floats] = {}
    for (a, b), corners in zip(edges["vertices"].tolist(), edges["corners"], strict=True):
        places[a], places[b] = corners[0], corners[-1]
    return places


def _along_parameter(
    chain: list[int], closed: bool, edges: Edges, surface: Surface, edge: str
) -> list[int]:
    """The chain in the direction in which the surface's parameter grows."""
    places = _places(edges)
    if surface.edges is None or edge not in EDGES:
        # no parameters: by the coordinates of the ends, the same whatever the mesh's numbering
        if closed:
            k = min(range(len(chain)), key=lambda k: tuple(places[chain[k]]))
            chain = chain[k:] + chain[:k]
            back = tuple(places[chain[-1]]) < tuple(places[chain[1]])
            return [chain[0], *reversed(chain[1:])] if back else chain
        return chain[::-1] if tuple(places[chain[-1]]) < tuple(places[chain[0]]) else chain
    begin, grows = EDGES[edge]
    step = 1 / (len(chain) if closed else len(chain) - 1)
    parameters = np.array([begin, begin])
    parameters[1, grows] = step
    first, second = surface.position(*parameters.T).T

    def nearest(point: Floats, among: list[int]) -> int:
        return min(among, key=lambda k: float(np.linalg.norm(places[chain[k]] - point)))

    k = nearest(first, list(range(len(chain))) if closed else [0, len(chain) - 1])
    if not closed:
        return chain if k == 0 else chain[::-1]
    chain = chain[k:] + chain[:k]
    return chain if nearest(second, [1, len(chain) - 1]) == 1 else [chain[0], *chain[:0:-1]]


def _straight(edges: Edges, start: Floats, end: Floats, near: float, who: str) -> list[int]:
    """Vertices on a segment from its start to its end.

    Raises:
        SceneError: If element edges do not cover the segment.
    """
    places = _places(edges)
    order = sorted(places, key=lambda v: float((places[v] - start) @ (end - start)))
    pairs = {frozenset(pair) for pair in edges["vertices"].tolist()}
    for a, b in itertools.pairwise(order):
        if frozenset((a, b)) not in pairs:
            at = ", ".join(f"{c:g}" for c in places[a])
            raise SceneError(f"{who} leaves the element edges at ({at}); it must follow them")
    for vertex, point in ((order[:1], start), (order[-1:], end)):
        if not vertex or np.linalg.norm(places[vertex[0]] - point) > near:
            at = ", ".join(f"{c:g}" for c in point)
            raise SceneError(
                f"{who} has no element edge at ({at}); it must follow element edges from one "
                "vertex of the mesh to another"
            )
    return order


def _meshed(
    name: str, comm: MPI.Comm, edges: Edges, chain: list[int], closed: bool, degree: int
) -> ShellLine:
    """The beam's mesh from the edges between the vertices of a chain."""
    number = {frozenset(pair): k for k, pair in enumerate(edges["vertices"].tolist())}
    around = [*chain, chain[0]] if closed else chain
    steps = list(itertools.pairwise(around))
    rows = np.array([number[frozenset(step)] for step in steps])
    turned = edges["vertices"][rows, 0] != np.array([a for a, _ in steps])

    def in_a_row(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        ordered = values[rows].copy()
        ordered[turned] = ordered[turned][:, ::-1]
        flat = ordered[:, :-1].reshape(-1, values.shape[-1])
        return flat if closed else np.concatenate([flat, ordered[-1:, -1]])

    corners = in_a_row(edges["corners"])
    order = edges["corners"].shape[1] - 1
    line = line_mesh_from_nodes(
        name, comm, corners, order, in_a_row(edges["directors"]), degree, closed
    )
    return ShellLine(line, in_a_row(edges["x"]), {part: in_a_row(edges[part]) for part in NODAL})
