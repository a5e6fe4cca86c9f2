"""Reference directors at the nodes of a shell: unit normals, consistently oriented."""

import basix
import basix.ufl
import numpy as np
import ufl
from dolfinx import fem, la

from shellmb.errors import SceneError
from shellmb.expressions import compiled_expression
from shellmb.meshes.mesh import SurfaceMesh


def reference_director(
    surface: SurfaceMesh, nodal: fem.FunctionSpace, degree: int, name: str
) -> fem.Function:
    """Unit director at every node: the exact normal, or else the mean of the cells' normals.

    Args:
        surface: Meshed surface.
        nodal: Vector-valued Lagrange space of the director.
        degree: Its polynomial degree.
        name: Name of the shell, for error messages.

    Raises:
        SceneError: If the normals around a node cancel (the surface is not orientable or folded),
            or an element is turned over.
    """
    director = fem.Function(nodal, name="D")
    if surface.normal is not None:
        values = surface.normal(nodal.tabulate_dof_coordinates().T).T
    else:
        values = _mean_normals(surface, nodal, degree)
    length = np.linalg.norm(values, axis=1)
    lost = surface.mesh.comm.allreduce(int(np.sum(length < 1e-3)))
    if lost:
        raise SceneError(
            f"shell '{name}': the normals of its cells cancel at {lost} nodes; "
            "the surface must be smooth and orientable, split it at folds and join the parts"
        )
    values = values / length[:, None]
    _refuse_turned(surface, nodal, values, name)
    director.x.array[:] = values.ravel()
    director.x.scatter_forward()
    return director


def _refuse_turned(
    surface: SurfaceMesh, nodal: fem.FunctionSpace, directors: np.ndarray, name: str
) -> None:
    """Refuse elements that are turned over: a director is on the positive side of all cells around.

    Corners where an element has no normal (poles) are left out.
    """
    domain = surface.mesh
    owned = domain.topology.index_map(2).size_local
    geometry, map_ = domain.geometry, domain.geometry.cmaps[0]
    variant = basix.LagrangeVariant(map_.variant)
    element = basix.create_element(basix.ElementFamily.P, domain.basix_cell(), map_.degree, variant)
    points = np.asarray(nodal.element.basix_element.points)
    gradients = np.asarray(element.tabulate(1, points))[1:, :, :, 0]
    x = np.asarray(geometry.x[geometry.dofmaps[0][:owned]])
    tangents = np.einsum("kpd,cdi->kcpi", gradients, x)
    normals = np.cross(tangents[0], tangents[1]) * surface.cell_normal_sign[:owned, None, None]
    size = np.linalg.norm(normals, axis=2)
    nodes = nodal.dofmap.list[:owned]
    # beside the directors, which at an edge may be the normals of turned corners, the mean normal
    mean = np.broadcast_to(normals.sum(axis=1)[:, None], normals.shape)
    along = [np.einsum("cpi,cpi->cp", normals, v) for v in (directors[nodes], mean)]
    turned = (np.minimum(*along) <= 0) & (size > 1e-6 * size.max(axis=1, initial=0.0)[:, None])
    # where the map has no normal, a director is not a number
    turned |= ~np.isfinite(directors[nodes]).all(axis=2)
    places = nodal.tabulate_dof_coordinates()[np.unique(nodes[turned])]
    found = [place for part in domain.comm.allgather(places) for place in part.tolist()]
    if found:
        at = ", ".join(f"{v:.4g}" for v in found[0])
        raise SceneError(
            f"shell '{name}': an element is turned over, or the surface has no normal, at ({at}); "
            "use a map with independent derivatives everywhere, more elements, or geometry_order=1"
        )


def _mean_normals(surface: SurfaceMesh, nodal: fem.FunctionSpace, degree: int) -> np.ndarray:
    """Sum of the oriented unit normals of the cells around each node, shape (nodes, 3)."""
    domain = surface.mesh
    cell = domain.basix_cell()
    broken = fem.functionspace(
        domain, basix.ufl.element("Lagrange", cell, degree, shape=(3,), discontinuous=True)
    )
    jacobian = ufl.Jacobian(domain)
    normal = ufl.cross(jacobian[:, 0], jacobian[:, 1])
    normal = normal / ufl.sqrt(ufl.dot(normal, normal))
    function = fem.Function(broken)
    points = broken.element.interpolation_points
    function.interpolate(compiled_expression(normal, points))
    per_node = function.x.array.reshape(-1, 3)
    owned = domain.topology.index_map(2).size_local
    total = la.vector(nodal.dofmap.index_map, nodal.dofmap.index_map_bs)
    sums = total.array.reshape(-1, 3)
    oriented = surface.cell_normal_sign[:owned, None, None] * per_node[broken.dofmap.list[:owned]]
    np.add.at(sums, nodal.dofmap.list[:owned], oriented)
    total.scatter_reverse(la.InsertMode.add)
    total.scatter_forward()
    return total.array.reshape(-1, 3)
