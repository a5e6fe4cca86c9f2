"""State of a shell as one vector-valued expression, and its named parts.

All unknowns of a shell live in one mixed space, so a state is any expression of that space's
shape: an
unknown function, the mean of two of them, a test function. The layout says which components are
what.

==========  ===============================================================  ==========
part        name                                                             unit
==========  ===============================================================  ==========
`u`         displacement                                                     m
`bubble`    displacement bubble of triangles (added to `u`)                  m
`w`         change of the director                                           -
`N`         scaled resultants `(N11, N22, N12, Q1, Q2) / N0`; of triangles   -
            shear forces are a vector, see `Layout.axes`
`S`         assumed strains of a nonlinear material, conjugate to `N`        -
`lam`       scaled multiplier of the unit director                           -
==========  ===============================================================  ==========
"""

from collections.abc import Mapping
from typing import NamedTuple

import ufl
from ufl.core.expr import Expr


class Layout(NamedTuple):
    """Places of the parts of a state.

    Args:
        parts: Component ranges, name to (first, size).
        axes: Vectors along which components of shear forces are taken, where a state has these as
            tangential vectors in space (on triangles); None: it has the components.
        bubble: What bubbles count for in strains; see `model.rules`.
    """

    parts: Mapping[str, tuple[int, int]]
    axes: tuple[Expr, Expr] | None = None
    bubble: float = 1.0

    def part(self, q: Expr, name: str) -> Expr:
        """Components of the part `name` of the state `q` (a scalar if its size is one)."""
        first, size = self.parts[name]
        if size == 1:
            return q[first]
        return ufl.as_vector([q[first + k] for k in range(size)])

    def displacement(self, q: Expr) -> Expr:
        """Displacement with its bubble, shape (3,), m."""
        u = self.part(q, "u")
        return u + self.part(q, "bubble") if "bubble" in self.parts else u

    def straining(self, q: Expr) -> Expr:
        """Displacement that strains are taken of, shape (3,), m."""
        u = self.part(q, "u")
        return u + self.bubble * self.part(q, "bubble") if "bubble" in self.parts else u

    def resultants(self, q: Expr, name: str = "N") -> Expr:
        """Membrane and shear components of scaled resultants, or of assumed strains, shape (5,)."""
        found = self.part(q, name)
        if self.axes is None:
            return found
        Q = ufl.as_vector([found[k] for k in (3, 4, 5)])
        return ufl.as_vector([*(found[k] for k in range(3)), *(ufl.dot(Q, e) for e in self.axes)])

    def director_change(self, q: Expr) -> Expr:
        """Change of the director, shape (3,), dimensionless."""
        return self.part(q, "w")

    def strained(self, q: Expr) -> tuple[Expr, Expr]:
        """Displacement and change of the director that strains are taken of."""
        return self.straining(q), self.director_change(q)

    def moved(self, q: Expr) -> tuple[Expr, Expr]:
        """Displacement and change of the directors of frames."""
        return self.part(q, "u"), self.part(q, "w")

    def multipliers(self, q: Expr) -> Expr:
        """Scaled multipliers of directors."""
        return self.part(q, "lam")
