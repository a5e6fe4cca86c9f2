"""Virtual work of a linear section in mixed form, eqs. (20)-(22), (32) and (Q2), (Q3)."""

from collections.abc import Sequence
from typing import Protocol

import ufl
from ufl.core.expr import Expr

from shellmb.forms.measure import Acting, Measure, at_middle
from shellmb.forms.state import Layout
from shellmb.forms.steps.discrete import stress_average
from shellmb.forms.steps.general_strains import GeneralRow, GeneralStrain
from shellmb.forms.steps.mixed import Interval
from shellmb.forms.steps.path import Stress, across, slope_at


class MixedSection(Protocol):
    """A linear section in mixed form: stresses from strains and independent resultants."""

    def forces(self, layout: Layout, q: Expr) -> Expr:
        """The resultants that a state holds."""
        ...

    def where_held(self, there: Expr, elsewhere: Expr) -> Expr:
        """Components of `there` for constrained strains, of `elsewhere` for others."""
        ...

    def stress(self, e: Expr, N: Expr) -> tuple[Expr, ...]:
        """Stress conjugate to the strains, for each quadrature rule; linear in both."""
        ...

    def gap(self, mean: Expr, end: Expr, N: Expr, dN: Expr) -> Sequence[Expr]:
        """Work of virtual resultants on strains less those of the resultants, for each rule.

        Strains of the mean where these are constrained, of the end elsewhere.
        """
        ...


def stress_work(
    section: MixedSection,
    layout: Layout,
    strain: Measure,
    states: Sequence[Expr],
    stress: Stress,
    e: Expr,
    tests: Sequence[Expr],
) -> list[Expr]:
    """Densities of the work of a stress, with its compatibility, one for each quadrature rule.

    Args:
        section: The section.
        layout: Parts of the state.
        strain: Its strains.
        states: Mean, chord, bow and mean velocity of the path, or the first few of them.
        stress: The stress.
        e: The strain that it is of, `moment_of` its moment.
        tests: Virtual displacement of each row.
    """
    N = section.forces(layout, stress.moment.held)
    de = across(strain, stress.slopes, states, tests)
    mean = _mean(section, layout, states, N, stress.ahead)
    found = [ufl.dot(s, de) for s in section.stress(e, mean)]
    if stress.own is not None:
        end = e
        if stress.ahead is not None:
            end = e + stress.ahead * slope_at(strain, stress.slopes[stress.own], states, states[1])
        found = added(found, section.gap(e, end, N, section.forces(layout, tests[stress.own])))
    return found


def added(a: Sequence[Expr], b: Sequence[Expr]) -> list[Expr]:
    """Sums of densities, rule by rule."""
    return [x + y for x, y in zip(a, b, strict=True)]


def _mean(
    section: MixedSection, layout: Layout, states: Sequence[Expr], N: Expr, ahead: Expr | None
) -> Expr:
    """Resultants of a moment."""
    if ahead is None:
        return N
    return section.where_held(N, N - ahead * section.forces(layout, states[1]))


def interval_work(
    section: MixedSection,
    layout: Layout,
    strain: Measure,
    span: Interval,
    dq: Expr,
    acting: Acting = at_middle,
) -> list[Expr]:
    """Work over a sub-interval, for any strains: averaged stresses on the mid-point's strains.

    Stresses are averaged such that the work is the change of the energy, eqs. (20)-(22), (32).
    """
    e = end = strain.value(span.at)
    N = last = section.forces(layout, span.unknown)
    if span.a is not span.b:
        # linear: the average of the stresses is the stress of the averages
        e = stress_average(strain.value(span.a), strain.value(span.b), span.beta)
        mean = stress_average(section.forces(layout, span.a), last, span.beta)
        N = section.where_held(last, mean)
    work = acting(strain, span.a, span.b, span.mid, dq)
    found = [work(s) for s in section.stress(e, N)]
    return added(found, section.gap(e, end, last, section.forces(layout, dq)))


def general_stresses(
    section: MixedSection, layout: Layout, strain: GeneralStrain, held: Sequence[Expr], alpha: Expr
) -> list[tuple[Expr, Expr]]:
    """Stresses `S_0`, `S_1` over a step for strains of any form, for each quadrature rule.

    Args:
        section: The section.
        layout: Parts of the state.
        strain: Its strain over the step.
        held: Unknown states that hold the resultants of the rows P0 and P1.
        alpha: Dissipation.
    """
    moments = strain.moments(alpha)
    found = [
        section.stress(e, section.forces(layout, q)) for e, q in zip(moments, held, strict=True)
    ]
    return list(zip(*found, strict=True))


def general_work(
    section: MixedSection,
    layout: Layout,
    strain: GeneralStrain,
    held: Sequence[Expr],
    alpha: Expr,
    row: GeneralRow,
    dq: Expr,
) -> list[Expr]:
    """Densities of a row's work with its compatibility, for strains of any form.

    One for each quadrature rule, without what Gauss' points lack.
    """
    stresses = general_stresses(section, layout, strain, held, alpha)
    found = [strain.work(pair, row, dq) for pair in stresses]
    own = list(zip(row.own, strain.moments(alpha), held, strict=True))
    e = sum(o * moment for o, moment, _ in own)
    N = sum(o * section.forces(layout, q) for o, _, q in own)
    return added(found, section.gap(e, e, N, section.forces(layout, dq)))
