"""Virtual work of any strain energy density over a step that is quadratic in time.

The strain along the path is replaced by the quadratic one whose rate is the projection of `e'` on
linear functions of time::

    E(tau) = e_i + (e_f - e_i) tau + 3 bow (tau^2 - tau),      bow = e_i + e_f - 2 <s>,

and `S_0 + S_1 P1` is the projection of `psi'(E(tau))` on linear functions by two Gauss points.
There `E` is `<s> -+ (e_f - e_i)/(2 sqrt(3))`. The stresses act on strains that are quadratic in the
state by (Q2), on others as `forms.steps.general_strains` says. What two points leave is made good
along the chord of the strains (per point in space, after O. Gonzalez, J. Nonlinear Sci. 6 (1996)
449-467)::

    r = psi(e_f) - psi(e_i) - S_0.(e_f - e_i) - S_1.bow,
    S_0 += r (e_f - e_i)/(|e_f - e_i|^2 + tiny),

which is of fourth order in the step, so that the energy law (Q5) is exact. Derivatives leave it
out: Newton's method then converges linearly with a factor of third order in the strains of a step.
The dissipation adds `alpha/2 psi''(e_i) bow` to `S_1`; where `psi` is convex it takes energy only.

Membrane and shear strains of the reduced rule are assumed ones `S` (see
`forms.steps.mixed_nonlinear`), which have a path of their own; the resultants `N` of both rows tie
it to that of the displacements.

===========  =====================================================================  ====
symbol       name                                                                   eq.
===========  =====================================================================  ====
`E(tau)`     strain along the path                                                  (Q3)
`r`          what the work of the stresses lacks of the change of the energy        (Q5)
`tiny`       square of a strain below which `r` is round-off                        -
===========  =====================================================================  ====
"""

from collections.abc import Callable, Mapping

import ufl
from ufl.core.expr import Expr

from shellmb.forms.measure import Measure
from shellmb.forms.state import Layout
from shellmb.forms.steps.discrete import gradient
from shellmb.forms.steps.general_strains import POINTS, StrainPath
from shellmb.forms.steps.mixed import assumed
from shellmb.forms.steps.mixed_nonlinear import NonlinearMixed, ties
from shellmb.forms.steps.path import Step

# At chords of 1e-6 the correction, of their first and the bow's fourth power, is round-off for bows
# of a hundredth; and round-off of psi over such a chord is not more than 1e-10 of the stress yet.
TINY = 1e-12

Density = Callable[[Expr], Expr]


def tangent(psi: Density, e: Expr) -> Expr:
    """Second derivative of a density at a strain, shape (n, n)."""
    variable = ufl.variable(e)
    return ufl.diff(ufl.diff(psi(variable), variable), variable)


def projected(psi: Density, e: StrainPath) -> tuple[Expr, Expr]:
    """Projection of `psi'` along a strain's path on linear functions of time."""
    half = e.change * POINTS[1] / 2
    early, late = gradient(psi, e.mean - half), gradient(psi, e.mean + half)
    return (early + late) / 2, 3 * POINTS[1] / 2 * (late - early)


class NonlinearPath:
    """A section of any strain energy density over a step.

    Args:
        section: Its mixed form.
        layout: Parts of the state.
        strain: Strains of the displacements.
        step: The step.
        over: A strain over the step.
    """

    def __init__(
        self,
        section: NonlinearMixed,
        layout: Layout,
        strain: Measure,
        step: Step,
        over: Callable[[Measure], StrainPath],
    ) -> None:
        self._section, self._layout, self._step = section, layout, step
        measures = strain, assumed(strain, layout)
        self._parts = [
            (psi, measure.value(step.path.start), over(measure))
            for psi, measure in zip(section.densities, measures, strict=True)
        ]
        self._ties = [(tie.act, over(tie.measure)) for tie in ties(strain, layout)]

    def _forces(self, q: Expr) -> Expr:
        """Forces that a state has, shape (15,)."""
        return self._section.forces(self._layout, q)

    def _stresses(self, psi: Density, start: Expr, e: StrainPath, exact: bool) -> tuple[Expr, Expr]:
        """`S_0` and `S_1`, eq. (Q3)."""
        first, second = projected(psi, e)
        if exact:
            done = ufl.dot(first, e.change) + ufl.dot(second, e.bow)
            chord = self._section.scaled(e.change)
            tiny = self._section.least(TINY, e.first, e.last)
            first += (psi(e.last) - psi(e.first) - done) / (ufl.dot(chord, e.change) + tiny) * chord
        if self._step.dissipates:
            second += self._step.path.alpha / 2 * ufl.dot(tangent(psi, start), e.bow)
        return first, second

    def work(self, tests: Mapping[int, Expr], exact: bool = True) -> list[Expr]:
        """Densities of some rows for each quadrature rule.

        Args:
            tests: Virtual displacements by the rows P0 (0) and P1 (1).
            exact: Whether what Gauss' points leave is made good.
        """
        path = self._step.path
        first, second = self._forces(path.end), self._forces(path.end_velocity)
        stresses = [(e, self._stresses(psi, start, e, exact)) for psi, start, e in self._parts]
        works = [e.work(s, k, dq, exact) for e, s in stresses for k, dq in tests.items()]
        tied = [
            sum(
                gap.work((act(first), act(second)), k, dq, exact)
                + ufl.dot(act(self._forces(dq)), gap.moments()[k])
                for k, dq in tests.items()
            )
            for act, gap in self._ties
        ]
        return [sum(works) + tied[0], *tied[1:]]

    def bow_energy(self) -> list[Expr]:
        """Energy of the bow of the strains, with the stiffness at the start, eq. (Q5)."""
        bows = [(tangent(psi, start), e.bow) for psi, start, e in self._parts]
        return [sum(ufl.dot(bow, ufl.dot(stiffness, bow)) / 2 for stiffness, bow in bows)]

    def mean_stress(self) -> Expr:
        """Mean of the resultants over the step, shape (8,)."""
        shared, own = (projected(psi, e)[0] for psi, _, e in self._parts)
        return shared + own
