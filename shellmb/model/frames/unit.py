"""Constraints of directors as numbers: what they are, and whether they make directors unit vectors.

Directors are eliminated, put on their constraints and reported by numbers at nodes, which know unit
vectors and orthonormal triples (`system.nullspace`). The constraints themselves are written in
`forms`: here they are asked what they are, so that whoever changes them there changes all of it.
"""

from collections.abc import Callable
from functools import cache, cached_property

import numpy as np
import ufl
from ufl.core.expr import Expr

from shellmb.arrays import Floats

# round-off of the values of constraints of random directors, whose squares are up to a hundred
ROUND_OFF = 1e-11


class DirectorConstraint:
    """Constraints of the directors of a node, quadratic in their changes.

    Args:
        written: Constraints `g(w, D)` of the changes and the reference, a number or shape (c,).
        count: Number of directors.
    """

    def __init__(self, written: Callable[[Expr, Expr], Expr], count: int) -> None:
        self._written, self._count = written, count

    @cached_property
    def unit(self) -> bool:
        """Decide whether all directors have length one and, of a triple, are at right angles."""
        k, rng = self._count, np.random.default_rng(1)
        pairs = [(a, a) for a in range(k)] + [(a, b) for a in range(k) for b in range(a + 1, k)]
        for w, D in rng.normal(size=(2, 2, 3 * k)):
            v, R = w.reshape(k, 3), D.reshape(k, 3)
            known = [v[a] @ R[b] + R[a] @ v[b] + v[a] @ v[b] for a, b in pairs]
            halves = [0.5 if a == b else 1.0 for a, b in pairs]
            found = self._at(w, D)
            if found.shape != (len(pairs),):
                return False
            if np.abs(found - np.multiply(halves, known)).max() > ROUND_OFF:
                return False
        return True

    def values(self, w: Floats, D: Floats) -> Floats:
        """Values at nodes, shape (n, c), from shapes (n, 3 k)."""
        by_rest, square = self._numbers
        found = np.einsum("cij,ni,nj->nc", by_rest, D, w)
        return np.asarray(found + np.einsum("cij,ni,nj->nc", square, w, w) / 2)

    def normals(self, w: Floats, D: Floats) -> Floats:
        """Derivatives of the first one by the changes, at nodes, shape (n, 3 k)."""
        by_rest, square = (matrix[0] for matrix in self._numbers)
        return np.asarray(D @ by_rest + w @ square)

    def normal(self, w: Expr, D: Expr) -> Expr:
        """Derivative of the first one by the changes, shape (3 k,)."""
        if self.unit:
            return D + w
        by_rest, square = (ufl.as_matrix(matrix[0].tolist()) for matrix in self._numbers)
        return ufl.dot(D, by_rest) + ufl.dot(w, square)

    def _at(self, w: Floats, D: Floats) -> Floats:
        """Values for numbers, shape (c,)."""
        first, second = (ufl.as_vector([ufl.as_ufl(float(x)) for x in v]) for v in (w, D))
        found = self._written(first, second)
        parts = [found] if not found.ufl_shape else [found[i] for i in range(len(found))]
        return np.array([float(part(())) for part in parts])

    @cached_property
    def _numbers(self) -> tuple[Floats, Floats]:
        """Second derivatives by reference and change, and by changes, shape (c, 3 k, 3 k) each."""
        n = 3 * self._count
        axes, none = np.eye(n), np.zeros(n)
        own = np.array([self._at(a, none) for a in axes])
        pairs = np.array([[self._at(a + b, none) for b in axes] for a in axes])
        square = pairs - own[:, None] - own[None]
        by_rest = np.array([[self._at(a, D) for a in axes] for D in axes]) - own[None]
        return by_rest.transpose(2, 0, 1), square.transpose(2, 0, 1)


@cache
def directors_held(written: Callable[[Expr, Expr], Expr], count: int) -> DirectorConstraint:
    """Constraints of directors as numbers, found once for all bodies that have them.

    Args:
        written: The constraints, see `DirectorConstraint`.
        count: Number of directors.
    """
    return DirectorConstraint(written, count)
