"""Damping of Kelvin and Voigt: stresses in proportion to the rate of strains over a step.

As the stress (Q3) is linear over a step, the rate of a strain is projected on linear functions,

    h e'(tau) = (e_f - e_i) + 3 bow P1,     S^d = C^d e',     C^d = T^(1/2) C T^(1/2)           (D1)

with the damping times on the diagonal of `T`: positive semidefinite, whatever is coupled. It acts
as the stresses of the scheme do, and so takes of the energy

    work = -(1/h) [(e_f - e_i) . C^d (e_f - e_i) + 3 bow . C^d bow],                          (D2)

exactly, and of what moves without strains nothing. Rows see moments of the strain with other
weights, so the templates of `forms.pathwork` serve. EP has no bow. ED is linear in both of its
sub-intervals; with `bow = e_i - e_j` its rows see

    f:  e_f - e_i,          j:  (e_f - e_i) + 3 (e_j - e_i)

which for linear strains is (D1) in ED's rows. Resultants are no unknowns here: in the rules of
`forms.mixed` they are those of the strains, point by point, and the energy is the same.

===========  ==========================================================  ==========
symbol       name                                                        unit
===========  ==========================================================  ==========
`T`          damping times of membrane, bending, shear; of a beam's six  s
`C^d`        stiffness times damping times                               N s/m, ...
===========  ==========================================================  ==========
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import ufl
from ufl.core.expr import Expr

from shellmb.forms.beam import halves
from shellmb.forms.state import Layout
from shellmb.forms.steps.mixed import bending, membrane_shear, split
from shellmb.forms.steps.path import Measure, Moment, Row
from shellmb.forms.steps.pathwork import MixedSection


class Straining(NamedTuple):
    """How strains change over a step, as a row sees it.

    Args:
        row: Its states with the moments of the rate, times the step, and what stresses act on.
        change: `e_f - e_i`, and the bow where there is one, for the work (D2).
        dt: Length of the step, s.
    """

    row: Row
    change: tuple[Moment, ...]
    dt: Expr


class _WithoutForces:
    """A section without unknown resultants."""

    def forces(self, layout: Layout, q: Expr) -> Expr:
        """There are none."""
        return ufl.as_vector([0, 0])

    def where_held(self, there: Expr, elsewhere: Expr) -> Expr:
        """No strain is."""
        return elsewhere

    def gap(self, mean: Expr, end: Expr, N: Expr) -> Expr:
        """Nothing has to agree."""
        return ufl.as_vector([0, 0])


class Viscous(NamedTuple):
    """`C^d` of a shell; None where the time or the strain is zero, and then no term exists.

    Args:
        A: Membrane.
        B: Coupling.
        D: Bending.
        G: Transverse shear.
    """

    A: Expr | None
    B: Expr | None
    D: Expr | None
    G: Expr | None

    def stress(self, e: Expr) -> tuple[Expr, Expr]:
        """What acts on (eps, gam), shape (5,), and what on kap besides `D`, shape (3,)."""
        eps, gam = split(membrane_shear(e))
        kap = bending(e)
        none = ufl.as_vector([0, 0, 0])
        n = none if self.A is None else self.A * eps
        m = none
        if self.B is not None:
            n, m = n + self.B * kap, self.B * eps
        Q = ufl.as_vector([0, 0]) if self.G is None else self.G * gam
        return ufl.as_vector([*n, *Q]), m


@dataclass(frozen=True)
class ViscousShell(_WithoutForces):
    """Damping of a shell in the two rules of `forms.mixed`.

    Args:
        full: Coefficients for the full rule.
        reduced: The same for the reduced rule.
        a: Fully integrated fraction per element.
    """

    full: Viscous
    reduced: Viscous
    a: Expr

    def stress(self, e: Expr, N: Expr) -> tuple[Expr, ...]:
        """Stresses for the full and the reduced rule, shape (8,) each."""
        found = []
        for viscous, share in ((self.full, self.a), (self.reduced, 1 - self.a)):
            s, m = viscous.stress(e)
            m = share * m
            if viscous is self.full and self.full.D is not None:
                m = m + self.full.D * bending(e)
            n, Q = split(share * s)
            found.append(ufl.as_vector([*n, *m, *Q]))
        return tuple(found)


@dataclass(frozen=True)
class ViscousBeam(_WithoutForces):
    """Damping of a beam, of the strains at the centroid and of the curvatures.

    Args:
        A: That of `Gamma + H K`, shape (3, 3), N s.
        D0: That of `K` without force, shape (3, 3), N m^2 s.
        H: As of `forms.beam.BeamMixed`.
    """

    A: Expr
    D0: Expr
    H: Expr | None = None

    def stress(self, e: Expr, N: Expr) -> tuple[Expr, ...]:
        """Forces and moments, shape (6,)."""
        Gamma, K = halves(e)
        n = self.A * (Gamma if self.H is None else Gamma + self.H * K)
        m = self.D0 * K
        if self.H is not None:
            m = m + ufl.transpose(self.H) * n
        return (ufl.as_vector([*n, *m]),)


def taken(section: MixedSection, strain: Measure, along: Straining) -> list[Expr]:
    """Densities of the work (D2) that damping takes, times the step; one for each rule."""
    states = along.row.states[: along.row.moving]
    zero = ufl.as_vector([0, 0])
    found: list[Expr] = []
    for weight, moment in zip((1, 3), along.change, strict=False):
        e = strain.moment(moment, states)
        works = [weight * ufl.dot(s, e) for s in section.stress(e, zero)]
        found = [a + b for a, b in zip(found, works, strict=True)] if found else works
    return found


def at_state(section: MixedSection, strain: Measure, q: Expr, v: Expr, dq: Expr) -> Sequence[Expr]:
    """Densities of the virtual work at a state with a velocity, one for each rule."""
    zero = ufl.as_vector([0, 0])
    rate, de = (strain.slope(1, ((1, q),), d) for d in (v, dq))
    return [ufl.dot(s, de) for s in section.stress(rate, zero)]
