"""Reference directors at the nodes of a shell: unit normals, consistently oriented."""

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem, la

from shellmb.build.mesh import SurfaceMesh
from shellmb.errors import SceneError
from shellmb.kernels import JIT_OPTIONS


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
        SceneError: If the normals around a node cancel (the surface is not orientable or folded).
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
    director.x.array[:] = (values / length[:, None]).ravel()
    director.x.scatter_forward()
    return director


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
    function.interpolate(fem.Expression(normal, points, jit_options=JIT_OPTIONS))
    per_node = function.x.array.reshape(-1, 3)
    owned = domain.topology.index_map(2).size_local
    total = la.vector(nodal.dofmap.index_map, nodal.dofmap.index_map_bs)
    sums = total.array.reshape(-1, 3)
    oriented = surface.cell_normal_sign[:owned, None, None] * per_node[broken.dofmap.list[:owned]]
    np.add.at(sums, nodal.dofmap.list[:owned], oriented)
    total.scatter_reverse(la.InsertMode.add)
    total.scatter_forward()
    return total.array.reshape(-1, 3)
