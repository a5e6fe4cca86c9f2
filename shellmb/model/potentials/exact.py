"""Energies of measures of the state: what they have in each row of a step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import ufl
from ufl import Form
from ufl.core.expr import Expr

from shellmb.forms.constraints.elements import Stretch
from shellmb.forms.measure import Measure, measure
from shellmb.forms.steps import potentials as forms
from shellmb.forms.steps.discrete import gradient, variation
from shellmb.forms.steps.mixed import Interval
from shellmb.forms.steps.path import Step, slope_at
from shellmb.model.body import Elastic

# a penetration and a rate beyond all others, for the pattern of matrices
FAR = 1e6


@dataclass(frozen=True)
class ExactEnergy(Elastic):
    """An energy whose forces are exact over a step (`forms.steps.potentials`).

    Args:
        measure: Measures of order one of a state that the energy is a function of, at most
            quadratic, shape (n,).
        potential: Energy for a weight of one as a function of these.
        weight: Weight of each point.
        dx: Measure whose points these are.
        smooth: Change of the measures up to which Gauss points are exact to round-off; where the
            potential may have kinks, zero.
    """

    measure: Callable[[Expr], Expr]
    potential: Callable[[Expr], Expr]
    weight: Expr
    dx: ufl.Measure
    smooth: float = field(default=0.0, kw_only=True)

    def interval(self, span: Interval, dq: Expr) -> Form:
        """Virtual work over a sub-interval."""
        a, b = self.measure(span.a), self.measure(span.b)
        if span.a is span.b:
            stress = gradient(self._whole, a)
        else:
            stress = self._stress(a, b, span.beta)
        return self.weight * ufl.dot(stress, variation(self.measure, span.mid, dq)) * self.dx

    def _whole(self, e: Expr) -> Expr:
        """The energy as a function of the measures."""
        return self.potential(e)

    def _stress(self, a: Expr, b: Expr, beta: Expr | float) -> Expr:
        return forms.interval_stress(self.potential, a, b, beta, self.smooth)

    def _stresses(self, e: Stretch, alpha: Expr) -> tuple[Expr, Expr]:
        return forms.path_stresses(self.potential, e, alpha, self.smooth)

    def _over(self, step: Step) -> tuple[Measure, Stretch]:
        """The measure, and what it is over a step."""
        path, measured = step.path, measure(self.measure)
        start = self.measure(path.start)
        return measured, Stretch(start, self.measure(path.end) - start, step.bow_of(measured))

    def row(self, step: Step, k: int, dq: Expr) -> Form | None:
        """Virtual work over a step, with stresses linear in time, eq. (Q2)."""
        (measured, e), p = self._over(step), step.path
        stresses = self._stresses(e, p.alpha)
        states = p.states
        work = sum(
            ufl.dot(stress, slope_at(measured, on.slopes[k], states, dq))
            for stress, on in zip(stresses, step.rows.stresses, strict=True)
        )
        return self.weight * work * self.dx

    def bow(self, step: Step, held: Expr) -> Form | None:
        """Energy of the bow of the measures, J."""
        _, e = self._over(step)
        return self.weight * forms.path_loss(self.potential, e) * self.dx

    def energy(self, q: Expr) -> Form:
        """The energy, J."""
        return self.weight * self._whole(self.measure(q)) * self.dx

    def jump(self, a: Expr, b: Expr) -> Form:
        """Elastic part of eq. (34), J."""
        found = forms.interval_jump(self.potential, self.measure(a), self.measure(b))
        return self.weight * found * self.dx


@dataclass(frozen=True)
class DistanceEnergy(ExactEnergy):
    """An energy of a distance that follows from several measures; arguments as of `ExactEnergy`.

    Args:
        distance: Distance over the size of the scene as a function of the measures; the potential
            is a function of it, shape (1,).
    """

    distance: Callable[[Expr], Expr]

    def _at(self, e: Expr) -> Expr:
        return ufl.as_vector([self.distance(e)])

    def _whole(self, e: Expr) -> Expr:
        return self.potential(self._at(e))

    def _stress(self, a: Expr, b: Expr, beta: Expr | float) -> Expr:
        stress = forms.interval_stress(self.potential, self._at(a), self._at(b), beta)
        return stress[0] * forms.distance_slope(self.distance, a, b)

    def _stresses(self, e: Stretch, alpha: Expr) -> tuple[Expr, Expr]:
        return forms.distance_stresses(self.potential, self.distance, e, alpha)

    def bow(self, step: Step, held: Expr) -> Form | None:
        """Energy of the bow of the distance, J."""
        _, e = self._over(step)
        d = forms.distance_stretch(self.distance, e)
        return self.weight * forms.path_loss(self.potential, d) * self.dx

    def jump(self, a: Expr, b: Expr) -> Form:
        """Elastic part of eq. (34), J."""
        ends = (self._at(self.measure(q)) for q in (a, b))
        return self.weight * forms.interval_jump(self.potential, *ends) * self.dx
