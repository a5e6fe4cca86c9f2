"""Strains of a body without independent resultants: with a stiffness, or an energy of any form.

Forces are those of the pages of the schemes (`schemes.interval`, `schemes.quadratic`) at functions
that follow the unknown states, so that one kernel serves all rows and one all blocks of Jacobians.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import ufl
from ufl import Form
from ufl.core.expr import Expr

from shellmb.forms.constraints.elements import Stretch
from shellmb.forms.measure import Measure
from shellmb.forms.state import Layout
from shellmb.forms.steps import potentials as forms
from shellmb.forms.steps.discrete import gradient
from shellmb.forms.steps.path import Step, moment_of, slope_at
from shellmb.forms.steps.stress_work_nonlinear import tangent
from shellmb.model.body import SubInterval, Term
from shellmb.model.potentials.exact import ExactEnergy

NOTHING = ufl.as_vector([0, 0])


@dataclass(frozen=True)
class Stiffness:
    """A linear section without resultants, as `forms.steps.stress_work.MixedSection`.

    Args:
        C: Stiffness, shape (n, n), symmetric.
    """

    C: Expr

    def forces(self, layout: Layout, q: Expr) -> Expr:
        """There are none."""
        return NOTHING

    def where_held(self, there: Expr, elsewhere: Expr) -> Expr:
        """No strain is."""
        return elsewhere

    def stress(self, e: Expr, N: Expr) -> tuple[Expr, ...]:
        """Stresses of strains."""
        return (self.C * e,)

    def gap(self, mean: Expr, end: Expr, N: Expr, dN: Expr) -> tuple[Expr]:
        """No condition."""
        return (ufl.dot(dN, N),)

    def energy(self, strain: Measure, layout: Layout, q: Expr) -> tuple[Expr]:
        """Energy of a state."""
        return self.stored(strain.value(q), q)

    def stored(self, e: Expr, N: Expr) -> tuple[Expr]:
        """Energy of strains."""
        return (ufl.dot(e, self.C * e) / 2,)

    def jump(self, strain: Measure, layout: Layout, a: Expr, b: Expr) -> tuple[Expr]:
        """Elastic part of eq. (34)."""
        return self.stored(strain.value(b) - strain.value(a), a)


# Gauss' two points on [-1, 1]
POINT = 3**-0.5


@dataclass(frozen=True)
class PotentialStrains(ExactEnergy):
    """Quadratic strains with an energy of any form, without resultants.

    Derivatives are those of the mean stress of two Gauss points in time, without the correction
    that makes it exact, which is of fourth order: Newton's method converges linearly and fast.

    Args:
        strain: The strains with their derivatives, those of `measure`.
    """

    strain: Measure

    def interval_term(self, sub: SubInterval, dq: Expr, trial: Any) -> Term | None:
        """Virtual work of a sub-interval; None at a single state."""
        span = sub.span
        if span.a is span.b or sub.rows is None:
            return None
        rows, value, psi = sub.rows, self.strain.value, self.potential
        x, D = rows.states[:2]
        a, b = value(x - D / 2), value(x + D / 2)
        stress = forms.interval_stress(psi, a, b, span.beta)
        m, half = (a + b) / 2, POINT * (b - a) / 2
        mean = (gradient(psi, m - half) + gradient(psi, m + half)) / 2
        mean += span.beta / 2 * (gradient(psi, b) - gradient(psi, a))
        de = self.strain.change(x, dq)
        works = (ufl.dot(s, de) * self.weight * self.dx for s in (stress, mean))
        residual, simple = works
        return Term(residual, rows.numbers, (simple,))

    def path_term(self, step: Step, tests: Sequence[Expr], trial: Any) -> Term | None:
        """Virtual work of both rows of a step that is quadratic in time, eq. (Q2)."""
        x, D, z, _ = states = step.states
        m, value, psi, alpha = x + z, self.strain.value, self.potential, step.path.alpha
        first, last = value(m - D / 2), value(m + D / 2)
        bow = moment_of(self.strain, step.points.bow, states)
        stresses = forms.path_stresses(psi, Stretch(first, last - first, bow), alpha)
        # strains at Gauss' points: 3 (tau^2 - tau) is -1/2 there
        middle, half = (first + last - bow) / 2, POINT * (last - first) / 2
        early, late = gradient(psi, middle - half), gradient(psi, middle + half)
        damping = alpha / 2 * ufl.dot(tangent(psi, (first + last) / 2), bow)
        simple = (early + late) / 2, (late - early) * 3 * POINT / 2 + damping

        def work(stresses: Sequence[Expr], k: int, dq: Expr) -> Form:
            slopes = (stress.slopes[k] for stress in step.rows.stresses)
            acting = (slope_at(self.strain, slope, states, dq) for slope in slopes)
            density = sum(ufl.dot(s, de) for s, de in zip(stresses, acting, strict=True))
            return density * self.weight * self.dx

        single = ufl.TestFunction(trial.ufl_function_space())
        residual = work(stresses, 0, tests[0]) + work(stresses, 1, tests[1])
        alone = work(simple, 0, single), work(simple, 1, single)
        return Term(residual, step.rows.numbers, alone)

    def row(self, step: Step, k: int, dq: Expr) -> Form | None:
        """None: the work over a step is `path_term`."""
        return None
