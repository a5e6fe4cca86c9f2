"""Strains of a body with their section, linear or hyperelastic, and their terms over a step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import ufl
from ufl import Form
from ufl.core.expr import Expr

from shellmb.forms.measure import Measure, at_middle
from shellmb.forms.state import Layout
from shellmb.forms.steps.general_hyperelastic import GeneralPath
from shellmb.forms.steps.general_strains import ExactInterval, GeneralStrain
from shellmb.forms.steps.mixed import Interval
from shellmb.forms.steps.mixed_nonlinear import NonlinearMixed
from shellmb.forms.steps.path import Rows, Step, Stress, moment_of
from shellmb.forms.steps.stress_work import (
    MixedSection,
    general_stresses,
    general_work,
    interval_work,
    stress_work,
)
from shellmb.forms.steps.stress_work_nonlinear import NonlinearPath
from shellmb.model.body import Elastic, SubInterval, Term


def path_terms(
    section: MixedSection,
    layout: Layout,
    strain: Measure,
    rows: Rows,
    tests: Sequence[Expr],
    trial: Expr,
    integrate: Callable[[list[Expr]], Form],
) -> Term:
    """Internal forces of some rows: all stresses in one form.

    So a residual takes the strains of the states once.

    Args:
        section: Its mixed form.
        layout: Parts of the state.
        strain: Its strains.
        rows: What the rows are made of.
        tests: Virtual displacement of each row.
        trial: Trial function of the space of an unknown state.
        integrate: Integral of densities, one for each quadrature rule.
    """
    states, stresses, single = rows.states[: rows.moving], rows.stresses, (_single(trial),)
    # strains once for all forms: most of the time to write these down is theirs
    strains = [moment_of(strain, stress.moment, states) for stress in stresses]
    common = section, layout, strain, states, strains
    residual = _stress_work(*common, stresses, tuple(tests), integrate)
    if tuple(tests) == single:
        return Term(residual, rows.numbers, (residual,))
    alone = tuple(
        _stress_work(*common, [s.in_row(k) for s in stresses], single, integrate)
        for k in range(len(rows.numbers))
    )
    return Term(residual, rows.numbers, alone)


def _stress_work(
    section: MixedSection,
    layout: Layout,
    strain: Measure,
    states: Sequence[Expr],
    strains: Sequence[Expr],
    stresses: Sequence[Stress],
    tests: Sequence[Expr],
    integrate: Callable[[list[Expr]], Form],
) -> Form:
    """Work of some stresses of strains, with what remains of their compatibility."""
    pairs = zip(stresses, strains, strict=True)
    works = [stress_work(section, layout, strain, states, s, e, tests) for s, e in pairs]
    return integrate([sum(densities) for densities in zip(*works, strict=True)])


def _single(trial: Any) -> Expr:
    """Virtual displacement of a single row."""
    return ufl.TestFunction(trial.ufl_function_space())


def together(a: Term, b: Term) -> Term:
    """The sum of two terms as one."""
    alone = tuple(f + g for f, g in zip(a.alone, b.alone, strict=True))
    return Term(a.residual + b.residual, a.rows, alone)


NO_FORCES = ufl.as_vector([0, 0])


@dataclass(frozen=True)
class Stiffness:
    """A linear section without resultants, as `forms.steps.stress_work.MixedSection`.

    Args:
        C: Stiffness, shape (n, n), symmetric.
    """

    C: Expr

    def forces(self, layout: Layout, q: Expr) -> Expr:
        """There are none."""
        return NO_FORCES

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


Integrate = Callable[[Sequence[Expr]], Form]


@dataclass(frozen=True)
class SectionStrains(Elastic):
    """Strains with a section in mixed form: what all of them have in common.

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
class Strains(SectionStrains):
    """Quadratic strains with a linear section in mixed form."""

    def interval_term(self, sub: SubInterval, dq: Expr, trial: Expr) -> Term | None:
        """Virtual work with its derivatives; None where the states are no functions."""
        if sub.rows is None:
            return None
        return path_terms(*self._common, sub.rows, [dq], trial, self.integrate)

    def path_term(self, step: Step, tests: Sequence[Expr], trial: Expr) -> Term | None:
        """Virtual work of both rows of a step that is quadratic in time, eq. (Q2)."""
        return path_terms(*self._common, step.rows, tests, trial, self.integrate)


@dataclass(frozen=True)
class SeparateRows(SectionStrains):
    """Strains whose forces are written row by row of a step, by what reports them."""

    def row(self, step: Step, k: int, dq: Expr) -> Form:
        """Virtual work in one row of a step that is quadratic in time, eq. (Q2)."""
        stresses = [s.in_row(k) for s in step.rows.stresses]
        strains = [moment_of(self.strain, s.moment, step.states) for s in stresses]
        return _stress_work(*self._common, step.states, strains, stresses, (dq,), self.integrate)


@dataclass(frozen=True)
class GeneralStrains(SectionStrains):
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

    def path_term(self, step: Step, tests: Sequence[Expr], trial: Expr) -> Term:
        """Virtual work of both rows of a step, made exact along its chord.

        Derivatives are those without what makes it so.
        """
        held, alpha = (step.path.end, step.path.end_velocity), step.path.alpha
        along, rows, on = self._over(step, step.states), step.whole.rows, self.integrate
        common = self.section, self.layout, along, held, alpha
        residual = on([along.rest(s, self.product, tests[0]) for s, _ in general_stresses(*common)])
        for row, dq in zip(rows, tests, strict=True):
            residual += on(general_work(*common, row, dq))
        alone = (on(general_work(*common, row, _single(trial))) for row in rows)
        return Term(residual, step.rows.numbers, tuple(alone))

    def _over(self, step: Step, states: Sequence[Expr]) -> GeneralStrain:
        return GeneralStrain(self.strain, states, step.whole.places)

    def _bow_of(self, step: Step) -> Expr:
        return self._over(step, step.path.states).bow

    def mean(self, step: Step) -> Any:
        """Means over a step."""
        e = self._over(step, step.states).mean
        return e, self.section.forces(self.layout, step.path.end)


@dataclass(frozen=True)
class HyperelasticStrains(SectionStrains):
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

    def _over(self, step: Step) -> NonlinearPath:
        return NonlinearPath(self.section, self.layout, self.strain, step)

    def _general(self, step: Step, states: Sequence[Expr]) -> GeneralPath:
        return GeneralPath(self.section, self.layout, self.strain, step, states)

    def path_term(self, step: Step, tests: Sequence[Expr], trial: Expr) -> Term:
        """Virtual work of both rows of a step."""
        rows, dq = step.whole.rows, _single(trial)
        if self.quadratic:
            return self._at_points(step, tests, dq)
        along, on = self._general(step, step.states), self.integrate
        residual = on(along.rest(self.product, tests[0]))
        for row, test in zip(rows, tests, strict=True):
            residual += on(along.work(row, test))
        return Term(residual, step.rows.numbers, tuple(on(along.simple_work(r, dq)) for r in rows))

    def _at_points(self, step: Step, tests: Sequence[Expr], dq: Expr) -> Term:
        """Work at Gauss' points in time; `dq`: virtual displacement of a single row."""
        section, points, on = self._over(step), step.points, self.integrate
        residual, alone = on(section.work(tests)), [on(section.simple_work(k, dq)) for k in (0, 1)]
        if points.dissipates:
            residual += on(section.damping([points.damping], tests))
            for k in (0, 1):
                alone[k] += on(section.damping([points.damping.in_row(k)], [dq]))
        return Term(residual, (0, 1), tuple(alone))

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
