"""Control of the in-plane hourglass modes of quadrilaterals.

The reduced rule does not see displacements like `(1 - 3 xi^2)(1 - 3 eta^2)`: without control they
are resisted only by the
fraction `a ~ h^2` of the membrane energy, and a plate held at a corner swings about it almost
freely in its own plane.
Their strain along `xi` is quadratic in `eta`. A rule with one more point in `eta` sees it, and the
difference of the two rules sees nothing else:

    W = b N0 / 2 { [dx(k, k+1) - dx(k, k)] e_xi^2 + [dx(k+1, k) - dx(k, k)] e_eta^2 }

The strain along each line is sampled at the reduced rule's points of that line only, as in the
mixed interpolation of
tensorial components that the paper uses (its refs. [9-11]), so bending remains free of membrane
locking.

===========  ======================================================  =====
symbol       name                                                    unit
===========  ======================================================  =====
`e_xi`       membrane strain along the element's first coordinate    -
`e_eta`      membrane strain along its second coordinate             -
`b N0`       stiffness of the control                                N/m
===========  ======================================================  =====
"""

import ufl
from ufl.core.expr import Expr

from shellmb.forms.measure import Measure
from shellmb.forms.state import Layout
from shellmb.forms.surface import Surface, unit

Pair = tuple[Expr, Expr]


def lines(eps: Expr, surf: Surface, jacobian: Expr) -> Expr:
    """Components of a membrane strain along the two coordinate lines, shape (2,).

    Args:
        eps: Membrane strain, perhaps with others behind it.
        surf: Local basis in which its components are.
        jacobian: Jacobian of the reference surface, shape (3, 2).
    """
    found = []
    for k in range(2):
        line = unit(jacobian[:, k])
        c, s = ufl.dot(line, surf.e1), ufl.dot(line, surf.e2)
        found.append(c * c * eps[0] + s * s * eps[1] + c * s * eps[2])
    return ufl.as_vector(found)


class LineSection:
    """The two line strains as a section of stiffness one without resultants."""

    def forces(self, layout: Layout, q: Expr) -> Expr:
        """There are none."""
        return ufl.as_vector([0, 0])

    def stress(self, e: Expr, N: Expr) -> tuple[Expr, ...]:
        """Each is one strain, in a rule of its own."""
        return ufl.as_vector([e[0], 0]), ufl.as_vector([0, e[1]])

    def of_strains(self, e: Expr) -> Expr:
        """There are none."""
        return ufl.as_vector([0, 0])

    def where_held(self, there: Expr, elsewhere: Expr) -> Expr:
        """No strain is."""
        return elsewhere

    def gap(self, mean: Expr, end: Expr, N: Expr) -> Expr:
        """No condition."""
        return ufl.as_vector([0, 0])

    def energy(self, strain: Measure, layout: Layout, q: Expr) -> Pair:
        """Energy of a state."""
        return self.stored(strain.value(q), q)

    def stored(self, e: Expr, N: Expr) -> Pair:
        """Energy of strains."""
        return e[0] ** 2 / 2, e[1] ** 2 / 2

    def jump(self, strain: Measure, layout: Layout, a: Expr, b: Expr) -> Pair:
        """Share of the line strains in eq. (34)."""
        return self.stored(strain.value(b) - strain.value(a), a)
