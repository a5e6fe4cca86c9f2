"""Vectors and matrices of scalars of a graph, and with these the geometry of cells and facets."""

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from shellmb.native.programs.graph import Graph, Input, Scalar, Unsupported

# source of the coordinates' values
COORDINATES = -1

# an array of scalars, of objects: NumPy has no type for these
Tensor = Any


def contract(graph: Graph, a: Any, b: Any) -> Scalar:
    """Scalar product of two lists of scalars."""
    return graph.total([graph.mul(x, y) for x, y in zip(a, b, strict=True)])


def times(graph: Graph, a: Tensor, b: Tensor) -> Tensor:
    """Product of tensors, over the last index of one and the first of the other."""
    # lists of Python are read faster
    rows, columns = a.reshape(-1, a.shape[-1]).tolist(), b.reshape(b.shape[0], -1).T.tolist()
    made = [[contract(graph, row, column) for column in columns] for row in rows]
    return array(made).reshape(a.shape[:-1] + b.shape[1:])


def det(graph: Graph, A: Tensor) -> Scalar:
    """Determinant of a square matrix."""
    if len(A) == 0:
        return graph.one
    found: list[Scalar] = []
    for j, x in enumerate(A[0]):
        minor = np.delete(A[1:], j, axis=1)
        part = graph.mul(x, det(graph, minor))
        found.append(part if j % 2 == 0 else graph.negative(part))
    return graph.total(found)


def inverse(graph: Graph, A: Tensor) -> Tensor:
    """Inverse of a square matrix of at most four rows."""
    n = len(A)
    if n > 4:
        raise Unsupported("an inverse of more than 4 rows")
    by = graph.div(graph.one, det(graph, A))
    made = np.empty((n, n), dtype=object)
    for i, j in np.ndindex(n, n):
        part = det(graph, np.delete(np.delete(A, j, axis=0), i, axis=1))
        made[i, j] = graph.mul(part if (i + j) % 2 == 0 else graph.negative(part), by)
    return made


def crossed(graph: Graph, a: Any, b: Any) -> Tensor:
    """Cross product of two vectors."""
    return array(
        [
            graph.sub(graph.mul(a[i], b[j]), graph.mul(a[j], b[i]))
            for i, j in ((1, 2), (2, 0), (0, 1))
        ]
    )


def array(values: Any) -> Tensor:
    """An array of scalars, of any shape."""
    return np.asarray(values, dtype=object)


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
