"""Internal virtual work of shells of any strain energy density, with assumed strains, eq. (21).

As in `forms.steps.mixed`; cells have strains of their own beside the forces, which tie these to the
strains of the displacements.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import ufl
from ufl.core.expr import Expr

from shellmb.forms.measure import Acting, Measure, at_middle
from shellmb.forms.shell import ShellStrains
from shellmb.forms.state import Layout
from shellmb.forms.steps.discrete import TINY_INCREMENT, discrete_gradient, gradient
from shellmb.forms.steps.mixed import (
    Densities,
    Interval,
    assumed,
    bending,
    membrane_shear,
    split,
)
from shellmb.forms.steps.stress_work import added

type Energy = Callable[[Expr], Expr]

# squares, relative to that of the strain: what is lacked by less is 1e-12 of the energy, and
# round-off of the energy over such a step 1e-10 of the stress; and one that is no strain
ROUND_OFF, NOTHING = 1e-12, 1e-40


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
    tying = layout.cells

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

    @property
    def densities(self) -> tuple[Callable[[Expr], Expr], Callable[[Expr], Expr]]:
        """Energies of the displacements' strains and of the cells' own ones, shape (8,) both."""
        return self._sheared, self._psi_own

    def energy_density(self, e: Expr) -> Expr:
        """Energy of strains, shape (8,), as the user wrote it."""
        return self._psi(e)

    def stress(self, e: Expr) -> Expr:
        """Resultants of strains, shape (8,) both."""
        return gradient(self._psi, e)

    def _psi(self, e: Expr) -> Expr:
        eps, gam = split(membrane_shear(e))
        return self.psi(ShellStrains(eps, bending(e), gam))

    def _sheared(self, e: Expr) -> Expr:
        """Energy of shear alone, by the share of the displacements."""
        zero = 0 * e[0]
        return self.a * self._psi(ufl.as_vector([*(zero,) * 6, e[6], e[7]]))

    def _psi_own(self, e: Expr) -> Expr:
        return self._psi(e) - self._sheared(e)

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
        self,
        strain: Measure,
        layout: Layout,
        span: Interval,
        dq: Expr,
        acting: Acting = at_middle,
    ) -> Densities:
        """Virtual work, stress equation (test `S`) and compatibility (test `N`)."""
        work, tying = acting(strain, span.a, span.b, span.mid, dq), layout.cells
        shared, stress = self._averages(strain, layout, span)
        N, dN = (self.forces(layout, q) for q in (span.unknown, dq))
        dS = tying.strain(layout.forces(dq, "S"))
        moments = ufl.as_vector([*tying.whole(N), *bending(stress), 0, 0])
        whole = work(shared + moments)
        whole += ufl.dot(membrane_shear(stress) - tying.force(N), dS)
        found = [whole, *map(work, tying.works(N))]
        return added(
            found, [ufl.dot(t.act(dN), t.measure.value(span.at)) for t in ties(strain, layout)]
        )

    def energy(self, strain: Measure, layout: Layout, q: Expr) -> Densities:
        """Strain energy, of the displacements' share of shear and of the cells' own strains."""
        return [self._sheared(strain.value(q)) + self._psi_own(assumed(strain, layout).value(q))]

    def jump(self, strain: Measure, layout: Layout, a: Expr, b: Expr) -> Densities:
        """Half the work of the stress jump on the strain jump (eq. 34 for any material)."""
        seen = self._seen(strain, layout)
        pairs = [(psi, measure.value(a), measure.value(b)) for psi, measure in seen]
        return [
            sum(
                ufl.dot(gradient(psi, q1) - gradient(psi, q0), q1 - q0) / 2 for psi, q0, q1 in pairs
            )
        ]

    def resultants(self, strain: Measure, layout: Layout, q: Expr) -> Expr:
        """Resultants N/m and moments N of a state, shape (8,)."""
        seen = self._seen(strain, layout)
        shared, own = (gradient(psi, measure.value(q)) for psi, measure in seen)
        return shared + own

    def averaged(self, strain: Measure, layout: Layout, span: Interval) -> Expr:
        """Resultants of the averaged stress of a sub-interval, the discrete gradient."""
        shared, own = self._averages(strain, layout, span)
        return shared + own

    def _averages(self, strain: Measure, layout: Layout, span: Interval) -> list[Expr]:
        """Averaged stresses of both energies."""
        found = []
        for psi, measure in self._seen(strain, layout):
            first = measure.value(span.a)
            last = first if span.a is span.b else measure.value(span.b)
            found.append(self._average(psi, first, last, span.beta))
        return found

    def _seen(self, strain: Measure, layout: Layout) -> Sequence[tuple[Energy, Measure]]:
        """Energies with the strains that they are of."""
        return list(zip(self.densities, (strain, assumed(strain, layout)), strict=True))
