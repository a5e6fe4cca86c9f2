"""Virtual work of stresses: of linear sections, eqs. (20)-(22), (32) and (Q2), (Q3), and of others.

Work of stresses on strains that are not quadratic in the unknowns, exact over a step.

Eq. (20), and (Q2) of `forms.steps.path`, need strains that are at most quadratic: only then is the
derivative at the middle times the chord the change of the strain. Strains of a user may be of any
form (stretches, logarithms). What their derivatives lack of that change is of higher order in the
step, and is made good; what is left of both is the same for quadratic strains.

Over a sub-interval (`exact_interval`) the stress `S` is changed along the change that the middle
sees, `c = De(q_m) D`,

    S' = S + S.(e_b - e_a - c) c/(c . c),   S'.c = S.(e_b - e_a),

of second order in the step. A strain that does not see rigid rotations is a function of the
quadratic ones: `c` vanishes only where its change does, and both momenta are kept.

Over a step that is quadratic in time (`GeneralStrain`) bow and ends of a strain are, with
`m = (q_i + q_f)/2` and `H = D^2 e(m)`,

    bow = [6 De(m) z + H(D, y)]/3,   <s> = (e_i + e_f - bow)/2,   S_0 = C <s>,
    S_1 = C (e_f - e_i + alpha bow)/2                                                          (Q3)

and the stresses act, at Gauss' two points `q_k` in time where `P1` is `p_k`, on

    P0:  S_0.[De(q_1) + De(q_2)] dq/2 + S_1.H(y, dq)/3 + S_0.delta (D . dq)/(D . D)
    P1:  S_0.[p_1 De(q_1) + p_2 De(q_2)] dq/2 + S_1.De(m) dq/3                                 (Q2)

The energy law (Q5) asks for the work `S_0.(e_f - e_i) + S_1.bow`: that of `S_1` is so by what the
bow is; that of `S_0` lacks `delta = e_f - e_i - [De(q_1) q'_1 + De(q_2) q'_2]/2`, of fifth order,
which acts along the chord of gradients and directors in a product `(a . b)` of these (after
O. Gonzalez, J. Nonlinear Sci. 6 (1996) 449-467): not along the chord of the strain, because that of
a stiff body that spins is zero. Where strains are functions of quadratic ones, stiff ones are the
same constraints on positions and velocities as these are. Derivatives leave `delta` out.

===========  =====================================================================  ====
symbol       name                                                                   eq.
===========  =====================================================================  ====
`c`          change of the strain as the derivative at the middle sees it           (20)
`delta`      what Gauss' points lack of the change of the strain                    (Q5)
===========  =====================================================================  ====
"""

from collections.abc import Callable, Sequence
from typing import Any

import ufl
from ufl.core.expr import Expr

from shellmb.forms.measure import Acting, Measure, Works, at_middle
from shellmb.forms.steps.discrete import second_variation
from shellmb.forms.steps.mixed import Interval, MixedStrains
from shellmb.forms.steps.path import Path, Step, Stress, across, moment_of, slope_at

# squares of changes, of strains and of gradients, below which round-off of strains, 1e-16, over
# them would be more than 1e-8 of a stress
TINY_STRAIN, TINY_CHORD = 1e-16, 1e-18


# Gauss' two points in time by the values of `P1` there; both weigh a half
POINTS = (-(3**-0.5), 3**-0.5)


def exact_interval(
    weight: Sequence[Any], strain: Measure, a: Expr, b: Expr, mid: Expr, dq: Expr
) -> Works:
    """Work of a stress from `a` to `b` on a virtual displacement, instead of `measure.at_middle`.

    Args:
        weight: Scales of the strains' squares, by which unlike units become comparable.
        strain: The strain.
        a: State at the start.
        b: State at the end.
        mid: Mean of both.
        dq: Virtual displacement.
    """
    de = strain.change(mid, dq)
    if a is b:
        return lambda stress: ufl.dot(stress, de)
    change, seen = strain.value(b) - strain.value(a), strain.change(mid, b - a)
    scaled = ufl.as_vector([w * s for w, s in zip(weight, seen, strict=True)])
    square = ufl.dot(scaled, seen)
    # falls off fast, so that it is not seen in the energy at steps that are small and no more
    along = ufl.dot(scaled, de) * square / (square**2 + TINY_STRAIN**2)
    return lambda stress: ufl.dot(stress, de) + ufl.dot(stress, change - seen) * along


class StrainPath:
    """A strain over a step that is quadratic in time: its ends, their difference, bow and mean.

    Args:
        strain: The strain.
        states: Mean, chord, bow and mean velocity of the path.
    """

    mean: Expr
    change: Expr
    bow: Expr

    def __init__(self, strain: Measure, states: Sequence[Expr]) -> None:
        self._strain, self._states, (x, D, z, _) = strain, states, states
        self._middle = m = x + z
        self.first, self.last = strain.value(m - D / 2), strain.value(m + D / 2)

    def moments(self, alpha: Expr | float = 0.0) -> tuple[Expr, Expr]:
        """Strains of which `S_0` and `S_1` are the stresses."""
        return self.mean, (self.change + alpha * self.bow) / 2

    def work(self, stresses: Sequence[Expr], k: int, dq: Expr, exact: bool = True) -> Expr:
        """Work of `S_0` and `S_1` in a row.

        Args:
            stresses: The stresses.
            k: Row: 0 is P0, 1 is P1.
            dq: Virtual displacement.
            exact: Whether `delta` is part of it.
        """
        raise NotImplementedError


class QuadraticStrain(StrainPath):
    """A strain that is quadratic in the state, by the numbers of the scheme.

    Args:
        strain: The strain.
        states: Mean, chord, bow and mean velocity of the path.
        step: The step.
    """

    def __init__(self, strain: Measure, states: Sequence[Expr], step: Step) -> None:
        super().__init__(strain, states)
        self._stresses = step.rows.stresses
        moments = self._stresses[0].moment, step.chord, step.bow
        self.mean, self.change, self.bow = (moment_of(strain, m, states) for m in moments)

    def work(self, stresses: Sequence[Expr], k: int, dq: Expr, exact: bool = True) -> Expr:
        """Work in a row; there is no `delta`."""
        pairs = zip(stresses, self._stresses, strict=True)
        return sum(
            ufl.dot(s, slope_at(self._strain, on.slopes[k], self._states, dq)) for s, on in pairs
        )


class GeneralStrain(StrainPath):
    """A strain of any form.

    Args:
        strain: The strain.
        states: Mean, chord, bow and mean velocity of the path.
        product: Product of two states, by their gradients and directors.
    """

    def __init__(
        self, strain: Measure, states: Sequence[Expr], product: Callable[[Expr, Expr], Expr]
    ) -> None:
        super().__init__(strain, states)
        self._product, (x, D, z, _) = product, states
        self._points = [(x + p / 2 * D, D + 6 * p * z) for p in POINTS]
        self.change = self.last - self.first
        self.bow = (strain.change(self._middle, 6 * z) + self._second(D)) / 3
        self.mean = (self.first + self.last - self.bow) / 2

    def _second(self, dq: Expr) -> Expr:
        """`H(y, dq)`."""
        return second_variation(self._strain.value, self._middle, self._states[3], dq)

    def work(self, stresses: Sequence[Expr], k: int, dq: Expr, exact: bool = True) -> Expr:
        """Work in a row."""
        change, shares, D = self._strain.change, POINTS if k else (1.0, 1.0), self._states[1]
        seen = sum(w / 2 * change(q, dq) for w, (q, _) in zip(shares, self._points, strict=True))
        turned = change(self._middle, dq) if k else self._second(dq)
        found = ufl.dot(stresses[0], seen) + ufl.dot(stresses[1], turned) / 3
        if k or not exact:
            return found
        lacking = self.change - sum(change(q, rate) for q, rate in self._points) / 2
        along = self._product(D, dq) / (self._product(D, D) + TINY_CHORD)
        return found + ufl.dot(stresses[0], lacking) * along


def stress_work(
    of: MixedStrains, states: Sequence[Expr], stress: Stress, e: Expr, tests: Sequence[Expr]
) -> list[Expr]:
    """Densities of the work of a stress, with its compatibility, one for each quadrature rule.

    Args:
        of: Strains with their section.
        states: Mean, chord, bow and mean velocity of the path, or the first few of them.
        stress: The stress.
        e: The strain that it is of, `moment_of` its moment.
        tests: Virtual displacement of each row.
    """
    section, strain, ahead = of.section, of.strain, stress.ahead
    N = mean = of.forces(stress.moment.held)
    de = across(strain, stress.slopes, states, tests)
    if ahead is not None:
        mean = section.where_held(N, N - ahead * of.forces(states[1]))
    found = [ufl.dot(s, de) for s in section.stress(e, mean)]
    if stress.own is not None:
        end = e
        if ahead is not None:
            end = e + ahead * slope_at(strain, stress.slopes[stress.own], states, states[1])
        found = added(found, section.gap(e, end, N, of.forces(tests[stress.own])))
    return found


def added(a: Sequence[Expr], b: Sequence[Expr]) -> list[Expr]:
    """Sums of densities, rule by rule."""
    return [x + y for x, y in zip(a, b, strict=True)]


def interval_work(
    of: MixedStrains, span: Interval, dq: Expr, acting: Acting = at_middle
) -> list[Expr]:
    """Work over a sub-interval, for any strains: averaged stresses on the mid-point's strains.

    Stresses are averaged such that the work is the change of the energy, eqs. (20)-(22), (32).
    """
    section, strain = of.section, of.strain
    e = end = strain.value(span.b)
    N = last = of.forces(span.unknown)
    if span.a is not span.b:
        # linear: the average of the stresses is the stress of the averages
        e, N = section.averages(strain, of.layout, span)
    work = acting(strain, span.a, span.b, span.mid, dq)
    found = [work(s) for s in section.stress(e, N)]
    return added(found, section.gap(e, end, last, of.forces(dq)))


def general_work(
    of: MixedStrains, along: StrainPath, path: Path, k: int, dq: Expr, exact: bool = True
) -> list[Expr]:
    """Densities of a row's work with its compatibility, for strains of any form.

    One for each quadrature rule.

    Args:
        of: Strains with their section.
        along: The strain over the step.
        path: The step, whose unknown states hold the resultants of the rows.
        k: Row: 0 is P0, 1 is P1.
        dq: Virtual displacement.
        exact: Whether what Gauss' points lack is part of it.
    """
    section, moments = of.section, along.moments(path.alpha)
    forces = [of.forces(q) for q in (path.end, path.end_velocity)]
    stresses = [section.stress(e, N) for e, N in zip(moments, forces, strict=True)]
    found = [along.work(pair, k, dq, exact) for pair in zip(*stresses, strict=True)]
    e, N = moments[k], forces[k]
    return added(found, section.gap(e, e, N, of.forces(dq)))
