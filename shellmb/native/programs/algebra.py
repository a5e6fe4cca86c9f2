"""Algebra of vectors and matrices of scalars of a graph."""

from typing import Any

import numpy as np

from shellmb.native.programs.graph import Graph, Scalar, Unsupported

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
