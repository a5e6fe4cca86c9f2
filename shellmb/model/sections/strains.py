"""Strains of a body with their section, linear or hyperelastic: what stores elastic energy."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from ufl import Form
from ufl.core.expr import Expr

from shellmb.forms.measure import Measure, at_middle
from shellmb.forms.state import Layout
from shellmb.forms.steps.general_hyperelastic import GeneralPath
from shellmb.forms.steps.general_strains import ExactInterval, GeneralStrain
from shellmb.forms.steps.mixed import Interval
from shellmb.forms.steps.mixed_nonlinear import NonlinearMixed
from shellmb.forms.steps.path import Step, moment_of
from shellmb.forms.steps.stress_work import MixedSection, interval_work
from shellmb.forms.steps.stress_work_nonlinear import NonlinearPath
from shellmb.model.body import SubInterval, Term
from shellmb.model.row_terms import general_terms, hyperelastic_terms, path_terms, point_terms

Integrate = Callable[[Sequence[Expr]], Form]


@dataclass(frozen=True)
class Strains:
    """Quadratic strains with a linear section in mixed form.

    Args:
        section: The section.
        layout: Parts of the state.
        strain: The strains.
        integrate: Integral of densities, one for each quadrature rule.
    """

    section: Any
    layout: Layout
    strain: Measure
    integrate: Integrate

    @property
    def _common(self) -> tuple[MixedSection, Layout, Measure]:
        return self.section, self.layout, self.strain

    def energy(self, q: Expr) -> Form:
        """Energy of a state."""
        return self.integrate(self.section.energy(self.strain, self.layout, q))

    def jump(self, a: Expr, b: Expr) -> Form:
        """Elastic part of `c^2` for a jump of the state, eq. (34)."""
        return self.integrate(self.section.jump(self.strain, self.layout, a, b))

    def interval(self, span: Interval, dq: Expr) -> Form:
        """Virtual work of a sub-interval, eqs. (20)-(22), (32)."""
        return self.integrate(interval_work(*self._common, span, dq))

    def interval_term(self, sub: SubInterval, dq: Expr, trial: Expr) -> Term | None:
        """Virtual work with its derivatives; None where the states are no functions."""
        if sub.rows is None:
            return None
        return path_terms(*self._common, sub.rows, [dq], trial, self.integrate)

    def row(self, step: Step, k: int, dq: Expr) -> Form | None:
        """None: the work over a step is `path_term`."""
        return None

    def path_term(self, step: Step, tests: Sequence[Expr], trial: Expr) -> Term:
        """Virtual work of both rows of a step that is quadratic in time, eq. (Q2)."""
        return path_terms(*self._common, step.rows, tests, trial, self.integrate)

    def bow(self, step: Step, held: Expr) -> Form:
        """Energy `bow.C bow/2` of the bow over a step, eq. (Q5); arguments as of `Elastic`."""
        e = self._bow_of(step)
        return self.integrate(self.section.stored(e, self.section.forces(self.layout, held)))

    def _bow_of(self, step: Step) -> Expr:
        return step.bow_of(self.strain)

    def resultants(self, q: Expr) -> Any:
        """Strains and forces of a state."""
        return self.strain.value(q), self.section.forces(self.layout, q)

    def mean(self, step: Step) -> Any:
        """Means of the strains and forces over a step that is quadratic in time."""
        e = moment_of(self.strain, step.rows.stresses[0].moment, step.states)
        return e, self.section.forces(self.layout, step.path.end)


@dataclass(frozen=True)
class GeneralStrains(Strains):
    """Strains that are not quadratic in the state, with a linear section.

    Args:
        weight: Scales of the strains' squares, by which unlike units become comparable.
        product: Product of two states, by their gradients and directors.
    """

    weight: Sequence[Any]
    product: Callable[[Expr, Expr], Expr]

    def interval(self, span: Interval, dq: Expr) -> Form:
        """Virtual work of a sub-interval, made exact along the change of the strains."""
        return self.integrate(interval_work(*self._common, span, dq, ExactInterval(self.weight)))

    def interval_term(self, sub: SubInterval, dq: Expr, trial: Expr) -> Term | None:
        """None: kernels at mean and chord are those of quadratic strains."""
        return None

    def path_term(self, step: Step, tests: Sequence[Expr], trial: Expr) -> Term:
        """Virtual work of both rows of a step, made exact along its chord."""
        return general_terms(*self._common, self.product, step, tests, trial, self.integrate)

    def _over(self, step: Step, states: Sequence[Expr]) -> GeneralStrain:
        return GeneralStrain(self.strain, states, step.whole.places)

    def _bow_of(self, step: Step) -> Expr:
        return self._over(step, step.path.states).bow

    def mean(self, step: Step) -> Any:
        """Means over a step."""
        e = self._over(step, step.states).mean
        return e, self.section.forces(self.layout, step.path.end)


@dataclass(frozen=True)
class HyperelasticStrains(Strains):
    """Strains with any energy density, the membrane and shear strains as assumed ones.

    Args:
        quadratic: Whether the strains are quadratic in the state.
        weight: As of `GeneralStrains`.
        product: As of `GeneralStrains`.
    """

    section: NonlinearMixed
    quadratic: bool
    weight: Sequence[Any]
    product: Callable[[Expr, Expr], Expr]

    def interval(self, span: Interval, dq: Expr) -> Form:
        """Virtual work of a sub-interval by a discrete gradient, eq. (21)."""
        acting = at_middle if self.quadratic else ExactInterval(self.weight)
        return self.integrate(self.section.virtual_work(self.strain, self.layout, span, dq, acting))

    def interval_term(self, sub: SubInterval, dq: Expr, trial: Expr) -> Term | None:
        """None: kernels at mean and chord are those of linear sections."""
        return None

    def _over(self, step: Step) -> NonlinearPath:
        return NonlinearPath(self.section, self.layout, self.strain, step)

    def _general(self, step: Step, states: Sequence[Expr]) -> GeneralPath:
        return GeneralPath(self.section, self.layout, self.strain, step, states)

    def path_term(self, step: Step, tests: Sequence[Expr], trial: Expr) -> Term:
        """Virtual work of both rows of a step."""
        if self.quadratic:
            return point_terms(self._over(step), step.points, tests, trial, self.integrate)
        along = self._general(step, step.states)
        return hyperelastic_terms(along, self.product, step, tests, trial, self.integrate)

    def bow(self, step: Step, held: Expr) -> Form:
        """Energy of the bow with the stiffness at the start."""
        if self.quadratic:
            return self.integrate(self._over(step).bow_energy())
        return self.integrate(self._general(step, step.path.states).bow_energy())

    def mean_stress(self, step: Step) -> Expr:
        """Mean of the resultants over a step, shape (8,)."""
        if self.quadratic:
            return self._over(step).mean_stress()
        return self._general(step, step.states).mean_stress()
