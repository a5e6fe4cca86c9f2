"""Elastic parts of bodies: strains with a section, and energies of measures, over a step."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import ufl
from ufl import Form
from ufl.core.expr import Expr

from shellmb.forms.measure import Measure, at_middle, measure
from shellmb.forms.steps import potentials as forms
from shellmb.forms.steps import stress_work
from shellmb.forms.steps.discrete import gradient, variation
from shellmb.forms.steps.mixed import Interval, MixedStrains
from shellmb.forms.steps.mixed_nonlinear import NonlinearMixed, NonlinearPath, projected, tangent
from shellmb.forms.steps.path import Rows, Step, Stress, moment_of, slope_at
from shellmb.forms.steps.potentials import Stretch
from shellmb.model.body import Elastic, SubInterval, Term


def path_terms(
    of: MixedStrains,
    rows: Rows,
    tests: Sequence[Expr],
    trial: Expr,
    integrate: Callable[[list[Expr]], Form],
) -> Term:
    """Internal forces of some rows: all stresses in one form.

    So a residual takes the strains of the states once.

    Args:
        of: Strains with their section.
        rows: What the rows are made of.
        tests: Virtual displacement of each row.
        trial: Trial function of the space of an unknown state.
        integrate: Integral of densities, one for each quadrature rule.
    """
    states, stresses, single = rows.states[: rows.moving], rows.stresses, (_single(trial),)
    # strains once for all forms: most of the time to write these down is theirs
    strains = [moment_of(of.strain, stress.moment, states) for stress in stresses]

    def work(stresses: Sequence[Stress], tests: Sequence[Expr]) -> Form:
        return integrate(_stress_work(of, states, stresses, strains, tests))

    residual = work(stresses, tuple(tests))
    if tuple(tests) == single:
        return Term(residual, rows.numbers, (residual,))
    each = range(len(rows.numbers))
    alone = tuple(work([s.in_row(k) for s in stresses], single) for k in each)
    return Term(residual, rows.numbers, alone)


def _stress_work(
    of: MixedStrains,
    states: Sequence[Expr],
    stresses: Sequence[Stress],
    strains: Sequence[Expr],
    tests: Sequence[Expr],
) -> list[Expr]:
    """Work of some stresses of strains, with what remains of their compatibility."""
    pairs = zip(stresses, strains, strict=True)
    works = [stress_work.stress_work(of, states, s, e, tests) for s, e in pairs]
    return [sum(densities) for densities in zip(*works, strict=True)]


def _single(trial: Any) -> Expr:
    """Virtual displacement of a single row."""
    return ufl.TestFunction(trial.ufl_function_space())


def two_rows(
    step: Step, tests: Sequence[Expr], trial: Any, work: Callable[[int, Expr, bool], Form]
) -> Term:
    """Work in both rows of a step that is quadratic in time.

    Args:
        step: The step.
        tests: Virtual displacement of each row.
        trial: Trial function of the space of an unknown state.
        work: Work in a row on a virtual displacement, exact or without what derivatives leave out.
    """
    alone = tuple(work(k, _single(trial), False) for k in (0, 1))
    return Term(work(0, tests[0], True) + work(1, tests[1], True), step.rows.numbers, alone)


def together(a: Term, b: Term) -> Term:
    """The sum of two terms as one."""
    alone = tuple(f + g for f, g in zip(a.alone, b.alone, strict=True))
    return Term(a.residual + b.residual, a.rows, alone)


Integrate = Callable[[Sequence[Expr]], Form]


@dataclass(frozen=True)
class SectionStrains(MixedStrains, Elastic):
    """Strains with a section in mixed form: what all of them have in common.

    Args:
        section: The section.
        layout: Parts of the state.
        strain: The strains.
        integrate: Integral of densities, one for each quadrature rule.
    """

    section: Any
    integrate: Integrate

    def energy(self, q: Expr) -> Form:
        """Energy of a state."""
        return self.integrate(self.section.energy(self.strain, self.layout, q))

    def jump(self, a: Expr, b: Expr) -> Form:
        """Elastic part of `c^2` for a jump of the state, eq. (34)."""
        return self.integrate(self.section.jump(self.strain, self.layout, a, b))

    def interval(self, span: Interval, dq: Expr) -> Form:
        """Virtual work of a sub-interval, eqs. (20)-(22), (32)."""
        return self.integrate(stress_work.interval_work(self, span, dq))

    def bow(self, step: Step, held: Expr) -> Form:
        """Energy `bow.C bow/2` of the bow over a step, eq. (Q5); arguments as of `Elastic`."""
        e = self._bow_of(step)
        return self.integrate(self.section.stored(e, self.forces(held)))

    def _bow_of(self, step: Step) -> Expr:
        return step.bow_of(self.strain)

    def mean(self, step: Step) -> Any:
        """Means of the strains and forces over a step that is quadratic in time."""
        e = moment_of(self.strain, step.rows.stresses[0].moment, step.states)
        return e, self.forces(step.path.end)


@dataclass(frozen=True)
class Strains(SectionStrains):
    """Quadratic strains with a linear section in mixed form."""

    def interval_term(self, sub: SubInterval, dq: Expr, trial: Expr) -> Term | None:
        """Virtual work with its derivatives; None where the states are no functions."""
        if sub.rows is None:
            return None
        return path_terms(self, sub.rows, [dq], trial, self.integrate)

    def path_term(self, step: Step, tests: Sequence[Expr], trial: Expr) -> Term | None:
        """Virtual work of both rows of a step that is quadratic in time, eq. (Q2)."""
        return path_terms(self, step.rows, tests, trial, self.integrate)


@dataclass(frozen=True)
class SeparateRows(SectionStrains):
    """Strains whose forces are written row by row of a step, by what reports them."""

    def row(self, step: Step, k: int, dq: Expr) -> Form:
        """Virtual work in one row of a step that is quadratic in time, eq. (Q2)."""
        stresses = [s.in_row(k) for s in step.rows.stresses]
        strains = [moment_of(self.strain, s.moment, step.states) for s in stresses]
        found = _stress_work(self, step.states, stresses, strains, (dq,))
        return self.integrate(found)


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
        acting = partial(stress_work.exact_interval, self.weight)
        return self.integrate(stress_work.interval_work(self, span, dq, acting))

    def path_term(self, step: Step, tests: Sequence[Expr], trial: Expr) -> Term:
        """Virtual work of both rows of a step, made exact along its chord.

        Derivatives are those without what makes it so.
        """
        along = self._over(step.states)

        def row(k: int, dq: Expr, exact: bool) -> Form:
            return self.integrate(stress_work.general_work(self, along, step.path, k, dq, exact))

        return two_rows(step, tests, trial, row)

    def _over(self, states: Sequence[Expr]) -> stress_work.GeneralStrain:
        return stress_work.GeneralStrain(self.strain, states, self.product)

    def _bow_of(self, step: Step) -> Expr:
        return self._over(step.path.states).bow

    def mean(self, step: Step) -> Any:
        """Means over a step."""
        e = self._over(step.states).mean
        return e, self.forces(step.path.end)


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
        exact = partial(stress_work.exact_interval, self.weight)
        acting = at_middle if self.quadratic else exact
        return self.integrate(self.section.virtual_work(self.strain, self.layout, span, dq, acting))

    def _over(self, step: Step, states: Sequence[Expr]) -> NonlinearPath:
        def over(strain: Measure) -> stress_work.StrainPath:
            if self.quadratic:
                return stress_work.QuadraticStrain(strain, states, step)
            return stress_work.GeneralStrain(strain, states, self.product)

        return NonlinearPath(self.section, self.layout, self.strain, step, over)

    def path_term(self, step: Step, tests: Sequence[Expr], trial: Expr) -> Term:
        """Virtual work of both rows of a step."""
        along, on, dq = self._over(step, step.states), self.integrate, _single(trial)
        residual = on(along.work(dict(enumerate(tests))))
        alone = tuple(on(along.work({k: dq}, exact=False)) for k in (0, 1))
        return Term(residual, step.rows.numbers, alone)

    def bow(self, step: Step, held: Expr) -> Form:
        """Energy of the bow with the stiffness at the start."""
        return self.integrate(self._over(step, step.path.states).bow_energy())

    def mean_stress(self, step: Step) -> Expr:
        """Mean of the resultants over a step, shape (8,)."""
        return self._over(step, step.states).mean_stress()


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
            # derivatives go through few numbers in place of all unknowns
            stress = ufl.variable(self._stress(a, ufl.variable(b), span.beta))
        return self.weight * ufl.dot(stress, variation(self.measure, span.mid, dq)) * self.dx

    def _at(self, e: Expr) -> Expr:
        """Argument of the potential by the measures."""
        return e

    def _path(self, e: Stretch) -> Stretch:
        """Argument of the potential over a step."""
        return e

    def _whole(self, e: Expr) -> Expr:
        """The energy as a function of the measures."""
        return self.potential(self._at(e))

    def _stress(self, a: Expr, b: Expr, beta: Expr | float) -> Expr:
        return forms.interval_stress(self.potential, a, b, beta, self.smooth)

    def _stresses(self, e: Stretch, alpha: Expr) -> tuple[Expr, Expr]:
        return forms.path_stresses(self.potential, e, alpha, self.smooth)

    def _over(self, step: Step) -> tuple[Measure, Stretch]:
        """The measure, and what it is over a step."""
        path, measured = step.path, measure(self.measure)
        start = self.measure(path.start)
        changes = self.measure(path.end) - start, step.bow_of(measured)
        # derivatives go through few numbers in place of all unknowns
        return measured, Stretch(start, *map(ufl.variable, changes))

    def row(self, step: Step, k: int, dq: Expr) -> Form | None:
        """Virtual work over a step, with stresses linear in time, eq. (Q2)."""
        (measured, e), p = self._over(step), step.path
        stresses = map(ufl.variable, self._stresses(e, p.alpha))
        work = sum(
            ufl.dot(stress, slope_at(measured, on.slopes[k], p.states, dq))
            for stress, on in zip(stresses, step.rows.stresses, strict=True)
        )
        return self.weight * work * self.dx

    def bow(self, step: Step, held: Expr) -> Form | None:
        """Energy of the bow of the measures, J."""
        _, e = self._over(step)
        return self.weight * forms.path_loss(self.potential, self._path(e)) * self.dx

    def energy(self, q: Expr) -> Form:
        """The energy, J."""
        return self.weight * self._whole(self.measure(q)) * self.dx

    def jump(self, a: Expr, b: Expr) -> Form:
        """Elastic part of eq. (34), J."""
        ends = (self._at(self.measure(q)) for q in (a, b))
        return self.weight * forms.interval_jump(self.potential, *ends) * self.dx


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

    def _path(self, e: Stretch) -> Stretch:
        return forms.distance_stretch(self.distance, e)

    def _stress(self, a: Expr, b: Expr, beta: Expr | float) -> Expr:
        stress = forms.interval_stress(self.potential, self._at(a), self._at(b), beta)
        return stress[0] * forms.interval_stress(self.distance, a, b, 0.0)

    def _stresses(self, e: Stretch, alpha: Expr) -> tuple[Expr, Expr]:
        return forms.distance_stresses(self.potential, self.distance, e, alpha)


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
        """Virtual work of a sub-interval; None at a single state, and where it is linearised."""
        span = sub.span
        if span.a is span.b or sub.linear or sub.rows is None:
            return None
        value, psi, (x, D) = self.strain.value, self.potential, sub.rows.states[:2]
        a, b = value(x - D / 2), value(x + D / 2)
        m, half = (a + b) / 2, stress_work.POINTS[1] * (b - a) / 2
        mean = (gradient(psi, m - half) + gradient(psi, m + half)) / 2
        mean += span.beta / 2 * (gradient(psi, b) - gradient(psi, a))
        acting, stresses = self.strain.change(x, dq), (self._stress(a, b, span.beta), mean)
        residual, simple = (ufl.dot(s, acting) * self.weight * self.dx for s in stresses)
        return Term(residual, sub.rows.numbers, (simple,))

    def path_term(self, step: Step, tests: Sequence[Expr], trial: Any) -> Term | None:
        """Virtual work of both rows of a step that is quadratic in time, eq. (Q2)."""
        psi, alpha = self.potential, step.path.alpha
        along = stress_work.QuadraticStrain(self.strain, step.states, step)
        stretch = Stretch(along.first, along.change, along.bow)
        stresses = forms.path_stresses(psi, stretch, alpha)
        first, second = projected(psi, along)
        middle = (along.first + along.last) / 2
        simple = first, second + alpha / 2 * ufl.dot(tangent(psi, middle), along.bow)

        def work(k: int, dq: Expr, exact: bool) -> Form:
            return along.work(stresses if exact else simple, k, dq) * self.weight * self.dx

        return two_rows(step, tests, trial, work)

    def row(self, step: Step, k: int, dq: Expr) -> Form | None:
        """None: the work over a step is `path_term`."""
        return None
