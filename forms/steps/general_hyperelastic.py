"""Work of any strain energy density on strains of any form, exact over a step quadratic in time.

The stresses are those of `forms.steps.stress_work_nonlinear`, with the ends and the bow of
`forms.steps.general_strains`: `S_0 + S_1 P1` is the projection of `psi'(E(tau))`, two Gauss points
in time, and what its work lacks of the change of the energy is made good along the chord of the
strains. They act as stresses on general strains do, and so do the resultants that tie the assumed
strains to those of the displacements. Derivatives leave out both corrections.
"""

from collections.abc import Callable, Sequence

import ufl
from ufl.core.expr import Expr

from shellmb.forms.measure import Measure
from shellmb.forms.state import Layout
from shellmb.forms.steps.discrete import gradient
from shellmb.forms.steps.general_strains import GeneralRow, GeneralStep, GeneralStrain
from shellmb.forms.steps.mixed import assumed
from shellmb.forms.steps.mixed_nonlinear import NonlinearMixed, ties
from shellmb.forms.steps.path import Step
from shellmb.forms.steps.stress_work_nonlinear import TINY, Density, tangent

# Gauss' two points on [-1, 1]
POINT = 3**-0.5


class GeneralPath:
    """A hyperelastic section over a step, with strains of any form.

    Args:
        section: Its mixed form.
        layout: Parts of the state.
        strain: Strains of the displacements.
        step: The step.
        states: Mean, chord, bow and mean velocity of its path.
    """

    def __init__(
        self,
        section: NonlinearMixed,
        layout: Layout,
        strain: Measure,
        step: Step,
        states: Sequence[Expr],
    ) -> None:
        self._section, self._layout = section, layout
        self.whole: GeneralStep = step.whole
        self._alpha = step.path.alpha
        self._held = step.path.end, step.path.end_velocity
        measures = strain, assumed(strain, layout)
        along = (GeneralStrain(measure, states, self.whole.places) for measure in measures)
        self._parts = tuple(zip(section.densities, along, strict=True))
        self._ties = [
            (tie.act, GeneralStrain(tie.measure, states, self.whole.places))
            for tie in ties(strain, layout)
        ]

    def _forces(self, q: Expr) -> Expr:
        """Forces that a state has, shape (15,)."""
        return self._section.forces(self._layout, q)

    def _projected(self, psi: Density, e: GeneralStrain) -> tuple[Expr, Expr]:
        """Projection of `psi'` on linear functions of time."""
        half = POINT / 2 * e.change
        early, late = gradient(psi, e.mean - half), gradient(psi, e.mean + half)
        return (early + late) / 2, 3 * POINT / 2 * (late - early)

    def _stresses(self, psi: Density, e: GeneralStrain) -> tuple[Expr, Expr]:
        """`S_0` and `S_1`, eq. (Q3)."""
        first, second = self._projected(psi, e)
        lacking = psi(e.last) - psi(e.first) - ufl.dot(first, e.change) - ufl.dot(second, e.bow)
        chord = self._section.scaled(e.change)
        tiny = self._section.least(TINY, e.first, e.last)
        first += lacking / (ufl.dot(chord, e.change) + tiny) * chord
        return first, second + self._alpha / 2 * ufl.dot(tangent(psi, e.first), e.bow)

    def _simple(self, psi: Density, e: GeneralStrain) -> tuple[Expr, Expr]:
        """Stresses without what makes them exact; what is damped without third derivatives."""
        first, second = self._projected(psi, e)
        damped = gradient(psi, e.first + e.bow) - gradient(psi, e.first)
        return first, second + self._alpha / 2 * damped

    def work(self, row: GeneralRow, dq: Expr) -> list[Expr]:
        """Densities of a row for each quadrature rule, without what Gauss' points lack."""
        return self._work(self._stresses, row, dq)

    def simple_work(self, row: GeneralRow, dq: Expr) -> list[Expr]:
        """The densities of which derivatives are taken."""
        return self._work(self._simple, row, dq)

    def _work(
        self,
        stresses: Callable[[Density, GeneralStrain], tuple[Expr, Expr]],
        row: GeneralRow,
        dq: Expr,
    ) -> list[Expr]:
        first, second, own = (self._forces(q) for q in (*self._held, dq))
        tied = [
            gap.work((act(first), act(second)), row, dq)
            + ufl.dot(act(own), row.own[0] * gap.mean + row.own[1] * gap.change / 2)
            for act, gap in self._ties
        ]
        whole = sum(e.work(stresses(psi, e), row, dq) for psi, e in self._parts)
        return [whole + tied[0], *tied[1:]]

    def rest(self, product: Callable[[Expr, Expr], Expr], dq: Expr) -> list[Expr]:
        """Correction of Gauss' points in the row P0; arguments as in `GeneralStrain.rest`."""
        whole = sum(e.rest(self._stresses(psi, e)[0], product, dq) for psi, e in self._parts)
        N = self._forces(self._held[0])
        tied = [gap.rest(act(N), product, dq) for act, gap in self._ties]
        return [whole + tied[0], *tied[1:]]

    def bow_energy(self) -> list[Expr]:
        """Energy of the bow of the strains, with the stiffness at the start, eq. (Q5)."""
        return [
            sum(ufl.dot(e.bow, ufl.dot(tangent(psi, e.first), e.bow)) / 2 for psi, e in self._parts)
        ]

    def mean_stress(self) -> Expr:
        """Mean of the resultants over the step, shape (8,)."""
        shared, own = (self._projected(psi, e)[0] for psi, e in self._parts)
        return shared + own
