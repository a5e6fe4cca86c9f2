"""Internal virtual work of shells of any strain energy density, with assumed strains, eq. (21).

As in `forms.steps.mixed`; the assumed strains stand for those of the reduced part.
"""

from collections.abc import Callable
from dataclasses import dataclass

import ufl
from ufl.core.expr import Expr

from shellmb.forms.measure import Acting, Measure, at_middle
from shellmb.forms.shell import ShellStrains
from shellmb.forms.state import Layout
from shellmb.forms.steps.discrete import discrete_gradient, gradient
from shellmb.forms.steps.mixed import Density, Interval, bending, membrane_shear, split


def assumed(strain: Measure, layout: Layout) -> Measure:
    """Strains with (eps, gam) replaced by the assumed ones, shape (8,)."""

    def join(S: Expr, e: Expr) -> Expr:
        kap = bending(e)
        return ufl.as_vector([S[0], S[1], S[2], kap[0], kap[1], kap[2], S[3], S[4]])

    return strain.beside(lambda q: layout.resultants(q, "S"), join)


@dataclass(frozen=True)
class NonlinearMixed:
    """Hu-Washizu form for any strain energy density `psi(strains)`, eq. (21).

    The assumed strains `S` stand for (eps, gam) in the reduced part, the resultants `N` tie them
    to the
    displacements. `N` is the average stress of the sub-interval, so it needs no value of its own
    at the start.

    Args:
        psi: Strain energy per area as a function of `ShellStrains`, J/m^2.
        N0: Scale of the resultants, N/m.
        a: Fully integrated fraction per element.
        thickness: Length that makes curvatures comparable with strains, m.
        a_shear: Fraction for the energy of shear alone, where that has its own.
    """

    psi: Callable[[ShellStrains], Expr]
    N0: Expr
    a: Expr
    thickness: Expr
    a_shear: Expr | None = None

    @property
    def densities(self) -> tuple[Callable[[Expr], Expr], Callable[[Expr], Expr]]:
        """Energies of the full and of the reduced rule as functions of the strains, shape (8,)."""
        return self._psi_full, self._psi_red

    def energy_density(self, e: Expr) -> Expr:
        """Energy of strains, shape (8,), as the user wrote it."""
        return self._psi(e)

    def stress(self, e: Expr) -> Expr:
        """Resultants of strains, shape (8,) both."""
        return gradient(self._psi, e)

    def _psi(self, e: Expr) -> Expr:
        eps, gam = split(membrane_shear(e))
        return self.psi(ShellStrains(eps, bending(e), gam))

    def _pure_bending(self, e: Expr) -> Expr:
        zero = 0 * e[0]
        return self._psi(ufl.as_vector([zero, zero, zero, e[3], e[4], e[5], zero, zero]))

    def _sheared(self, e: Expr) -> Expr:
        """Energy of shear alone that the full rule has beyond `a`, and the reduced one lacks."""
        zero = 0 * e[0]
        if self.a_shear is None:
            return zero
        return (self.a_shear - self.a) * self._psi(ufl.as_vector([*(zero,) * 6, e[6], e[7]]))

    def _psi_full(self, e: Expr) -> Expr:
        return self.a * self._psi(e) + (1 - self.a) * self._pure_bending(e) + self._sheared(e)

    def _psi_red(self, e: Expr) -> Expr:
        return (1 - self.a) * (self._psi(e) - self._pure_bending(e)) - self._sheared(e)

    def _average(self, psi: Callable[[Expr], Expr], a: Expr, b: Expr, beta: Expr | float) -> Expr:
        if a is b:
            return gradient(psi, a)
        h = self.thickness
        one = h / h
        weight = ufl.as_vector([one, one, one, h, h, h, one, one])
        jump = (gradient(psi, b) - gradient(psi, a)) / 2
        return discrete_gradient(psi, a, b, weight) + beta * jump

    def virtual_work(
        self,
        strain: Measure,
        layout: Layout,
        span: Interval,
        dq: Expr,
        acting: Acting = at_middle,
    ) -> Density:
        """Virtual work, stress equation (test `S`) and compatibility `s(q) = S` (test `N`)."""
        e, s = strain.value, assumed(strain, layout).value
        static = span.a is span.b
        e_a, s_a = e(span.a), s(span.a)
        e_b, s_b = (e_a, s_a) if static else (e(span.b), s(span.b))
        full = self._average(self._psi_full, e_a, e_b, span.beta)
        red = self._average(self._psi_red, s_a, s_b, span.beta)
        work = acting(strain, span.a, span.b, span.mid, dq)
        N = (1 - self.a) * self.N0 * layout.resultants(span.unknown)
        dN = (1 - self.a) * self.N0 * layout.resultants(dq)
        dS = layout.resultants(dq, "S")
        gap = membrane_shear(e(span.at)) - layout.resultants(span.at, "S")
        n, Q = split(N)
        on_strains = ufl.as_vector([*n, *bending(red), *Q])
        reduced = work(on_strains) + ufl.dot(membrane_shear(red) - N, dS) + ufl.dot(dN, gap)
        return work(full), reduced

    def energy(self, strain: Measure, layout: Layout, q: Expr) -> Density:
        """Strain energy, its reduced part at the assumed strains."""
        return (
            self._psi_full(strain.value(q)),
            self._psi_red(assumed(strain, layout).value(q)),
        )

    def jump(self, strain: Measure, layout: Layout, a: Expr, b: Expr) -> Density:
        """Half the work of the stress jump on the strain jump (eq. 34 for any material)."""
        parts = ((self._psi_full, strain), (self._psi_red, assumed(strain, layout)))
        pairs = [(psi, measure.value(a), measure.value(b)) for psi, measure in parts]
        full, red = (
            ufl.dot(gradient(psi, q1) - gradient(psi, q0), q1 - q0) / 2 for psi, q0, q1 in pairs
        )
        return full, red

    def resultants(self, strain: Measure, layout: Layout, q: Expr) -> Expr:
        """Resultants N/m and moments N of a state, accurate at the points of the reduced rule."""
        return self.stress(assumed(strain, layout).value(q))

    def averaged(self, strain: Measure, layout: Layout, span: Interval) -> Expr:
        """Resultants of the averaged stress of a sub-interval, the discrete gradient."""
        s = assumed(strain, layout).value
        first = s(span.a)
        last = first if span.a is span.b else s(span.b)
        return self._average(self._psi, first, last, span.beta)
