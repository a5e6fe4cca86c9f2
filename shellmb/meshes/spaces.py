"""Mixed function spaces of shells and beams, with the places of their parts.

Quadrilaterals: Q_k displacement and director; triangles: P2 for both; forces of each element are
those of `meshes.tying`. Lines: P_k displacement and directors, DP_{k-1} forces at the Gauss points.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any

import basix
import basix.ufl
import numpy as np
import ufl
from dolfinx import fem, mesh
from ufl.core.expr import Expr

from shellmb.arrays import Floats, Int32s, Ints
from shellmb.meshes.shared import collapsed, space_on
from shellmb.meshes.tying import shell_forces

# An element of Basix, whose class has no public name
Element = Any

NO_PARTS: Mapping[str, int] = MappingProxyType({})


@dataclass(frozen=True)
class MixedSpace:
    """A mixed space and where its parts are.

    Args:
        space: The mixed space `W`.
        parts: Name to (first component, number of components) of the value.
        dofs: Name to local dofs (owned and ghost) in `W`, unrolled; of nodal parts of shape
            (n * size,). Parts on the same nodes list them in the same order.
        subspaces: Name to the collapsed space of the part; of the parts on the same nodes only the
            first one's order is that of `dofs`.
        elementwise: Names of the parts that are discontinuous between elements.
        stresses: Names of those that belong to strains as stresses of linear sections do: where
            these are moments over a step, so are they.
    """

    space: fem.FunctionSpace
    parts: dict[str, tuple[int, int]]
    dofs: dict[str, Int32s]
    subspaces: dict[str, fem.FunctionSpace]
    elementwise: frozenset[str]
    stresses: frozenset[str] = frozenset()

    @cached_property
    def arguments(self) -> tuple[tuple[Expr, Expr], Expr]:
        """Test functions of two rows in one form, and a trial function."""
        element, size = self.space.ufl_element(), self.space.value_size
        both = space_on(self.space.mesh, basix.ufl.mixed_element([element, element]))
        test = ufl.TestFunction(both)
        first, second = (ufl.as_vector([test[k] for k in range(n, n + size)]) for n in (0, size))
        return (first, second), ufl.TrialFunction(self.space)

    def owned(self, part: str) -> Int32s:
        """Dofs of a part that this rank owns."""
        dofs = self.dofs[part]
        return dofs[dofs < self.space.dofmap.index_map.size_local]

    def numbers(self, dofs: Int32s) -> Ints:
        """Global numbers of local dofs, in the shape of these."""
        numbers = self.space.dofmap.index_map.local_to_global(dofs.ravel())
        return np.asarray(numbers.reshape(dofs.shape))

    def nodal(self, part: str) -> Int32s:
        """Dofs of a part on the nodes of displacements, shape (n, size), size 0 without any."""
        return self.dofs[part].reshape(len(self.dofs["u"]) // 3, self.parts[part][1])

    def nodes(self, part: str) -> Floats:
        """Coordinates of the nodes of a part, shape (n, 3)."""
        return self.subspaces[part].tabulate_dof_coordinates()


def mixed_space(
    domain: mesh.Mesh, elements: dict[str, Element], elementwise: frozenset[str]
) -> MixedSpace:
    """Mixed space with one named part per element.

    Args:
        domain: Mesh of the body.
        elements: Name of the part to its element.
        elementwise: Parts that are discontinuous.
    """
    space = space_on(domain, basix.ufl.mixed_element(list(elements.values())))
    parts: dict[str, tuple[int, int]] = {}
    dofs: dict[str, Int32s] = {}
    subspaces: dict[str, fem.FunctionSpace] = {}
    first = 0
    for k, (name, element) in enumerate(elements.items()):
        size = int(space.sub(k).value_size)
        parts[name] = (first, size)
        first += size
        subspaces[name], places = collapsed(space, k)
        dofs[name] = np.asarray(places, dtype=np.int32).ravel()
        if name in elementwise:
            continue
        before = [n for n in list(elements)[:k] if n not in elementwise]
        twin = next((n for n in before if _same_nodes(elements[n], element)), None)
        if twin is not None:
            order = _order_like(subspaces[twin], subspaces[name])
            dofs[name] = dofs[name].reshape(-1, size)[order].ravel()
    return MixedSpace(space, parts, dofs, subspaces, elementwise)


def _same_nodes(a: Element, b: Element) -> bool:
    """Decide whether two elements are continuous, of Lagrange type, and have the same nodes."""
    one, two = a.basix_element, b.basix_element
    return bool(one == two) and not one.discontinuous and one.family == basix.ElementFamily.P


def _order_like(first: fem.FunctionSpace, second: fem.FunctionSpace) -> Int32s:
    """Number in `second` of each node of `first`: collapsing a space may renumber."""
    count = first.dofmap.index_map.size_local + first.dofmap.index_map.num_ghosts
    order = np.empty(count, dtype=np.int32)
    order[first.dofmap.list.ravel()] = second.dofmap.list.ravel()
    return order


def shell_space(
    domain: mesh.Mesh, degree: int, assumed_strains: bool, constant: Mapping[str, int] = NO_PARTS
) -> MixedSpace:
    """Space of displacement, director change, resultants and director multiplier.

    Args:
        domain: Surface mesh.
        degree: Polynomial degree of displacement and director (2 or 3; 2 on triangles).
        assumed_strains: Whether elements have strains `S` of their own beside the forces.
        constant: More parts with their sizes, which are constant on each cell.
    """
    cell = domain.basix_cell()
    nodal = basix.ufl.element("Lagrange", cell, degree, shape=(3,))
    forces = shell_forces(cell, degree).element
    elements = {"u": nodal, "w": nodal, "N": forces}
    if assumed_strains:
        elements["S"] = forces
    elements["lam"] = basix.ufl.element("Lagrange", cell, degree)
    elements |= _constants(cell, constant)
    return mixed_space(domain, elements, frozenset({"N", "S"} & elements.keys()))


def _local(cell: basix.CellType, degree: int, size: int) -> Element:
    """Polynomials of each element by itself, with nodes inside it.

    On quadrilaterals and lines these are the Gauss points.
    """
    variant = basix.LagrangeVariant.gl_warped
    return basix.ufl.element("P", cell, degree, variant, shape=(size,), discontinuous=True)


def reading_element(nodes: fem.FunctionSpace) -> basix.finite_element.FiniteElement:
    """Polynomials through points of an element where resultants are accurate.

    Args:
        nodes: Space of displacements.
    """
    element = nodes.element.basix_element
    return _local(element.cell_type, element.degree - 1, 1).basix_element


def reading_space(nodes: fem.FunctionSpace, size: int) -> fem.FunctionSpace:
    """Space of values at these points, a vector at each.

    Args:
        nodes: Space of displacements.
        size: Number of components.
    """
    element = nodes.element.basix_element
    return space_on(nodes.mesh, _local(element.cell_type, element.degree - 1, size))


def _constants(cell: Any, sizes: Mapping[str, int]) -> dict[str, Element]:
    return {p: basix.ufl.element("DG", cell, 0, shape=(size,)) for p, size in sizes.items()}


def constant_space(domain: mesh.Mesh, sizes: Mapping[str, int]) -> MixedSpace:
    """Space of parts that are constant on each cell.

    Args:
        domain: Mesh of the body.
        sizes: Their sizes by name.
    """
    return mixed_space(domain, _constants(domain.basix_cell(), sizes), frozenset())


def beam_space(
    domain: mesh.Mesh, degree: int, constant: Mapping[str, int] = NO_PARTS
) -> MixedSpace:
    """Space of displacement, changes of three directors, forces and frame multipliers.

    Args:
        domain: Line mesh.
        degree: Polynomial degree of displacement and directors (2 or 3).
        constant: More parts with their sizes, which are constant on each cell.
    """

    def nodal(size: int) -> Element:
        return basix.ufl.element("Lagrange", "interval", degree, shape=(size,))

    forces = _local(basix.CellType.interval, degree - 1, 3)
    elements = {"u": nodal(3), "w": nodal(9), "N": forces, "lam": nodal(6)}
    elements |= _constants("interval", constant)
    return replace(mixed_space(domain, elements, frozenset({"N"})), stresses=frozenset({"N"}))
