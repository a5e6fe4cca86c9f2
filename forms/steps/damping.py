"""Damping of Kelvin and Voigt: stresses in proportion to the rate of strains over a step.

As the stress (Q3) is linear over a step, the rate of a strain is projected on linear functions,

    h e'(tau) = (e_f - e_i) + 3 bow P1,     S^d = C^d e',     C^d = T^(1/2) C T^(1/2)           (D1)

with the damping times on the diagonal of `T`: positive semidefinite, whatever is coupled. It acts
as the stresses of the scheme do, and so takes of the energy

    work = -(1/h) [(e_f - e_i) . C^d (e_f - e_i) + 3 bow . C^d bow],                          (D2)

exactly, and of what moves without strains nothing. Rows see moments of the strain with other
weights, so the templates of `forms.steps.stress_work` serve. EP has no bow. ED is linear in both of
its sub-intervals; with `bow = e_i - e_j` its rows see

    f:  e_f - e_i,          j:  (e_f - e_i) + 3 (e_j - e_i)

which for linear strains is (D1) in ED's rows. Resultants of the mixed forms are those of states, so
their changes are stiffness times changes of the strains, as the elements see these: where an
element takes a mean of a strain, it damps the mean.

===========  ==========================================================  ==========
symbol       name                                                        unit
===========  ==========================================================  ==========
`T`          damping times of membrane, bending, shear; of a beam's six  s
`C^d`        stiffness times damping times                               N s/m, ...
===========  ==========================================================  ==========
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import ufl
from ufl.core.expr import Expr

from shellmb.forms.beam import BeamMixed, halves
from shellmb.forms.measure import Measure
from shellmb.forms.state import Layout
from shellmb.forms.steps.mixed import LinearMixed, LinearOwn, bending, membrane_shear, split
from shellmb.forms.steps.path import Moment, Rows, moment_of
from shellmb.forms.steps.stress_work import MixedSection


class Straining(NamedTuple):
    """Changes of strains over a step, in its rows.

    Args:
        rows: Moments of the rate, times the step, and what stresses act on.
        change: `e_f - e_i`, and the bow where there is one, for the work (D2).
        dt: Length of the step, s.
    """

    rows: Rows
    change: tuple[Moment, ...]
    dt: Expr


class Resistance(MixedSection, Protocol):
    """Stresses of the rate of a strain, of those of its moment and of their resultants."""

    def of_rate(self, layout: Layout, e: Expr, v: Expr) -> Expr:
        """Rates of the resultants, from those of strains and state."""
        ...


def _zeros(count: int) -> Expr:
    return ufl.as_vector([0] * count)


class _WithoutGap:
    """Compatibility that demands nothing of the resultants."""

    def where_held(self, there: Expr, elsewhere: Expr) -> Expr:
        """No strain is."""
        return elsewhere

    @property
    def rules(self) -> int:
        """Number of the rules."""
        return 1

    def gap(self, mean: Expr, end: Expr, N: Expr, dN: Expr) -> Sequence[Expr]:
        """No condition."""
        return [0 * ufl.dot(dN, N)] * self.rules


class WithoutForces(_WithoutGap):
    """A damping of strains that hold no forces of their own."""

    def forces(self, layout: Layout, q: Expr) -> Expr:
        """There are none: they follow from the strains."""
        return _zeros(2)

    def of_rate(self, layout: Layout, e: Expr, v: Expr) -> Expr:
        """There are none."""
        return _zeros(2)


@dataclass(frozen=True)
class ViscousShell(_WithoutGap):
    """Damping of a linear section by the rules of `forms.steps.mixed`.

    Where it couples, bending and membrane strains have one time.

    Args:
        elastic: Its elastic form.
        membrane: Time of the membrane strains, s; None: zero; then no term is.
        bend: The same of bending.
        shear: The same of transverse shear.
    """

    elastic: LinearMixed | LinearOwn
    membrane: Expr | None
    bend: Expr | None
    shear: Expr | None

    def forces(self, layout: Layout, q: Expr) -> Expr:
        """Forces of the cells that a state has, perhaps behind their strains."""
        return self.elastic.forces(layout, q)

    @property
    def rules(self) -> int:
        """Number of the rules."""
        return 1 + len(self.elastic.tying.rules)

    def of_rate(self, layout: Layout, e: Expr, v: Expr) -> Expr:
        """Rates of what cells have."""
        return self.forces(layout, v)

    def stress(self, e: Expr, N: Expr) -> tuple[Expr, ...]:
        """Stresses by rule, shape (8,) each."""
        elastic = self.elastic
        (_, gam), kap = split(membrane_shear(e)), bending(e)
        n, m, Q = _zeros(3), _zeros(3), _zeros(2)
        times = [self.membrane, self.membrane, self.membrane, *(None,) * 3, self.shear, self.shear]
        if self.membrane is not None:
            n = self.membrane * elastic.uniform(N)
        if self.bend is not None:
            m = self.bend * (elastic.D * kap)
        if self.shear is not None:
            Q = self.shear * elastic.shared_shear(gam)
        if self.membrane is not None:
            coupled = elastic.coupled_moments(N, e)
            m = m if coupled is None else m + self.membrane * coupled
        taken = [
            ufl.as_vector([0 if time is None else time * s[k] for k, time in enumerate(times)])
            for s in elastic.taken(N)
        ]
        return ufl.as_vector([*n, *m, *Q]), *taken


@dataclass(frozen=True)
class ViscousRule(WithoutForces):
    """Damping by coefficients of its own, of strains as they are or of those of the cells.

    Args:
        A: Membrane; None: no term is, as of the others.
        B: Coupling.
        D: Bending.
        G: Transverse shear.
    """

    A: Expr | None
    B: Expr | None
    D: Expr | None
    G: Expr | None

    def stress(self, e: Expr, N: Expr) -> tuple[Expr, ...]:
        """Stresses, shape (8,)."""
        (eps, gam), kap = split(membrane_shear(e)), bending(e)
        n, m, Q = _zeros(3), _zeros(3), _zeros(2)
        if self.A is not None:
            n = self.A * eps
        if self.B is not None:
            n, m = n + self.B * kap, ufl.transpose(self.B) * eps
        if self.D is not None:
            m = m + self.D * kap
        if self.G is not None:
            Q = self.G * gam
        return (ufl.as_vector([*n, *m, *Q]),)


@dataclass(frozen=True)
class ViscousBeam(_WithoutGap):
    """Damping of a beam, of the strains at the centroid and of the curvatures.

    Args:
        elastic: Its elastic form.
        A: Stiffness of the forces, zero where strains are constrained, shape (3, 3), N.
        R: Damping forces by the forces of `A`, shape (3, 3), s.
        D0: Damping of the curvatures without force, shape (3, 3), N m^2 s.
    """

    elastic: BeamMixed
    A: Expr
    R: Expr
    D0: Expr

    def forces(self, layout: Layout, q: Expr) -> Expr:
        """Forces along the directors, shape (3,), N."""
        return self.elastic.forces(layout, q)

    def of_rate(self, layout: Layout, e: Expr, v: Expr) -> Expr:
        """Rates of the forces by those of the strains, shape (3,)."""
        Gamma, K = halves(e)
        H = self.elastic.H
        return self.A * (Gamma if H is None else Gamma + H * K)

    def stress(self, e: Expr, N: Expr) -> tuple[Expr, ...]:
        """Forces and moments, shape (6,)."""
        n, m, H = self.R * N, self.D0 * halves(e)[1], self.elastic.H
        if H is not None:
            m = m + ufl.transpose(H) * n
        return (ufl.as_vector([*n, *m]),)


@dataclass(frozen=True)
class ViscousModes(WithoutForces):
    """Damping of a body in modes, whose strains are its amplitudes.

    Args:
        D: Damping of the modes, row by row; what is zero is None, N s/m.
    """

    D: Sequence[Sequence[Expr | None]]

    def stress(self, e: Expr, N: Expr) -> tuple[Expr, ...]:
        """Forces on the amplitudes, N."""
        rows = [
            sum((d * e[k] for k, d in enumerate(row) if d is not None), start=0 * e[0])
            for row in self.D
        ]
        return (ufl.as_vector(rows),)


def taken(section: MixedSection, layout: Layout, strain: Measure, along: Straining) -> list[Expr]:
    """Densities of the work (D2) that damping takes, times the step; one for each rule."""
    states = along.rows.states[: along.rows.moving]
    found: list[Expr] = []
    for weight, moment in zip((1, 3), along.change, strict=False):
        e, N = moment_of(strain, moment, states), section.forces(layout, moment.held)
        works = [weight * ufl.dot(s, e) for s in section.stress(e, N)]
        found = [a + b for a, b in zip(found, works, strict=True)] if found else works
    return found


def at_state(
    section: Resistance, layout: Layout, strain: Measure, q: Expr, v: Expr, dq: Expr
) -> list[Expr]:
    """Densities of the virtual work at a state with a velocity, one for each rule.

    Args:
        section: What resists.
        layout: Parts of the state.
        strain: The strain.
        q: State.
        v: Velocity, with rates of forces of the cells of shells.
        dq: Virtual displacement.
    """
    rate, de = (strain.change(q, d) for d in (v, dq))
    return [ufl.dot(s, de) for s in section.stress(rate, section.of_rate(layout, rate, v))]
