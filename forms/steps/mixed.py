"""Internal virtual work of the shell with forces of its own (no locking, large Newton steps).

Membrane and transverse shear energy are written with independent forces `N` of each cell, which
work on strains where these are taken (`forms.tying`); all of the bending energy, and on triangles a
fraction `a` of the shear energy, are those of the displacements (partial selective reduced
integration, D. N. Arnold and F. Brezzi, Math. Comp. 66 (1997) 1-14):

    W = 1/2 kap.D.kap + a/2 gam.G.gam + <N, eps> - 1/2 n.A^-1.n + (1 - a) [<N, gam> - 1/2 Q.G^-1.Q]

Every function returns densities per reference area, for the rule of the integrals and for those
that take strains. For a pair of states the stress is averaged and the strain variation is taken at
the mid-point, so that the work over the sub-interval is the change of the energy (eqs. 20-22, 32).

============  =====================================================  =============
symbol        name                                                   unit
============  =====================================================  =============
`A, B, D, G`  membrane, coupling, bending, shear stiffness           N/m, N, N m, N/m
`N0`          scale of the forces                                    N/m
`n, Q`        membrane and shear forces of a cell at a point         N/m
`a`           share of shear that displacements have, per element    -
============  =====================================================  =============
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import ufl
from ufl.core.expr import Expr

from shellmb.forms.measure import Measure
from shellmb.forms.shell import named
from shellmb.forms.state import Layout
from shellmb.forms.steps.discrete import stress_average
from shellmb.forms.tying import COUNT, Tying

Densities = Sequence[Expr]


class Interval(NamedTuple):
    """A sub-interval of a time step, or a single state (`a` is `b`) in statics.

    Args:
        a: State at its start.
        b: State at its end, where compatibility holds.
        mid: Configuration at which forces act (the mean of `a` and `b`).
        unknown: State that carries the multipliers of the sub-interval (`b`).
        beta: Share of the stress jump, eq. (32).
        end: State at which constraints hold; None: `b`.
    """

    a: Expr
    b: Expr
    mid: Expr
    unknown: Expr
    beta: Expr | float
    end: Expr | None = None

    @property
    def holding(self) -> Expr:
        """State at which constraints hold."""
        return self.b if self.end is None else self.end


class MixedSection:
    """A linear section in mixed form: stresses from strains and independent resultants.

    Here it has no resultants of its own; its virtual work is in `forms.steps.stress_work`.
    """

    def forces(self, layout: Layout, q: Expr) -> Expr:
        """The resultants that a state holds."""
        return ufl.as_vector([0, 0])

    def of_rate(self, layout: Layout, e: Expr, v: Expr) -> Expr:
        """Rates of the resultants, from those of strains and state."""
        return self.forces(layout, v)

    def where_held(self, there: Expr, elsewhere: Expr) -> Expr:
        """Components of `there` for strains that are constrained exactly, of `elsewhere` else."""
        return elsewhere

    def stress(self, e: Expr, N: Expr) -> tuple[Expr, ...]:
        """Stress conjugate to the strains, for each quadrature rule; linear in both."""
        raise NotImplementedError

    def gap(self, mean: Expr, end: Expr, N: Expr, dN: Expr) -> Densities:
        """Work of virtual resultants on strains less those of the resultants, for each rule.

        Strains of the mean where these are constrained, of the end elsewhere.
        """
        return [ufl.dot(dN, N)]

    def joined(self, e: Expr, N: Expr) -> Expr:
        """All resultants of any strains and resultants of a state."""
        return self.stress(e, N)[0]

    def stored(self, e: Expr, N: Expr) -> Densities:
        """Stored energy of any strains and resultants."""
        return [ufl.dot(stress, e) / 2 for stress in self.stress(e, N)]

    def energy(self, strain: Measure, layout: Layout, q: Expr) -> Densities:
        """Mixed strain energy `W(q, N)`; equal to the strain energy where compatibility holds."""
        return self.stored(strain.value(q), self.forces(layout, q))

    def jump(self, strain: Measure, layout: Layout, a: Expr, b: Expr) -> Densities:
        """Half the work of the stress jump on the strain jump, elastic part of eq. (34)."""
        de = strain.value(b) - strain.value(a)
        dN = self.forces(layout, b) - self.forces(layout, a)
        return [ufl.dot(stress, de) / 2 for stress in self.stress(de, dN)]

    def resultants(self, strain: Measure, layout: Layout, q: Expr) -> Expr:
        """Resultants N/m and moments N of a state, of a shell shape (8,)."""
        return self.joined(strain.value(q), self.forces(layout, q))

    def averages(self, strain: Measure, layout: Layout, span: Interval) -> tuple[Expr, Expr]:
        """Strains and resultants of the averaged stress of a sub-interval, that of its row."""
        last = self.forces(layout, span.b)
        N = self.where_held(last, stress_average(self.forces(layout, span.a), last, span.beta))
        return stress_average(strain.value(span.a), strain.value(span.b), span.beta), N

    def averaged(self, strain: Measure, layout: Layout, span: Interval) -> Expr:
        """Resultants of that stress."""
        return self.joined(*self.averages(strain, layout, span))


@dataclass(frozen=True)
class MixedStrains:
    """Strains with a section in mixed form: what densities of their work are made of.

    Args:
        section: The section.
        layout: Parts of the state.
        strain: The strains.
    """

    section: MixedSection
    layout: Layout
    strain: Measure

    def forces(self, q: Expr) -> Expr:
        """The resultants that a state holds."""
        return self.section.forces(self.layout, q)


@dataclass(frozen=True)
class Stiffness(MixedSection):
    """Stresses that are a matrix times strains.

    Args:
        C: The matrix, shape (n, n).
    """

    C: Expr

    def stress(self, e: Expr, N: Expr | None = None) -> tuple[Expr, ...]:
        """Stresses, shape (n,)."""
        return (self.C * e,)


def membrane_shear(e: Expr) -> Expr:
    """The strains conjugate to the resultants, (eps, gam), shape (5,)."""
    return ufl.as_vector([e[k] for k in (0, 1, 2, 6, 7)])


def split(N: Expr) -> tuple[Expr, Expr]:
    """Membrane and shear part of a vector of resultants."""
    return ufl.as_vector([N[0], N[1], N[2]]), ufl.as_vector([N[3], N[4]])


def assumed(strain: Measure, layout: Layout) -> Measure:
    """Strains with (eps, gam) replaced by the cells' own ones, shape (8,)."""

    def join(S: Expr, e: Expr) -> Expr:
        kap, own = named(e).kap, layout.tying.strain(S)
        return ufl.as_vector([own[0], own[1], own[2], kap[0], kap[1], kap[2], own[3], own[4]])

    return strain.beside(lambda q: layout.forces(q, "S"), join)


@dataclass(frozen=True)
class LinearMixed(MixedSection):
    """Hellinger-Reissner form of a linear section of quadrilaterals, forces in closed form.

    Without bending-stretching coupling `B` is None and none of its terms exists.

    Args:
        D: Bending stiffness.
        A_inv: Inverse of the membrane stiffness.
        G_inv: Inverse of the shear stiffness.
        N0: Scale of the forces.
        tying: Maps of the forces.
        B: Coupling.
    """

    D: Expr
    A_inv: Expr
    G_inv: Expr
    N0: Expr
    tying: Tying
    B: Expr | None = None

    def forces(self, layout: Layout, q: Expr) -> Expr:
        """Forces of the cells that a state has, shape (15,), N/m."""
        return self.N0 * layout.forces(q)

    def stretch(self, n: Expr, e: Expr) -> Expr:
        """Membrane strain that forces and curvatures belong to, shape (3,)."""
        return self.A_inv * (n if self.B is None else n - self.B * named(e).kap)

    def _moments(self, n: Expr, e: Expr) -> Expr:
        """Moments of membrane forces and curvatures, shape (3,)."""
        m = self.D * named(e).kap
        return m if self.B is None else m + self.B * self.stretch(n, e)

    def stress(self, e: Expr, N: Expr) -> tuple[Expr, ...]:
        """Generalised stresses by rule, shape (8,) each; linear in strains and forces."""
        tying, (n, _) = self.tying, split(self.tying.force(N))
        return ufl.as_vector([*tying.whole(N), *self._moments(n, e), 0, 0]), *tying.works(N)

    def gap(self, mean: Expr, end: Expr, N: Expr, dN: Expr) -> list[Expr]:
        """Work of virtual forces on the strains at the end less those of the forces, by rule."""
        (n, Q), (dn, dQ) = (split(self.tying.force(f)) for f in (N, dN))
        own = ufl.dot(dn, self.stretch(n, end)) + ufl.dot(dQ, self.G_inv * Q)
        whole = ufl.dot(self.tying.whole(dN), named(end).eps) - own
        return [whole, *(ufl.dot(stress, end) for stress in self.tying.works(dN))]

    def stored(self, e: Expr, N: Expr) -> Densities:
        """Stored energy of any strains, shape (8,), and forces of the cells."""
        (n, Q), (eps, kap, _) = split(self.tying.force(N)), named(e)
        stretch = self.stretch(n, e)
        own = n if self.B is None else n - self.B * kap
        whole = [
            ufl.dot(kap, self.D * kap) / 2,
            ufl.dot(self.tying.whole(N), eps),
            -ufl.dot(own, stretch) / 2,
            -ufl.dot(Q, self.G_inv * Q) / 2,
        ]
        return [sum(whole), *(ufl.dot(stress, e) for stress in self.tying.works(N))]

    def joined(self, e: Expr, N: Expr) -> Expr:
        """All resultants of any strains, shape (8,), and forces of the cells."""
        n, Q = split(self.tying.force(N))
        return ufl.as_vector([*n, *self._moments(n, e), *Q])


@dataclass(frozen=True)
class LinearOwn(MixedSection):
    """Hu-Washizu form of a linear section: cells have strains of their own beside the forces.

    They are in the space of the strains, where forces by themselves would be in that of the forces:
    on curved triangles that is too soft. Strains that are constrained have a stiffness by which
    forces are unique where constraints imply others.

    Args:
        A: Membrane stiffness.
        D: Bending stiffness.
        G: Shear stiffness.
        N0: Scale of the forces.
        a: Share of the shear energy that displacements have.
        shared: Shear stiffness in that share, that of the section even where shear is constrained.
        tying: Maps of the forces.
        B: Coupling; None: none.
    """

    A: Expr
    D: Expr
    G: Expr
    N0: Expr
    a: Expr
    shared: Expr
    tying: Tying
    B: Expr | None = None

    def forces(self, layout: Layout, q: Expr) -> Expr:
        """Strains and forces of the cells that a state has, shape (30,)."""
        return ufl.as_vector([*layout.forces(q, "S"), *(self.N0 * layout.forces(q))])

    def _parts(self, both: Expr) -> tuple[Expr, Expr]:
        """Strains and forces of the cells."""
        S, N = (ufl.as_vector([both[first + k] for k in range(COUNT)]) for first in (0, COUNT))
        return S, N

    def stresses(self, S: Expr, e: Expr) -> tuple[Expr, Expr, Expr]:
        """Membrane forces, moments and shear forces of strains of the cells and curvatures."""
        (eps, gam), kap = split(self.tying.strain(S)), named(e).kap
        n, m = self.A * eps, self.D * kap
        if self.B is not None:
            n, m = n + self.B * kap, m + self.B * eps
        return n, m, self.G * gam

    def shared_shear(self, gam: Expr) -> Expr:
        """Shear forces of the share that displacements have, shape (2,)."""
        return self.a * (self.shared * gam)

    def stress(self, e: Expr, N: Expr) -> tuple[Expr, ...]:
        """Generalised stresses by rule, shape (8,) each; linear in strains and forces."""
        tying, (S, F) = self.tying, self._parts(N)
        _, m, _ = self.stresses(S, e)
        shared = self.shared_shear(named(e).gam)
        return ufl.as_vector([*tying.whole(F), *m, *shared]), *tying.works(F)

    def gap(self, mean: Expr, end: Expr, N: Expr, dN: Expr) -> list[Expr]:
        """Work of virtual forces and strains on what strains and forces differ by, by rule."""
        tying, (S, F), (dS, dF) = self.tying, self._parts(N), self._parts(dN)
        n, _, Q = self.stresses(S, end)
        lacking = ufl.as_vector([*n, *((1 - self.a) * Q)]) - tying.force(F)
        whole = [
            ufl.dot(tying.whole(dF), named(end).eps),
            -ufl.dot(tying.force(dF), tying.strain(S)),
            ufl.dot(tying.strain(dS), lacking),
        ]
        return [sum(whole), *(ufl.dot(works, end) for works in tying.works(dF))]

    def stored(self, e: Expr, N: Expr) -> Densities:
        """Energy of any strains, and of strains of the cells."""
        S, _ = self._parts(N)
        (n, m, Q), (eps, gam) = self.stresses(S, e), split(self.tying.strain(S))
        _, kap, moved = named(e)
        shear = (1 - self.a) * ufl.dot(Q, gam) + ufl.dot(self.shared_shear(moved), moved)
        return [(ufl.dot(n, eps) + ufl.dot(m, kap) + shear) / 2]

    def joined(self, e: Expr, N: Expr) -> Expr:
        """All resultants, shape (8,)."""
        n, m, Q = self.stresses(self._parts(N)[0], e)
        return ufl.as_vector([*n, *m, *((1 - self.a) * Q + self.shared_shear(named(e).gam))])

    def jump(self, strain: Measure, layout: Layout, a: Expr, b: Expr) -> Densities:
        """Elastic part of `c^2`, eq. (34)."""
        change = self.forces(layout, b) - self.forces(layout, a)
        return self.stored(strain.value(b) - strain.value(a), change)
