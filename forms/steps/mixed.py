"""Internal virtual work of the shell with mixed resultants (no locking, large Newton steps).

Membrane and transverse shear energy are written with independent, element-wise discontinuous
resultants `N = (N11, N22, N12, Q1, Q2)` and integrated with a reduced rule; a fraction `a` of them
and
all of the bending energy is fully integrated (partial selective reduced integration, D. N. Arnold
and F. Brezzi, Math. Comp. 66 (1997) 1-14):

    W = 1/2 kap.D.kap dx + a psi(eps, gam) dx + (1 - a) [N.s - psi*(N)] dx_red,   s = (eps, gam)

Every function returns a pair of densities, for the full and for the reduced rule, per reference
area.
For a pair of states the stress is averaged and the strain variation is taken at the mid-point, so
that the work over the sub-interval is the change of the energy (eqs. 20-22, 32).

============  =====================================================  =============
symbol        name                                                   unit
============  =====================================================  =============
`A, B, D, G`  membrane, coupling, bending, shear stiffness           N/m, N, N m, N/m
`N0`          scale of the resultants                                N/m
`a`           fully integrated fraction, per element                 -
============  =====================================================  =============
"""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import ufl
from ufl.core.expr import Expr

from shellmb.forms.measure import Measure
from shellmb.forms.shell import ShellStrains
from shellmb.forms.state import Layout
from shellmb.forms.steps.discrete import stress_average

Density = tuple[Expr, Expr]


class Interval(NamedTuple):
    """A sub-interval of a time step, or a single state (`a` is `b`) in statics.

    Args:
        a: State at its start.
        b: State at its end.
        mid: Configuration at which forces act (the mean of `a` and `b`).
        at: State at which compatibility holds, and constraints if there is no `end` (`b`).
        unknown: State that carries the multipliers of the sub-interval (`b`).
        beta: Share of the stress jump, eq. (32).
        end: State at which constraints hold; None: `at`.
    """

    a: Expr
    b: Expr
    mid: Expr
    at: Expr
    unknown: Expr
    beta: Expr | float
    end: Expr | None = None

    @property
    def holding(self) -> Expr:
        """State at which constraints hold."""
        return self.at if self.end is None else self.end


class Formulation(Protocol):
    """Strain energy of a section; its virtual work is in `forms.steps.stress_work`."""

    def energy(self, strain: Measure, layout: Layout, q: Expr) -> Density:
        """Strain energy of the state `q` per area."""
        ...

    def jump(self, strain: Measure, layout: Layout, a: Expr, b: Expr) -> Density:
        """Half the work of the stress jump on the strain jump, elastic part of eq. (34)."""
        ...

    def resultants(self, strain: Measure, layout: Layout, q: Expr) -> Expr:
        """Membrane forces, bending moments and shear forces (11, 22, 12; 13, 23), shape (8,)."""
        ...

    def averaged(self, strain: Measure, layout: Layout, span: Interval) -> Expr:
        """Resultants of the averaged stress of a sub-interval, the one that acts in its row."""
        ...


def vector(strains: ShellStrains) -> Expr:
    """All strains as one vector (eps, kap, gam), shape (8,)."""
    return ufl.as_vector([*strains.eps, *strains.kap, *strains.gam])


def membrane_shear(e: Expr) -> Expr:
    """The strains conjugate to the resultants, (eps, gam), shape (5,)."""
    return ufl.as_vector([e[k] for k in (0, 1, 2, 6, 7)])


def bending(e: Expr) -> Expr:
    """The bending strains, shape (3,)."""
    return ufl.as_vector([e[k] for k in (3, 4, 5)])


def split(N: Expr) -> tuple[Expr, Expr]:
    """Membrane and shear part of a vector of resultants."""
    return ufl.as_vector([N[0], N[1], N[2]]), ufl.as_vector([N[3], N[4]])


@dataclass(frozen=True)
class LinearMixed:
    """Hellinger-Reissner form of a linear section, resultants in closed form.

    `A_inv` and `G_inv` are the inverses of `A` and `G`. Without bending-stretching coupling `B` is
    None and none of its terms exists. Without transverse shear `G_inv` is None and the shear forces
    are multipliers that hold `gam` at zero (Kirchhoff's limit); so are the membrane forces for
    `eps` where `A_inv` is None. Multipliers are those of the sub-interval and not of its end: for
    them compatibility is that of the averaged strains. `slack`, m/N, is a compliance by which they
    are unique where constraints imply others, and with it the energy law is exact. What is left of
    `A` and `G` is the share `a` that keeps hourglass modes down; `a_shear`, where `G` has its
    own.
    """

    A: Expr
    D: Expr
    G: Expr
    A_inv: Expr | None
    G_inv: Expr | None
    N0: Expr
    a: Expr
    B: Expr | None = None
    slack: Expr | None = None
    a_shear: Expr | None = None

    @property
    def shear_share(self) -> Expr:
        """Share of the transverse shear that is fully integrated."""
        return self.a if self.a_shear is None else self.a_shear

    def _forces(self, e: Expr, N: Expr) -> tuple[Expr, Expr]:
        """Generalised stresses conjugate to the strains: full rule (8,) and reduced rule (8,)."""
        eps, gam = split(membrane_shear(e))
        kap = bending(e)
        n, Q = split(N)
        n_full, m_full, m_red = self.A * eps, self.D * kap, 0 * kap
        if self.B is not None:
            n_full = n_full + self.B * kap
            m_full = m_full + self.a * self.B * eps
            m_red = self.B * (self.A_inv * (n - self.B * kap))
        shear = self.shear_share
        full = [*(self.a * n_full), *m_full, *(shear * (self.G * gam))]
        red = [*((1 - self.a) * n), *((1 - self.a) * m_red), *((1 - shear) * Q)]
        return ufl.as_vector(full), ufl.as_vector(red)

    def _compliance(self, e: Expr, N: Expr) -> Expr:
        """Strains (eps, gam) that belong to the resultants, shape (5,)."""
        n, Q = split(N)
        if self.B is not None:
            n = n - self.B * bending(e)
        stretch = self.slack * n if self.A_inv is None else self.A_inv * n
        shear = self.slack * Q if self.G_inv is None else self.G_inv * Q
        return ufl.as_vector([*stretch, *shear])

    def forces(self, layout: Layout, q: Expr) -> Expr:
        """Membrane and shear forces that a state holds, shape (5,), N/m."""
        return self.N0 * layout.resultants(q)

    def compatible(self, e: Expr) -> Expr:
        """Resultants of strains without transverse shear, shape (5,), N/m."""
        n = 0 * ufl.as_vector([e[0], e[1], e[2]])
        if self.A_inv is not None:
            # by the inverse, which is known at the points of the reduced rule
            n = ufl.inv(self.A_inv) * ufl.as_vector([e[0], e[1], e[2]])
        if self.B is not None:
            n = n + self.B * bending(e)
        return ufl.as_vector([*n, 0.0, 0.0])

    def stress(self, e: Expr, N: Expr) -> tuple[Expr, ...]:
        """Generalised stresses for the full and the reduced rule, shape (8,) each."""
        return self._forces(e, N)

    def gap(self, mean: Expr, end: Expr, N: Expr) -> Expr:
        """Strains less those of the resultants, in the reduced rule, shape (5,).

        Those of the end, where strains are held those of the mean.
        """
        s = self.where_held(membrane_shear(mean), membrane_shear(end))
        return self._reduced(s - self._compliance(end, N))

    def _reduced(self, found: Expr) -> Expr:
        """Strains or forces, shape (5,), by what is left of them in the reduced rule."""
        n, Q = split(found)
        return ufl.as_vector([*((1 - self.a) * n), *((1 - self.shear_share) * Q)])

    def where_held(self, there: Expr, elsewhere: Expr) -> Expr:
        """Components of `there` for constrained strains, of `elsewhere` for others, shape (5,)."""
        which = (self.A_inv is None,) * 3 + (self.G_inv is None,) * 2
        if not any(which):
            return elsewhere
        return ufl.as_vector([there[k] if which[k] else elsewhere[k] for k in range(5)])

    def _at_state(self, e: Expr, N: Expr) -> Expr:
        """Resultants of a state: multipliers from its strains, shape (5,)."""
        return N if self.slack is None else self.where_held(membrane_shear(e) / self.slack, N)

    def energy(self, strain: Measure, layout: Layout, q: Expr) -> Density:
        """Mixed strain energy `W(q, N)`; equal to the strain energy where compatibility holds."""
        return self.stored(strain.value(q), self.forces(layout, q))

    def stored(self, e: Expr, N: Expr) -> Density:
        """Stored energy of any strains, shape (8,), and resultants, shape (5,)."""
        N = self._at_state(e, N)
        full, _ = self._forces(e, N)
        s = membrane_shear(e)
        n, Q = split(N)
        if self.B is not None:
            n = n - self.B * bending(e)
        stretch = self.slack * n if self.A_inv is None else self.A_inv * n
        shear = self.slack * Q if self.G_inv is None else self.G_inv * Q
        left = ufl.as_vector([*n, *Q]), ufl.as_vector([*stretch, *shear])
        complementary = ufl.dot(self._reduced(left[0]), left[1])
        return ufl.dot(full, e) / 2, ufl.dot(self._reduced(N), s) - complementary / 2

    def resultants(self, strain: Measure, layout: Layout, q: Expr) -> Expr:
        """Resultants N/m and moments N of a state, accurate at the points of the reduced rule."""
        return self.joined(strain.value(q), self.forces(layout, q))

    def averaged(self, strain: Measure, layout: Layout, span: Interval) -> Expr:
        """Resultants of the averaged stress of a sub-interval, the one that acts in its row."""
        e = stress_average(strain.value(span.a), strain.value(span.b), span.beta)
        last = self.forces(layout, span.b)
        N = self.where_held(last, stress_average(self.forces(layout, span.a), last, span.beta))
        return self.joined(e, N)

    def joined(self, e: Expr, N: Expr) -> Expr:
        """All resultants of any strains, shape (8,), and resultants of its own, shape (5,)."""
        n, Q = split(N)
        kap = bending(e)
        m = self.D * kap
        if self.B is not None:
            m = m + self.B * (self.A_inv * (n - self.B * kap))
        return ufl.as_vector([*n, *m, *Q])

    def jump(self, strain: Measure, layout: Layout, a: Expr, b: Expr) -> Density:
        """Elastic part of `c^2`, eq. (34)."""
        de = strain.value(b) - strain.value(a)
        dN = self.forces(layout, b) - self.forces(layout, a)
        full, red = self._forces(de, self._at_state(de, dN))
        return ufl.dot(full, de) / 2, ufl.dot(red, de) / 2
