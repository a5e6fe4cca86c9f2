"""Node meshes: one unit interval per node or pair of nodes, for forms that act on single nodes.

A field on a node mesh is piecewise constant, so `dx` over a cell evaluates the integrand once per
node, and one kernel serves any number of nodes. Its dofs are identified with the dofs of a
body's nodes in the block system, so the form acts on the body itself.

What has no node of a body, multipliers of joints and frames of rigid bodies, are global real-space
unknowns in this way: on one cell `DG 0` is `basix.ufl.real_element`, to the last digit. Real
elements of their own would need a mesh for each joint and a call for each of them, 12 to 15 times
the time for 16 joints (`tests/meshes/test_real_elements.py`).
"""

from dataclasses import dataclass
from typing import Any

from mpi4py import MPI

import basix
import basix.ufl
import numpy as np
from dolfinx import fem, mesh

from shellmb.arrays import Floats, Ints
from shellmb.meshes.shared import line_mesh, space_on
from shellmb.meshes.spaces import MixedSpace, mixed_space


@dataclass(frozen=True)
class NodeMesh:
    """A node mesh and which of its local cells stands for which node.

    Args:
        mesh: Interval mesh with one cell of unit length per node.
        item: For each local cell (owned and ghost) the index of its node in the list it was made
        of.
    """

    mesh: mesh.Mesh
    item: Ints


def node_mesh(comm: MPI.Comm, count: int) -> NodeMesh:
    """Mesh of `count` disconnected intervals of unit length, shared out over the ranks.

    Args:
        comm: Communicator.
        count: Number of nodes (or pairs of nodes), at least one.
    """
    # disconnected intervals: each has its own two vertices
    cells = np.arange(2 * count, dtype=np.int64).reshape(-1, 2)
    x = np.zeros((2 * count, 3))
    x[:, 0] = np.arange(2 * count)
    element = basix.ufl.element("Lagrange", "interval", 1, shape=(3,))
    domain = line_mesh(comm, element, cells, x)
    # the coordinate tells which node a cell stands for, wherever the cell went
    start = domain.geometry.x[domain.geometry.dofmaps[0]].reshape(-1, 2, 3)[:, :, 0].min(axis=1)
    return NodeMesh(domain, np.rint(start / 2).astype(np.int64))


def node_space(nodes: NodeMesh, parts: dict[str, int]) -> MixedSpace:
    """Space of constants per node.

    Args:
        nodes: The node mesh.
        parts: Name to number of components of each part.
    """
    elements = {name: _constant(size) for name, size in parts.items()}
    mixed = mixed_space(nodes.mesh, elements, frozenset())
    for name, size in parts.items():
        # in the order of the cells, which is that of `nodes.item`
        cells = mixed.subspaces[name].dofmap.list[:, 0]
        mixed.dofs[name] = mixed.dofs[name].reshape(-1, size)[cells].ravel()
    return mixed


def _constant(size: int) -> Any:
    """Element of so many constants for each node."""
    return basix.ufl.element("DG", "interval", 0, shape=(size,) if size > 1 else ())


def constant_vector(nodes: NodeMesh, values: Floats, name: str) -> fem.Function:
    """Function with one vector per node.

    Args:
        nodes: The node mesh.
        values: One row per node, shape (n, size).
        name: Name of the function.
    """
    space = space_on(nodes.mesh, _constant(values.shape[1]))
    function = fem.Function(space, name=name)
    set_constants(function, nodes, values)
    return function


def set_constants(function: fem.Function, nodes: NodeMesh, values: Floats) -> None:
    """Give a function of `constant_vector` new values, shape (n, size)."""
    cells = function.function_space.dofmap.list[:, 0]
    function.x.array.reshape(-1, values.shape[1])[cells] = values[nodes.item]
