"""Internal virtual work of shells of any strain energy density, with assumed strains, eq. (21).

As in `forms.steps.mixed`; cells have strains of their own beside the forces, which tie these to the
strains of the displacements.

**Over a step that is quadratic in time** the strain along the path is replaced by the quadratic one
whose rate is the projection of `e'` on linear functions of time::

    E(tau) = e_i + (e_f - e_i) tau + 3 bow (tau^2 - tau),      bow = e_i + e_f - 2 <s>,

and `S_0 + S_1 P1` is the projection of `psi'(E(tau))` on linear functions by two Gauss points.
There `E` is `<s> -+ (e_f - e_i)/(2 sqrt(3))`. The stresses act on strains that are quadratic in the
state by (Q2), on others as `forms.steps.stress_work` says. What two points leave is made good
along the chord of the strains (per point in space, after O. Gonzalez, J. Nonlinear Sci. 6 (1996)
449-467)::

    r = psi(e_f) - psi(e_i) - S_0.(e_f - e_i) - S_1.bow,
    S_0 += r (e_f - e_i)/(|e_f - e_i|^2 + tiny),

which is of fourth order in the step, so that the energy law (Q5) is exact. Derivatives leave it
out: Newton's method then converges linearly with a factor of third order in the strains of a step.
The dissipation adds `alpha/2 psi''(e_i) bow` to `S_1`; where `psi` is convex it takes energy only.

Membrane and shear strains of the reduced rule are assumed ones `S`, which have a path of their own;
the resultants `N` of both rows tie it to that of the displacements.

===========  =====================================================================  ====
symbol       name                                                                   eq.
===========  =====================================================================  ====
`E(tau)`     strain along the path                                                  (Q3)
`r`          what the work of the stresses lacks of the change of the energy        (Q5)
`tiny`       square of a strain below which `r` is round-off                        -
===========  =====================================================================  ====
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import ufl
from ufl.core.expr import Expr

from shellmb.forms.measure import Acting, Measure, at_middle
from shellmb.forms.shell import ShellStrains, named
from shellmb.forms.state import Layout
from shellmb.forms.steps.discrete import TINY_INCREMENT, discrete_gradient, gradient
from shellmb.forms.steps.mixed import Densities, Interval, assumed, membrane_shear
from shellmb.forms.steps.path import Step
from shellmb.forms.steps.stress_work import POINTS, StrainPath, added

type Energy = Callable[[Expr], Expr]

# squares, relative to that of the strain: what is lacked by less is 1e-12 of the energy, and
# round-off of the energy over such a step 1e-10 of the stress; and one that is no strain
ROUND_OFF, NOTHING = 1e-12, 1e-40
# At chords of 1e-6 the correction, of their first and the bow's fourth power, is round-off for bows
# of a hundredth; and round-off of psi over such a chord is not more than 1e-10 of the stress yet.
TINY = 1e-12


class Tie(NamedTuple):
    """Tie of strains of the cells to those of the displacements in one rule.

    Args:
        act: Stress of forces of the cells, shape (8,).
        measure: The strains it acts on, which vanish together over a cell.
    """

    act: Callable[[Expr], Expr]
    measure: Measure


def ties(strain: Measure, layout: Layout) -> list[Tie]:
    """Ties by rule, of strains of the displacements."""
    tying = layout.tying

    def act(N: Expr) -> Expr:
        return ufl.as_vector([*tying.whole(N), *tying.force(N)])

    def join(S: Expr, e: Expr) -> Expr:
        own = tying.strain(S)
        return ufl.as_vector([e[0], e[1], e[2], *(-own[k] for k in range(5))])

    def taken(k: int) -> Callable[[Expr], Expr]:
        return lambda N: tying.works(N)[k]

    whole = Tie(act, strain.beside(lambda q: layout.forces(q, "S"), join))
    return [whole, *(Tie(taken(k), strain) for k in range(len(tying.rules)))]


@dataclass(frozen=True)
class Quadratic:
    """Strain energy density of a linear section.

    Args:
        A: Membrane stiffness, N/m.
        B: Coupling, N; None: none.
        D: Bending stiffness, N m.
        G: Shear stiffness, N/m.
    """

    A: Expr
    B: Expr | None
    D: Expr
    G: Expr

    def __call__(self, strains: ShellStrains) -> Expr:
        """Energy of strains, J/m^2."""
        eps, kap, gam = strains
        squares = sum(ufl.dot(C * e, e) for C, e in ((self.A, eps), (self.D, kap), (self.G, gam)))
        return squares / 2 + (0 if self.B is None else ufl.dot(self.B * kap, eps))


@dataclass(frozen=True)
class NonlinearMixed:
    """Hu-Washizu form for any strain energy density `psi(strains)`, eq. (21).

    Strains `S` of the cells stand for (eps, gam), and forces `N` tie them to the displacements. `N`
    is the average stress of the sub-interval, so it needs no value of its own at the start.

    Args:
        psi: Strain energy per area as a function of `ShellStrains`, J/m^2.
        N0: Scale of the forces, N/m.
        a: Share of the energy of shear alone that displacements have, per element.
        thickness: Length that makes curvatures comparable with strains, m.
        kinked: Whether second derivatives jump. Then what Gauss' points lack is of second order in
            a step's strains, and made good where these are small, too; `psi` must have round-off of
            its own size, not of a stiffness.
    """

    psi: Callable[[ShellStrains], Expr]
    N0: Expr
    a: Expr
    thickness: Expr
    kinked: bool = False

    def energy_density(self, e: Expr) -> Expr:
        """Energy of strains, shape (8,), as the user wrote it."""
        return self.psi(named(e))

    def stress(self, e: Expr) -> Expr:
        """Resultants of strains, shape (8,) both."""
        return gradient(self.energy_density, e)

    def _sheared(self, e: Expr) -> Expr:
        """Energy of shear alone, by the share of the displacements."""
        zero = 0 * e[0]
        return self.a * self.energy_density(ufl.as_vector([*(zero,) * 6, e[6], e[7]]))

    def _psi_own(self, e: Expr) -> Expr:
        return self.energy_density(e) - self._sheared(e)

    def forces(self, layout: Layout, q: Expr) -> Expr:
        """Forces that tie the strains, shape (15,), N/m."""
        return self.N0 * layout.forces(q)

    def _average(self, psi: Callable[[Expr], Expr], a: Expr, b: Expr, beta: Expr | float) -> Expr:
        if a is b:
            return gradient(psi, a)
        h = self.thickness
        one = h / h
        weight = ufl.as_vector([one, one, one, h, h, h, one, one])
        jump = (gradient(psi, b) - gradient(psi, a)) / 2
        tiny = self.least(TINY_INCREMENT, a, b)
        return discrete_gradient(psi, a, b, weight, tiny) + beta * jump

    def scaled(self, e: Expr) -> Expr:
        """Strains with curvatures times the square of the thickness, shape (8,)."""
        h = self.thickness
        scales = (1, 1, 1, h**2, h**2, h**2, 1, 1)
        return ufl.as_vector([s * e[i] for i, s in enumerate(scales)])

    def least(self, usual: float, a: Expr, b: Expr) -> Expr | float:
        """Square of a strain between two below which a correction is round-off.

        Args:
            usual: Where second derivatives are smooth.
            a: Strain at the start, shape (8,).
            b: Strain at the end.
        """
        if not self.kinked:
            return usual
        return ROUND_OFF * (ufl.dot(self.scaled(a), a) + ufl.dot(self.scaled(b), b)) + NOTHING

    def virtual_work(
        self, strain: Measure, layout: Layout, span: Interval, dq: Expr, acting: Acting = at_middle
    ) -> Densities:
        """Virtual work, stress equation (test `S`) and compatibility (test `N`)."""
        work, tying = acting(strain, span.a, span.b, span.mid, dq), layout.tying
        shared, stress = self._averages(strain, layout, span)
        N, dN = (self.forces(layout, q) for q in (span.unknown, dq))
        dS = tying.strain(layout.forces(dq, "S"))
        moments = ufl.as_vector([*tying.whole(N), *named(stress).kap, 0, 0])
        whole = work(shared + moments)
        whole += ufl.dot(membrane_shear(stress) - tying.force(N), dS)
        found = [whole, *map(work, tying.works(N))]
        return added(
            found, [ufl.dot(t.act(dN), t.measure.value(span.b)) for t in ties(strain, layout)]
        )

    def energy(self, strain: Measure, layout: Layout, q: Expr) -> Densities:
        """Strain energy, of the displacements' share of shear and of the cells' own strains."""
        return [self._sheared(strain.value(q)) + self._psi_own(assumed(strain, layout).value(q))]

    def jump(self, strain: Measure, layout: Layout, a: Expr, b: Expr) -> Densities:
        """Half the work of the stress jump on the strain jump (eq. 34 for any material)."""
        seen = self.seen(strain, layout)
        pairs = [(psi, measure.value(a), measure.value(b)) for psi, measure in seen]
        jumps = ((gradient(psi, q1) - gradient(psi, q0), q1 - q0) for psi, q0, q1 in pairs)
        return [sum(ufl.dot(*jump) / 2 for jump in jumps)]

    def resultants(self, strain: Measure, layout: Layout, q: Expr) -> Expr:
        """Resultants N/m and moments N of a state, shape (8,)."""
        seen = self.seen(strain, layout)
        shared, own = (gradient(psi, measure.value(q)) for psi, measure in seen)
        return shared + own

    def averaged(self, strain: Measure, layout: Layout, span: Interval) -> Expr:
        """Resultants of the averaged stress of a sub-interval, the discrete gradient."""
        shared, own = self._averages(strain, layout, span)
        return shared + own

    def _averages(self, strain: Measure, layout: Layout, span: Interval) -> list[Expr]:
        """Averaged stresses of both energies."""
        found = []
        for psi, measure in self.seen(strain, layout):
            first = measure.value(span.a)
            last = first if span.a is span.b else measure.value(span.b)
            found.append(self._average(psi, first, last, span.beta))
        return found

    def seen(self, strain: Measure, layout: Layout) -> Sequence[tuple[Energy, Measure]]:
        """Energies of the displacements' strains and of the cells' own ones, with these strains."""
        return (self._sheared, strain), (self._psi_own, assumed(strain, layout))


def tangent(psi: Energy, e: Expr) -> Expr:
    """Second derivative of a density at a strain, shape (n, n)."""
    variable = ufl.variable(e)
    return ufl.diff(ufl.diff(psi(variable), variable), variable)


def projected(psi: Energy, e: StrainPath) -> tuple[Expr, Expr]:
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
        self._parts = [
            (psi, measure.value(step.path.start), over(measure))
            for psi, measure in section.seen(strain, layout)
        ]
        self._ties = [(tie.act, over(tie.measure)) for tie in ties(strain, layout)]

    def _forces(self, q: Expr) -> Expr:
        """Forces that a state has, shape (15,)."""
        return self._section.forces(self._layout, q)

    def _stresses(self, psi: Energy, start: Expr, e: StrainPath, exact: bool) -> tuple[Expr, Expr]:
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
