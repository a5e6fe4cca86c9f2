"""Virtual work of a linear section in mixed form, eqs. (20)-(22), (32) and (Q2), (Q3)."""

from collections.abc import Sequence

import ufl
from ufl.core.expr import Expr

from shellmb.forms.measure import Acting, Measure, at_middle
from shellmb.forms.state import Layout
from shellmb.forms.steps.general_strains import StrainPath
from shellmb.forms.steps.mixed import Interval, MixedSection
from shellmb.forms.steps.path import Path, Stress, across, slope_at


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
    e = end = strain.value(span.b)
    N = last = section.forces(layout, span.unknown)
    if span.a is not span.b:
        # linear: the average of the stresses is the stress of the averages
        e, N = section.averages(strain, layout, span)
    work = acting(strain, span.a, span.b, span.mid, dq)
    found = [work(s) for s in section.stress(e, N)]
    return added(found, section.gap(e, end, last, section.forces(layout, dq)))


def general_work(
    section: MixedSection,
    layout: Layout,
    strain: StrainPath,
    path: Path,
    k: int,
    dq: Expr,
    exact: bool = True,
) -> list[Expr]:
    """Densities of a row's work with its compatibility, for strains of any form.

    One for each quadrature rule.

    Args:
        section: The section.
        layout: Parts of the state.
        strain: Its strain over the step.
        path: The step, whose unknown states hold the resultants of the rows.
        k: Row: 0 is P0, 1 is P1.
        dq: Virtual displacement.
        exact: Whether what Gauss' points lack is part of it.
    """
    moments = strain.moments(path.alpha)
    forces = [section.forces(layout, q) for q in (path.end, path.end_velocity)]
    stresses = [section.stress(e, N) for e, N in zip(moments, forces, strict=True)]
    found = [strain.work(pair, k, dq, exact) for pair in zip(*stresses, strict=True)]
    e, N = moments[k], forces[k]
    return added(found, section.gap(e, e, N, section.forces(layout, dq)))
