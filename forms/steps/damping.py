"""Damping of Kelvin and Voigt, and relaxation: stresses by the rate of strains over a step.

As the stress (Q3) is linear over a step, the rate of a strain is projected on linear functions,

    h e'(tau) = (e_f - e_i) + 3 bow P1,     S^d = C^d e',     C^d = T^(1/2) C T^(1/2)           (D1)

with the damping times on the diagonal of `T`: positive semidefinite, whatever is coupled. It acts
as the stresses of the scheme do, and so takes of the energy

    work = -(1/h) [(e_f - e_i) . C^d (e_f - e_i) + 3 bow . C^d bow],                          (D2)

exactly, and of what moves without strains nothing. Rows see moments of the strain with other
weights, so the templates of `forms.steps.stress_work` serve. EP has no bow. ED is linear in both of
its sub-intervals; with `bow = e_i - e_j` its rows see

    f:  e_f - e_i,          j:  (e_f - e_i) + 3 (e_j - e_i)

which for linear strains is (D1) in ED's rows. Resultants of the mixed forms are those of states, so
their changes are stiffness times changes of the strains, as the elements see these: where an
element takes a mean of a strain, it damps the mean.

===========  ==========================================================  ==========
symbol       name                                                        unit
===========  ==========================================================  ==========
`T`          damping times of membrane, bending, shear; of a beam's six  s
`C^d`        stiffness times damping times                               N s/m, ...
===========  ==========================================================  ==========

Relaxation: generalised Maxwell branches over a step.

A branch is a spring of stiffness `C` in series with a dashpot. With the strain `V` of the dashpot
and that of the spring, `X = e - V`,

    S = C X,      tau V' = X                                                                    (V1)

`X` has over a step the mean and the first moment that the scheme takes of an elastic strain, with
its `alpha`, and (V1) holds for both:

    X_0 = (X_i + X_f - x)/2,   X_1 = (X_f - X_i)/2 + alpha x/2,   x = bow of X,                 (V2)
    V_f - V_i = (h/tau) X_0,   3 (bow of V) = (h/tau) X_1

so that with `r = h/tau` both follow from the start, and the change and the bow of the strain,

    [1 + r/2        -r/6   ] [X_0]   [X_i + (e_f - e_i - bow)/2   ]
    [  r/2     1 + alpha r/6] [X_1] = [(e_f - e_i + alpha bow)/2  ]                             (V3)

point by point: there are no unknowns. EP has neither bow nor second row. ED is linear in both of
its sub-intervals; with `bow = e_i - e_j` its rows see the stresses of `X_0` (f) and of `X_0 - X_1`
(j), which are (22) and (32). The stresses act as those of the scheme do, so that exactly

    S_0.(e_f - e_i) + S_1.bow = change of X.C X/2
                                 + r [X_0.C X_0 + X_1.C X_1/3] + alpha x.C x/2             (V4)

What the branch dissipates is never negative. At constant strain a step multiplies `X` by the
approximation of `exp(-r)` that the scheme has of linear systems: Pade's of order 2 in EP, of order
4 in ED without dissipation and in EP4, of order 3 with `alpha = 1`, there of zero limit.

===========  ==========================================================  ==========
symbol       name                                                        unit
===========  ==========================================================  ==========
`C`          stiffness of the branch                                     N/m, ...
`tau`        relaxation time                                             s
`X, V`       strains of its spring and of its dashpot                    -, 1/m
`X_0, X_1`   mean and first moment of `X` over the step                  -, 1/m
===========  ==========================================================  ==========
"""

from dataclasses import dataclass
from typing import NamedTuple

import ufl
from ufl.core.expr import Expr

from shellmb.forms.beam import BeamMixed, halves
from shellmb.forms.state import Layout
from shellmb.forms.steps.mixed import LinearMixed, LinearOwn, MixedSection, MixedStrains, Stiffness
from shellmb.forms.steps.path import Moment, Rows, moment_of


class Straining(NamedTuple):
    """Changes of strains over a step, in its rows.

    Args:
        rows: Moments of the rate, times the step, and what stresses act on.
        change: `e_f - e_i`, and the bow where there is one, for the work (D2).
        dt: Length of the step, s.
    """

    rows: Rows
    change: tuple[Moment, ...]
    dt: Expr


@dataclass(frozen=True)
class ViscousShell(MixedSection):
    """Damping of a linear section by the rules of `forms.steps.mixed`.

    Where it couples, bending and membrane strains have one time.

    Args:
        elastic: Its elastic form.
        membrane: Time of the membrane strains, s; None: zero; then no term is.
        bend: The same of bending.
        shear: The same of transverse shear.
    """

    elastic: LinearMixed | LinearOwn
    membrane: Expr | None
    bend: Expr | None
    shear: Expr | None

    def forces(self, layout: Layout, q: Expr) -> Expr:
        """Forces of the cells that a state has, perhaps behind their strains."""
        return self.elastic.forces(layout, q)

    def stress(self, e: Expr, N: Expr) -> tuple[Expr, ...]:
        """Stresses by rule, shape (8,) each: those of the section, times the times."""
        times = (*(self.membrane,) * 3, *(self.bend,) * 3, *(self.shear,) * 2)
        return tuple(
            ufl.as_vector([0 if time is None else time * s[k] for k, time in enumerate(times)])
            for s in self.elastic.stress(e, N)
        )


@dataclass(frozen=True)
class ViscousBeam(MixedSection):
    """Damping of a beam, of the strains at the centroid and of the curvatures.

    Args:
        elastic: Its elastic form.
        A: Stiffness of the forces, zero where strains are constrained, shape (3, 3), N.
        R: Damping forces by the forces of `A`, shape (3, 3), s.
        D0: Damping of the curvatures without force, shape (3, 3), N m^2 s.
    """

    elastic: BeamMixed
    A: Expr
    R: Expr
    D0: Expr

    def forces(self, layout: Layout, q: Expr) -> Expr:
        """Forces along the directors, shape (3,), N."""
        return self.elastic.forces(layout, q)

    def of_rate(self, layout: Layout, e: Expr, v: Expr) -> Expr:
        """Rates of the forces by those of the strains, shape (3,)."""
        Gamma, K = halves(e)
        H = self.elastic.H
        return self.A * (Gamma if H is None else Gamma + H * K)

    def stress(self, e: Expr, N: Expr) -> tuple[Expr, ...]:
        """Forces and moments, shape (6,)."""
        n, m, H = self.R * N, self.D0 * halves(e)[1], self.elastic.H
        if H is not None:
            m = m + ufl.transpose(H) * n
        return (ufl.as_vector([*n, *m]),)


def taken(of: MixedStrains, along: Straining) -> list[Expr]:
    """Densities of the work (D2) that damping takes, times the step; one for each rule."""
    states = along.rows.states[: along.rows.moving]
    found: list[Expr] = []
    for weight, moment in zip((1, 3), along.change, strict=False):
        e, N = moment_of(of.strain, moment, states), of.forces(moment.held)
        works = [weight * ufl.dot(s, e) for s in of.section.stress(e, N)]
        found = [a + b for a, b in zip(found, works, strict=True)] if found else works
    return found


def at_state(of: MixedStrains, q: Expr, v: Expr, dq: Expr) -> list[Expr]:
    """Densities of the virtual work at a state with a velocity, one for each rule.

    Args:
        of: The strains, with what resists.
        q: State.
        v: Velocity, with rates of forces of the cells of shells.
        dq: Virtual displacement.
    """
    rate, de = (of.strain.change(q, d) for d in (v, dq))
    N = of.section.of_rate(of.layout, rate, v)
    return [ufl.dot(s, de) for s in of.section.stress(rate, N)]


class Branch(Stiffness):
    """Stress of the springs of branches, of strains as they are or of those of the cells."""

    def matrix(self) -> Expr:
        """Stiffness as energy and modes have it, read off the stress: its rows in turn."""
        size = range(self.C.ufl_shape[0])
        columns = [self.stress(ufl.unit_vector(k, len(size)))[0] for k in size]
        return ufl.as_vector([column[i] for i in size for column in columns])
