"""Meshes and function spaces that share cells and numbering with others.

DOLFINx's own functions distribute cells and number unknowns anew, with communicators for each. Its
constructors take what there is.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import dolfinx.mesh
import ufl
from dolfinx import cpp, fem  # type: ignore[attr-defined]

from shellmb.arrays import Floats


class Layout(NamedTuple):
    """Layout of a function space without its mesh, which a twin of the mesh may have.

    Args:
        element: Element of UFL.
        compiled: Element of DOLFINx.
        dofmap: Numbers of the unknowns of each cell.
    """

    element: Any
    compiled: Any
    dofmap: Any

    @classmethod
    def of(cls, space: fem.FunctionSpace) -> Layout:
        """Layout of a space."""
        made = space._cpp_object
        return cls(space.ufl_element(), made.element, made.dofmap)

    def on(self, mesh: dolfinx.mesh.Mesh) -> fem.FunctionSpace:
        """A space with this layout.

        Args:
            mesh: The mesh it was made on, or a twin.
        """
        made = cpp.fem.FunctionSpace_float64(mesh._cpp_object, self.compiled, self.dofmap)
        return fem.FunctionSpace(mesh, self.element, made)


def twin(mesh: dolfinx.mesh.Mesh, element: Any, x: Floats) -> dolfinx.mesh.Mesh:
    """A mesh with the cells of another one and nodes elsewhere; collective.

    Args:
        mesh: The other one.
        element: Its element of coordinates.
        x: Positions of all nodes in the order in which it was made of them, shape (n, 3) [m].
    """
    geometry = mesh.geometry
    moved = cpp.mesh.Geometry_float64(
        geometry.index_map(),
        geometry.dofmaps[0],
        geometry.cmaps[0]._cpp_object,
        x[geometry.input_global_indices],
        geometry.input_global_indices,
    )
    made = cpp.mesh.Mesh_float64(mesh.comm, mesh.topology._cpp_object, moved)
    return dolfinx.mesh.Mesh(made, ufl.Mesh(element))
