"""Meshes and function spaces that share cells and numbering with others.

DOLFINx's own functions distribute cells and number unknowns anew, with communicators for each. Its
constructors take what there is.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import dolfinx.mesh
import numpy as np
import ufl
from dolfinx import cpp, fem  # type: ignore[attr-defined]

from shellmb.arrays import Floats, Int32s


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

    @classmethod
    def of_part(cls, space: fem.FunctionSpace, part: int) -> tuple[Layout, Int32s]:
        """Layout of a part of a mixed space as a space of its own.

        DOLFINx forgets where an edge runs the other way in a cell: nodes of degree 3 along it are
        then in the wrong order there, so that the numbers of cells are those of the whole.

        Args:
            space: The whole.
            part: Number of the part.

        Returns:
            The layout, and where its unknowns are in the whole.
        """
        own, found = space.sub(part).collapse()
        made, places = own.dofmap, np.asarray(found, dtype=np.int32).ravel()
        elements = space.ufl_element().sub_elements
        first, bs = sum(element.dim for element in elements[:part]), made.bs
        whole = space.dofmap.list[:, first : first + elements[part].dim : bs]
        number = np.zeros(places.max(initial=0) + 1, dtype=np.int32)
        number[places[::bs]] = np.arange(len(places) // bs)
        layout, right = cls.of(own), number[whole]
        if not np.array_equal(right, made.list):
            cells = cpp.graph.AdjacencyList_int32(right)
            dofmap = cpp.fem.DofMap(made.dof_layout, made.index_map, made.index_map_bs, cells, bs)
            layout = layout._replace(dofmap=dofmap)
        return layout, places

    def on(self, mesh: dolfinx.mesh.Mesh) -> fem.FunctionSpace:
        """A space with this layout.

        Args:
            mesh: The mesh it was made on, or a twin.
        """
        made = cpp.fem.FunctionSpace_float64(mesh._cpp_object, self.compiled, self.dofmap)
        return fem.FunctionSpace(mesh, self.element, made)


def moved_mesh(mesh: dolfinx.mesh.Mesh, element: Any, x: Floats) -> dolfinx.mesh.Mesh:
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
