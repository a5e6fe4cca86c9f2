"""Reference directors at the nodes of a shell: unit normals, consistently oriented."""

import basix
import numpy as np
from dolfinx import fem

from shellmb.errors import SceneError
from shellmb.meshes.mesh import SurfaceMesh
from shellmb.meshes.raw import shown
from shellmb.meshes.shared import sums_at_nodes
from shellmb.meshes.tying import tangents_at

# angle between the director of a fold and the normals beside it beyond which it is refused,
# degrees: the end of a bracket of two squares of 8x8 quadrilaterals moves by 1.002 of what it
# should at 45, 1.005 at 47.5, 1.016 at 50 and 1.25 at 60 (that of `tests/meshes/test_folds.py`)
STEEPEST = 47.5
# and at single nodes, where three and more faces meet: 54.7 at the corner of a box
STEEPEST_CORNER = 60.0
# cosine of an angle between directors of an element that is that of a fold, not of a curve
FOLD = 0.5


def reference_director(
    surface: SurfaceMesh, nodal: fem.FunctionSpace, degree: int, name: str
) -> fem.Function:
    """Unit director at every node: the exact normal, or else the mean of the cells' normals.

    The mean is weighted by the angle of each cell at the node, so that it does not depend on how
    the surface is cut into cells.

    Args:
        surface: Meshed surface.
        nodal: Vector-valued Lagrange space of the director.
        degree: Its polynomial degree.
        name: Name of the shell, for error messages.

    Raises:
        SceneError: If the normals around a node cancel (the surface is not orientable or folded),
            an element is turned over, or the surface is folded by more than its director can
            follow.
    """
    director = fem.Function(nodal, name="D")
    owned = surface.mesh.topology.index_map(2).size_local
    points = np.asarray(nodal.element.basix_element.points)
    tangents = np.stack(tangents_at(surface.mesh, points))[:, :owned]
    normals = np.cross(tangents[0], tangents[1])
    normals *= surface.cell_normal_sign[: len(normals), None, None]
    read = surface.normal is None
    if surface.normal is not None:
        values = surface.normal(nodal.tabulate_dof_coordinates().T).T
    else:
        values = _mean_normals(nodal, tangents, normals)
    length = np.linalg.norm(values, axis=1)
    cancelled = surface.mesh.comm.allreduce(int(np.sum(length < 1e-3)))
    if cancelled:
        raise SceneError(
            f"shell '{name}': the normals of its cells cancel at {cancelled} nodes; "
            "the surface must be smooth and orientable, split it at folds and join the parts"
        )
    values = values / length[:, None]
    if read:
        _refuse_folded(surface, nodal, normals, values, name)
    _refuse_turned(surface, nodal, normals, values, name)
    director.x.array[:] = values.ravel()
    director.x.scatter_forward()
    return director


def _refuse_folded(
    surface: SurfaceMesh,
    nodal: fem.FunctionSpace,
    normals: np.ndarray,
    directors: np.ndarray,
    name: str,
) -> None:
    """Refuse folds at which a director leans so far from the normals that it carries too little."""
    nodes = nodal.dofmap.list[: len(normals)]
    size = np.linalg.norm(normals, axis=2)
    with np.errstate(invalid="ignore", divide="ignore"):
        lean = np.einsum("cpi,cpi->cp", normals, directors[nodes]) / size
    element = nodal.element.basix_element
    limits = np.full(lean.shape[1], STEEPEST)
    limits[[dofs[0] for dofs in element.entity_dofs[0]]] = STEEPEST_CORNER
    sharp = lean < np.cos(np.radians(limits))
    # with their ends
    sharp = sharp.any(axis=1)[:, None] & (lean < np.cos(np.radians(STEEPEST)))
    places = nodal.tabulate_dof_coordinates()
    here = [(float(lean[c, p]), places[nodes[c, p]].tolist()) for c, p in np.argwhere(sharp)]
    found = [pair for part in surface.mesh.comm.allgather(here) for pair in part]
    if not found:
        return
    points = np.unique(np.array([place for _, place in found]), axis=0)
    # the fold's ends: those of its nodes that are farthest along its longest direction
    along = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2][0]
    order = np.argsort((points - points.mean(axis=0)) @ along)
    first, last = (shown(points[k], surface.length) for k in (order[0], order[-1]))
    where = f"at {first}" if first == last else f"between {first} and {last}"
    worst = np.degrees(np.arccos(max(-1.0, min(found)[0])))
    raise SceneError(
        f"shell '{name}': its mesh is folded {where}, so that elements lean by up to {worst:.0f} "
        f"degrees from the director they share; it must be less than {STEEPEST:g} degrees (a fold "
        f"of {2 * STEEPEST:g}), as it would be too soft there: make the parts shells, by group or "
        "where, and join them"
    )


def _refuse_turned(
    surface: SurfaceMesh,
    nodal: fem.FunctionSpace,
    normals: np.ndarray,
    directors: np.ndarray,
    name: str,
) -> None:
    """Refuse elements that are turned over: a director is on the positive side of all cells around.

    Corners where an element has no normal (poles) are left out.
    """
    size = np.linalg.norm(normals, axis=2)
    nodes = nodal.dofmap.list[: len(normals)]
    # beside the directors, which at an edge may be the normals of turned corners, the mean normal
    mean = np.broadcast_to(normals.sum(axis=1)[:, None], normals.shape)
    along = [np.einsum("cpi,cpi->cp", normals, v) for v in (directors[nodes], mean)]
    turned = (np.minimum(*along) <= 0) & (size > 1e-6 * size.max(axis=1, initial=0.0)[:, None])
    # where the map has no normal, a director is not a number
    turned |= ~np.isfinite(directors[nodes]).all(axis=2)
    places = nodal.tabulate_dof_coordinates()[np.unique(nodes[turned])]
    found = [place for part in surface.mesh.comm.allgather(places) for place in part.tolist()]
    if found:
        at = ", ".join(f"{v:.4g}" for v in found[0])
        raise SceneError(
            f"shell '{name}': an element is turned over, or the surface has no normal, at ({at}); "
            "use a map with independent derivatives everywhere, more elements, or geometry_order=1"
        )


def _mean_normals(
    nodal: fem.FunctionSpace, tangents: np.ndarray, normals: np.ndarray
) -> np.ndarray:
    """Sum of the unit normals of the cells around each node by their angles, shape (nodes, 3)."""
    size = np.linalg.norm(normals, axis=2)
    unit = normals / np.where(size > 0, size, np.inf)[..., None]
    return sums_at_nodes(nodal, _angles(nodal, tangents)[..., None] * unit)


def _angles(nodal: fem.FunctionSpace, tangents: np.ndarray) -> np.ndarray:
    """Angle of the cells at their nodes: at vertices their own, half a turn beside them."""
    element = nodal.element.basix_element
    angles = np.full(tangents.shape[1:3], np.pi)
    corners = np.asarray(basix.geometry(element.cell_type))
    for vertex, sides in enumerate(_sides(element.cell_type)):
        node = element.entity_dofs[0][vertex][0]
        a, b = (
            np.tensordot(corners[other] - corners[vertex], tangents[:, :, node], axes=1)
            for other in sides
        )
        cross = np.linalg.norm(np.cross(a, b), axis=1)
        angles[:, node] = np.arctan2(cross, np.einsum("ci,ci->c", a, b))
    return angles


def _sides(cell: basix.CellType) -> list[list[int]]:
    """The two vertices that each vertex of a cell has a side to."""
    pairs = basix.topology(cell)[1]
    count = len(basix.topology(cell)[0])
    return [[w for pair in pairs if v in pair for w in pair if w != v] for v in range(count)]
