"""Assumed strains of shells: where they are taken, and the forces that work on them there.

With the Jacobian `F` of the reference cell in the local basis, a strain `e` has the covariant
components `F^T e F` along the lines of the cell. Forces of a cell are polynomials `p` in
contravariant components and, on quadrilaterals, some that are constant in space,

    N = F p F^T / det F + c.

They work on strains by their weights `z` where these are taken, `c` as it is, so that forces in
equilibrium with uniform strains are among them; where both meet, strains are those that forces see:

    <N, e> = sum of  z . F^T e F  over the points + integral of (c + F b F^T / det F) . e

Forces of twist have `b` beside them on cells that are no parallelograms: so they see of smooth
displacements what they see of these interpolated, as they do on parallelograms.

A cell's own strains, where it has some (`forms.steps.mixed_nonlinear`), are the dual polynomials
`F^-T s F^-1` and constants.

==========  =================================================================  ==========
symbol      name                                                               unit
==========  =================================================================  ==========
`F`         Jacobian, reference cell to local basis, `e_i . X_,a`              m
`z`         weights of forces where strains 11, 22, 2*12, 13, 23 are taken     as N
`p`         forces 11, 22, 12, 13, 23 in contravariant components              as N
`c`         membrane forces 11, 22, 12 that are constant in space              as N
`b`         forces 11, 22 beside those of twist                                as N
`bow`       `x,12` in the basis `x,1`, `x,2` of the middle, halved             -
==========  =================================================================  ==========
"""

from collections.abc import Sequence
from typing import NamedTuple

import ufl
from ufl.core.expr import Expr

from shellmb.forms.shell import Surface, unit

# numbers of a cell's forces: weights, polynomials, constants, and those beside twist
COUNT = 15


class Tying(NamedTuple):
    """Maps between forces of a cell and their components in the local basis.

    Forces of a cell are one vector, shape (15,): weights `z` (5), polynomials `p` (5), constants
    `c` (3), and `b` (2), to be taken by how far a cell is from a parallelogram.

    Args:
        F: Jacobian in the local basis, shape (2, 2), m.
        turn: Cosine and sine of the angle from `e1` to the direction of the constants; None:
            there are no constants.
        bow: How far it is from a parallelogram, shape (2,); None: there are no `b`.
        size: Mean square of the sides of the cell, m^2.
        weights: Components of an element's values that are `z`.
        polynomials: Those that are `p`.
        constants: Those that are `c`.
        twists: Those that are `b`.
        rules: Numbers of the strains that are taken by each rule.
    """

    F: Expr
    turn: tuple[Expr, Expr] | None
    bow: Expr | None
    size: Expr
    weights: tuple[int, ...]
    polynomials: tuple[int, ...]
    constants: tuple[int, ...]
    twists: tuple[int, ...]
    rules: tuple[tuple[int, ...], ...]

    def forces(self, values: Expr) -> Expr:
        """Forces of a cell from the values of an element, shape (15,)."""
        c = [values[k] for k in self.constants] or [0, 0, 0]
        b = [values[k] for k in self.twists] or [0, 0]
        return ufl.as_vector([*(values[k] for k in (*self.weights, *self.polynomials)), *c, *b])

    def force(self, N: Expr) -> Expr:
        """Membrane and shear forces 11, 22, 12, 13, 23 in the local basis, shape (5,)."""
        F, J = self.F, ufl.det(self.F)
        p = F * ufl.as_matrix([[N[5], N[7]], [N[7], N[6]]]) * ufl.transpose(F) / J
        r = F * ufl.as_vector([N[8], N[9]]) / J
        c = self.constant(N)
        return ufl.as_vector([p[0, 0] + c[0], p[1, 1] + c[1], p[0, 1] + c[2], r[0], r[1]])

    def constant(self, N: Expr) -> Expr:
        """The constant membrane forces 11, 22, 12 in the local basis, shape (3,)."""
        if self.turn is None:
            return ufl.as_vector([0, 0, 0])
        return _turned(self.turn, N[10], N[11], N[12])

    def whole(self, N: Expr) -> Expr:
        """Membrane forces 11, 22, 12 on strains of the rule of all integrals, shape (3,)."""
        if self.bow is None:
            return self.constant(N)
        F, J = self.F, ufl.det(self.F)
        b = [self.bow[k] * N[13 + k] for k in range(2)]
        p = F * ufl.as_matrix([[b[0], 0], [0, b[1]]]) * ufl.transpose(F) / J
        return self.constant(N) + ufl.as_vector([p[0, 0], p[1, 1], p[0, 1]])

    def strain(self, S: Expr) -> Expr:
        """A cell's own strains 11, 22, 2*12, 13, 23 in the local basis, shape (5,)."""
        G = ufl.inv(self.F)
        s = ufl.transpose(G) * ufl.as_matrix([[S[5], S[7] / 2], [S[7] / 2, S[6]]]) * G
        g = ufl.transpose(G) * ufl.as_vector([S[8], S[9]])
        c = ufl.as_vector([0, 0, 0])
        if self.turn is not None:
            c = _turned(self.turn, S[10], S[11], S[12] / 2)
        # by the size they are without unit
        s, g = self.size * s, ufl.sqrt(self.size) * g
        return ufl.as_vector([s[0, 0] + c[0], s[1, 1] + c[1], 2 * (s[0, 1] + c[2]), g[0], g[1]])

    def works(self, N: Expr) -> list[Expr]:
        """Stresses on local strains where these are taken, by rule, shape (8,) each."""
        J, F = ufl.det(self.F), self.F
        found = []
        for strains in self.rules:
            z = [N[k] if k in strains else 0 for k in range(5)]
            a = F * ufl.as_matrix([[z[0], z[2]], [z[2], z[1]]]) * ufl.transpose(F) / J
            q = F * ufl.as_vector([z[3], z[4]]) / J
            found.append(ufl.as_vector([a[0, 0], a[1, 1], a[0, 1], 0, 0, 0, q[0], q[1]]))
        return found


def _turned(turn: tuple[Expr, Expr], a: Expr, b: Expr, ab: Expr) -> Expr:
    """Components 11, 22, 12 of a symmetric tensor in a basis that it is turned from."""
    c, s = turn
    mixed = 2 * c * s * ab
    return ufl.as_vector(
        [
            c * c * a + s * s * b - mixed,
            s * s * a + c * c * b + mixed,
            c * s * (a - b) + (c * c - s * s) * ab,
        ]
    )


def tying(
    jacobian: Expr,
    surf: Surface,
    direction: Expr | None,
    bow: Expr | None,
    size: Expr,
    components: Sequence[tuple[int, ...]],
    rules: tuple[tuple[int, ...], ...],
) -> Tying:
    """Maps of a surface's cells.

    Args:
        jacobian: Jacobian of the reference surface, shape (3, 2).
        surf: Its local basis.
        direction: A direction of each cell, shape (3,), for its constants; None: it has none.
        bow: As of `Tying`.
        size: Mean square of the sides of the cell, m^2.
        components: Components of an element's values: weights, polynomials, constants, twists.
        rules: As of `Tying`.
    """
    e1, e2 = surf.e1, surf.e2
    F = ufl.as_matrix([[ufl.dot(e, jacobian[:, k]) for k in range(2)] for e in (e1, e2)])
    turn = None
    if direction is not None:
        line = unit(ufl.as_vector([ufl.dot(direction, e1), ufl.dot(direction, e2)]))
        turn = line[0], line[1]
    weights, polynomials, constants, twists = components
    return Tying(F, turn, bow, size, weights, polynomials, constants, twists, rules)
