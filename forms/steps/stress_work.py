"""Virtual work of a linear section in mixed form, eqs. (20)-(22), (32) and (Q2), (Q3)."""

from collections.abc import Sequence

import ufl
from ufl.core.expr import Expr

from shellmb.forms.measure import Acting, at_middle
from shellmb.forms.steps.general_strains import StrainPath
from shellmb.forms.steps.mixed import Interval, MixedStrains
from shellmb.forms.steps.path import Path, Stress, across, slope_at


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
    section, layout, strain = of
    e = end = strain.value(span.b)
    N = last = of.forces(span.unknown)
    if span.a is not span.b:
        # linear: the average of the stresses is the stress of the averages
        e, N = section.averages(strain, layout, span)
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
