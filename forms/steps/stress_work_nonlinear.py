"""Virtual work of any strain energy density over a step that is quadratic in time.

The strain along the path is replaced by the quadratic one whose rate is the projection of `e'` on
linear functions of time::

    E(tau) = e_i + (e_f - e_i) tau + 3 bow (tau^2 - tau),      bow = e_i + e_f - 2 <s>,

and `S_0 + S_1 P1` is the projection of `psi'(E(tau))` on linear functions by two Gauss points.
There `E` is a moment of the strains as any other, `<s> -+ (e_f - e_i)/(2 sqrt(3))`, and both rows
are sums of `stress at a point . slope`: the templates of `forms.steps.stress_work`, with `psi'` and
`psi''` at one strain in place of a stiffness. What two points leave is made good along the chord of
the strains (per point in space, after O. Gonzalez, J. Nonlinear Sci. 6 (1996) 449-467)::

    r = psi(e_f) - psi(e_i) - S_0.(e_f - e_i) - S_1.bow,
    S_0 += r (e_f - e_i)/(|e_f - e_i|^2 + tiny),

which is of fourth order in the step, so that the energy law (Q5) is exact. Derivatives leave it
out: Newton's method then converges linearly with a factor of third order in the strains of a step.
The dissipation adds `alpha/2 psi''(e_i) bow` to `S_1`; where `psi` is convex it takes energy only.

Membrane and shear strains of the reduced rule are assumed ones `S` (see
`forms.steps.mixed_nonlinear`), which have a path of their own; the resultants `N` of both rows tie
it to that of the displacements
at the Gauss points.

===========  =====================================================================  ====
symbol       name                                                                   eq.
===========  =====================================================================  ====
`E(tau)`     strain along the path                                                  (Q3)
`r`          what the work of the stresses lacks of the change of the energy        (Q5)
`tiny`       square of a strain below which `r` is round-off                        -
===========  =====================================================================  ====
"""

from collections.abc import Callable, Sequence

import ufl
from ufl.core.expr import Expr

from shellmb.forms.measure import Measure
from shellmb.forms.state import Layout
from shellmb.forms.steps.discrete import gradient
from shellmb.forms.steps.mixed import assumed
from shellmb.forms.steps.mixed_nonlinear import NonlinearMixed, Tie, ties
from shellmb.forms.steps.path import Step, Stress, across, moment_of

# At chords of 1e-6 the correction, of their first and the bow's fourth power, is round-off for bows
# of a hundredth; and round-off of psi over such a chord is not more than 1e-10 of the stress yet.
TINY = 1e-12

Density = Callable[[Expr], Expr]


def tangent(psi: Density, e: Expr) -> Expr:
    """Second derivative of a density at a strain, shape (n, n)."""
    variable = ufl.variable(e)
    return ufl.diff(ufl.diff(psi(variable), variable), variable)


class NonlinearPath:
    """A section of any strain energy density over a step.

    Args:
        section: Its mixed form.
        layout: Parts of the state.
        strain: Strains of the displacements.
        step: The step.
    """

    def __init__(
        self,
        section: NonlinearMixed,
        layout: Layout,
        strain: Measure,
        step: Step,
    ) -> None:
        self._section, self._layout = section, layout
        self._states, self._points, self._start = step.states, step.points, step.path.start
        self._parts = tuple(zip(section.densities, (strain, assumed(strain, layout)), strict=True))
        self._ties = ties(strain, layout)

    def _forces(self, q: Expr) -> Expr:
        """Forces that a state has, shape (15,)."""
        return self._section.forces(self._layout, q)

    def work(self, tests: Sequence[Expr]) -> list[Expr]:
        """Densities of both rows for each quadrature rule, without the dissipation.

        Args:
            tests: Virtual displacement of each row.
        """
        points, states = self._points, self._states
        first, *others = self._work(points.stresses, tests)
        for psi, measure in self._parts:
            chord, start, end = (
                moment_of(measure, m, states) for m in (points.chord, points.start, points.end)
            )
            rest = psi(end) - psi(start)
            for point, rate in zip(points.stresses, points.rates, strict=True):
                stress = gradient(psi, moment_of(measure, point.moment, states))
                rest -= ufl.dot(stress, moment_of(measure, rate, states))
            weighed = self._section.scaled(chord)
            share = rest / (ufl.dot(weighed, chord) + self._section.least(TINY, start, end))
            first += share * ufl.dot(weighed, across(measure, points.mean, states, tests))
        return [first, *others]

    def simple_work(self, k: int, dq: Expr) -> list[Expr]:
        """Densities of one row of which derivatives are taken, without what two points leave."""
        return self._work([point.in_row(k) for point in self._points.stresses], [dq])

    def _work(self, stresses: Sequence[Stress], tests: Sequence[Expr]) -> list[Expr]:
        """Work of the stresses at both points and of what ties the strains."""
        states = self._states
        works = [
            ufl.dot(
                gradient(psi, moment_of(measure, point.moment, states)),
                across(measure, point.slopes, states, tests),
            )
            for psi, measure in self._parts
            for point in stresses
        ]
        tied = [sum(self._tie(tie, point, tests) for point in stresses) for tie in self._ties]
        return [sum(works) + tied[0], *tied[1:]]

    def _tie(self, tie: Tie, point: Stress, tests: Sequence[Expr]) -> Expr:
        """Work of the forces that tie strains of the cells to those of the displacements."""
        (act, gap), states = tie, self._states
        left = moment_of(gap, point.moment, states)
        acting = across(gap, point.slopes, states, tests)
        rows = zip(point.slopes, tests, strict=True)
        return ufl.dot(act(self._forces(point.moment.held)), acting) + sum(
            slope.c * ufl.dot(act(self._forces(dq)), left) for slope, dq in rows
        )

    def damping(self, stresses: Sequence[Stress], tests: Sequence[Expr]) -> list[Expr]:
        """Contribution of the dissipation to some rows, with the stiffness at the start.

        Args:
            stresses: The stress of the bow, in these rows.
            tests: Virtual displacement of each row.
        """
        states, (bow,) = self._states, stresses

        def work(psi: Density, measure: Measure) -> Expr:
            stiffness = tangent(psi, measure.value(self._start))
            stress = ufl.dot(stiffness, moment_of(measure, bow.moment, states))
            return ufl.dot(stress, across(measure, bow.slopes, states, tests))

        works = [work(*part) for part in self._parts]
        return [sum(works[1:], works[0])]

    def bow_energy(self) -> list[Expr]:
        """Energy of the bow of the strains, with the stiffness at the start."""
        points, states, found = self._points, self._states, []
        for psi, measure in self._parts:
            bow = moment_of(measure, points.bow, states)
            stiffness = tangent(psi, moment_of(measure, points.start, states))
            found.append(ufl.dot(bow, ufl.dot(stiffness, bow)) / 2)
        return [sum(found)]

    def mean_stress(self) -> Expr:
        """Mean of the resultants over the step, shape (8,)."""
        points, states = self._points.stresses, self._states
        found = [
            gradient(psi, moment_of(measure, point.moment, states))
            for psi, measure in self._parts
            for point in points
        ]
        return sum(found[1:], found[0]) / len(points)
