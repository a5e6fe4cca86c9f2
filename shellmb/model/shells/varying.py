"""Coefficients of forms from a shell's section: numbers, or fields where it varies.

A section that varies is evaluated at points of each element: on quadrilaterals at the Gauss points
of the rule that a coefficient is used with, where its field has its nodes, and on triangles at the
middle. So stiffness and mass are positive wherever forms are integrated, and what jumps at an edge
of elements belongs on each side to that side.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, Literal

from mpi4py import MPI

import basix
import basix.ufl
import numpy as np
import ufl
from dolfinx import fem, mesh
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.barrier import first_found
from shellmb.errors import SceneError
from shellmb.meshes.shared import space_on
from shellmb.scene import LinearSection, Shell
from shellmb.scene.shells.lamination import Layup

Rule = Literal["full", "nodes"]

# nodes of elements are drawn this far into them, as a part of the way to the middle: they tell
# which side of a jump along an edge is meant
INTO = 1e-6


class SectionFields:
    """Coefficients of a linear section.

    Args:
        shell: The shell.
        domain: Its mesh.
        at_rest: Whether the stiffness is that of statics; it is the long-term one otherwise.
    """

    def __init__(self, shell: Shell, domain: mesh.Mesh, at_rest: bool = False) -> None:
        assert isinstance(shell.section, LinearSection)
        self._section, self._domain, self._degree = shell.section, domain, shell.degree
        self._who = f"shell '{shell.name}'"
        self._layups: dict[Rule, Layup] = {}
        self._at_rest = at_rest

    def of(self, value: Callable[[Layup], Floats], rule: Rule = "full") -> Expr:
        """A number, or a symmetric matrix, as a coefficient.

        Args:
            value: What it is of the section at points (...), shape (...) or (..., n, n).
            rule: The rule that it is used with.
        """
        values = np.asarray(value(self._at(rule)), dtype=float)
        size = np.ndim(value(self._section.generic))
        if values.ndim == size:
            # nothing that it depends on varies
            return fem.Constant(self._domain, values)
        if size == 0:
            return self._field(values[..., None], rule)
        n = values.shape[-1]
        pairs = [(i, j) for i in range(n) for j in range(i, n)]
        field = self._field(np.stack([values[..., i, j] for i, j in pairs], axis=-1), rule)
        place = {pair: k for k, pair in enumerate(pairs)}
        return ufl.as_matrix(
            [[field[place[min(i, j), max(i, j)]] for j in range(n)] for i in range(n)]
        )

    def by_cell(self, value: Callable[[Layup], Floats]) -> Floats:
        """Means over the elements of this rank, shape (elements,), or one number for all."""
        values = np.asarray(value(self._at("full")), dtype=float)
        return values if values.ndim == 0 else values.mean(axis=1)

    def largest(self, value: Callable[[Layup], Floats]) -> float:
        """The largest value there is; collective."""
        here = float(np.max(self.by_cell(value), initial=0.0))
        return float(self._domain.comm.allreduce(here, op=MPI.MAX))

    def mean(self, value: Callable[[Layup], Floats]) -> float:
        """The mean over all elements; collective."""
        local = self._domain.topology.index_map(2).size_local
        values = self.by_cell(value)
        if values.ndim == 0:
            return float(values)
        comm = self._domain.comm
        total = comm.allreduce(float(values[:local].sum()))
        return float(total / comm.allreduce(local))

    @cached_property
    def _quads(self) -> bool:
        return bool(self._domain.basix_cell() == basix.CellType.quadrilateral)

    def _element(self, rule: Rule, size: int) -> Any:
        cell, shape = self._domain.basix_cell(), (size,) if size > 1 else ()
        if not self._quads:
            return basix.ufl.element("DG", cell, 0, shape=shape)
        nodes = rule == "nodes"
        variant = basix.LagrangeVariant.gll_warped if nodes else basix.LagrangeVariant.gl_warped
        return basix.ufl.element("P", cell, self._degree, variant, shape=shape, discontinuous=True)

    def _field(self, values: Floats, rule: Rule) -> fem.Function:
        """A field from its values at the points of the elements, shape (elements, points, size)."""
        size = values.shape[-1]
        function = fem.Function(space_on(self._domain, self._element(rule, size)))
        dofs = function.function_space.dofmap.list
        places = dofs[..., None] * size + np.arange(size)
        function.x.array[places] = values
        return function

    def _at(self, rule: Rule) -> Layup:
        """The section at the points of a rule in all elements of this rank, (elements, points).

        Of a section that does not vary that of no point.
        """
        found = self._given_at(rule)
        return found.at_rest if self._at_rest else found

    def _given_at(self, rule: Rule) -> Layup:
        if not self._section.functions:
            return self._section.generic
        if rule not in self._layups:
            x, failed, found = self._points(rule), None, None
            try:
                found = self._section.at(np.moveaxis(x, -1, 0), self._who)
            except SceneError as error:
                failed = error
            # what one rank finds all of them tell
            failed = first_found(self._domain.comm, failed)
            if failed is not None:
                raise failed
            assert found is not None
            self._layups[rule] = found
        return self._layups[rule]

    def _points(self, rule: Rule) -> Floats:
        """Positions of the points of a rule, shape (elements, points, 3)."""
        points = self._element(rule, 1).basix_element.points
        middle = basix.geometry(self._domain.basix_cell()).mean(axis=0)
        inside = points + INTO * (middle - points)
        coordinates = self._domain.ufl_domain()
        assert coordinates is not None
        element = coordinates.ufl_coordinate_element().sub_elements[0]
        shapes = element.basix_element.tabulate(0, inside)[0, :, :, 0]
        corners = self._domain.geometry.x[self._domain.geometry.dofmaps[0]]
        return np.asarray(np.einsum("pd,cdx->cpx", shapes, corners))
