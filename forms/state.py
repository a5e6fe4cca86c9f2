"""State of a shell as one vector-valued expression, and its named parts.

All unknowns of a shell live in one mixed space, so a state is any expression of that space's
shape: an
unknown function, the mean of two of them, a test function. The layout says which components are
what.

==========  ===============================================================  ==========
part        name                                                             unit
==========  ===============================================================  ==========
`u`         displacement                                                     m
`w`         change of the director                                           -
`N`         forces of the cells over `N0`, see `forms.tying`                 -
`S`         strains of their own, where the material is nonlinear            -
`lam`       scaled multiplier of the unit director                           -
==========  ===============================================================  ==========
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import ufl
from ufl.core.expr import Expr


class Layout(NamedTuple):
    """Places of the parts of a state.

    Args:
        parts: Component ranges, name to (first, size).
        tying: Maps of the forces of a shell's cells, a `Tying`; None: it is none.
    """

    parts: Mapping[str, tuple[int, int]]
    tying: Any = None

    def part(self, q: Expr, name: str) -> Expr:
        """Components of the part `name` of the state `q` (a scalar if its size is one)."""
        first, size = self.parts[name]
        if size == 1:
            return q[first]
        return ufl.as_vector([q[first + k] for k in range(size)])

    def forces(self, q: Expr, name: str = "N") -> Expr:
        """Scaled forces of a shell's cells, or strains of their own, shape (15,)."""
        return self.tying.forces(self.part(q, name))

    def moved(self, q: Expr) -> tuple[Expr, Expr]:
        """Displacement and change of the director, or of the directors of frames."""
        return self.part(q, "u"), self.part(q, "w")

    def multipliers(self, q: Expr) -> Expr:
        """Scaled multipliers of directors."""
        return self.part(q, "lam")
