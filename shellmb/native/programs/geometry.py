"""Geometry of a cell and of its facets as scalars of a graph."""

from collections.abc import Callable
from functools import cached_property

import numpy as np

from shellmb.native.programs.algebra import Tensor, array, contract, crossed, det, inverse, times
from shellmb.native.programs.graph import Graph, Input, Scalar

# source of the coordinates' values
COORDINATES = -1


class Geometry:
    """Geometry at a point of a cell, or of one of its facets.

    Args:
        graph: Gets its scalars.
        value: The value of a function, or of a derivative.
        dimensions: Of the space and of the cell.
        facet: Whether points are on facets.
    """

    def __init__(
        self,
        graph: Graph,
        value: Callable[[Input], Scalar],
        dimensions: tuple[int, int],
        facet: bool,
    ) -> None:
        self.graph, self._value, self._facet = graph, value, facet
        self._gdim, self._tdim = dimensions

    def coordinates(self) -> Tensor:
        """Place of the point, shape (dimension,)."""
        none = (0,) * self._tdim
        return array([self._value(Input(COORDINATES, i, none)) for i in range(self._gdim)])

    @cached_property
    def jacobian(self) -> Tensor:
        """Derivatives of the place by the reference coordinates."""
        unit = [tuple(map(int, e)) for e in np.eye(self._tdim, dtype=int)]
        of = range(self._gdim)
        return array([[self._value(Input(COORDINATES, i, e)) for e in unit] for i in of])

    @cached_property
    def determinant(self) -> Scalar:
        """Size of the cell relative to its reference."""
        J, g = self.jacobian, self.graph
        if self._gdim == self._tdim:
            return det(g, J)
        c = J[:, 0] if self._tdim == 1 else crossed(g, J[:, 0], J[:, 1])
        return g.unary("sqrt", contract(g, c, c))

    @cached_property
    def inverse(self) -> Tensor:
        """Inverse of the Jacobian; its pseudo-inverse in a surface or on a line in space."""
        J, g = self.jacobian, self.graph
        if self._gdim == self._tdim:
            return inverse(g, J)
        return times(g, inverse(g, times(g, J.T, J)), J.T)

    def facet_size(self) -> Scalar:
        """Length of what the facet is to its reference, in a mesh of surfaces."""
        J, of = self.jacobian, self.graph.of_entity
        tangent = [contract(self.graph, row, [of(a) for a in range(self._tdim)]) for row in J]
        return self.graph.unary("sqrt", contract(self.graph, tangent, tangent))

    def normal(self) -> Tensor:
        """Unit normal of the facet, outward, in the tangent plane."""
        # behind the tangent stands the normal, of the reference
        normal = [self.graph.of_entity(self._tdim + a) for a in range(self._tdim)]
        if self._tdim == 1:
            way = [self.graph.mul(normal[0], x) for x in self.jacobian[:, 0]]
        else:
            K = self.inverse
            way = [contract(self.graph, K[:, i], normal) for i in range(self._gdim)]
        size = self.graph.unary("sqrt", contract(self.graph, way, way))
        return array([self.graph.div(x, size) for x in way])

    def scale(self) -> Scalar:
        """Share of a point: its weight times the size of the entity to its reference."""
        if not self._facet:
            size = self.determinant
            if self._gdim == self._tdim:
                size = self.graph.unary("abs", size)
        elif self._tdim == 2:
            size = self.facet_size()
        else:
            return self.graph.one
        return self.graph.mul(self.graph.weight(), size)
