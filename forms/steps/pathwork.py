"""Virtual work of a linear section in mixed form, eqs. (20)-(22), (32) and (Q2), (Q3)."""

from collections.abc import Callable, Sequence
from typing import Protocol

import ufl
from ufl.core.expr import Expr

from shellmb.forms.state import Layout
from shellmb.forms.steps.discrete import stress_average, variation
from shellmb.forms.steps.mixed import Interval
from shellmb.forms.steps.path import Change, Measure, Pair


class MixedSection(Protocol):
    """A linear section in mixed form: stresses from strains and independent resultants."""

    def forces(self, layout: Layout, q: Expr) -> Expr:
        """The resultants that a state holds."""
        ...

    def where_held(self, there: Expr, elsewhere: Expr) -> Expr:
        """Components of `there` where strains are held, of `elsewhere` where not."""
        ...

    def stress(self, e: Expr, N: Expr) -> tuple[Expr, ...]:
        """What acts on the strains, for each quadrature rule; linear in both."""
        ...

    def gap(self, mean: Expr, end: Expr, N: Expr) -> Expr:
        """Strains less those that belong to the resultants, weighed, in the last rule.

        Those of the mean where strains are held, of the end elsewhere.
        """
        ...


def pair_work(
    section: MixedSection,
    layout: Layout,
    strain: Measure,
    states: Sequence[Expr],
    pair: Pair,
    dq: Expr,
) -> list[Expr]:
    """Densities of the work of a stress, with its compatibility, one for each quadrature rule."""
    x, D, *_ = states
    e, N = strain.moment(pair.moment, states), section.forces(layout, pair.moment.held)
    de, end = strain.at(pair.slope, states, dq), e + pair.ahead * strain.slope(1, ((1, x),), D)
    found = [ufl.dot(s, de) for s in section.stress(e, _mean(section, layout, states, pair))]
    found[-1] += pair.own * ufl.dot(section.forces(layout, dq), section.gap(e, end, N))
    return found


def pair_change(
    section: MixedSection,
    layout: Layout,
    strain: Measure,
    states: Sequence[Expr],
    pair: Pair,
    change: Change,
    dq: Expr,
    trial: Expr,
) -> list[Expr]:
    """Derivative of `pair_work` in the direction `trial` of an unknown state."""
    e, N = strain.moment(pair.moment, states), _mean(section, layout, states, pair)
    moved = strain.at(change.moment, states, trial)
    new = section.forces(layout, trial)
    added = section.where_held(change.held * new, change.share * new)
    de, turned = strain.at(pair.slope, states, dq), strain.quad(trial, dq)
    found = [
        ufl.dot(s, de) + change.turn * ufl.dot(old, turned)
        for s, old in zip(section.stress(moved, added), section.stress(e, N), strict=True)
    ]
    gap = section.gap(moved, change.gain * moved, change.held * new)
    found[-1] += pair.own * ufl.dot(section.forces(layout, dq), gap)
    return found


def _mean(section: MixedSection, layout: Layout, states: Sequence[Expr], pair: Pair) -> Expr:
    """Resultants of a moment."""
    N, chord = (section.forces(layout, q) for q in (pair.moment.held, states[1]))
    return section.where_held(N, N - pair.ahead * chord)


def interval_work(
    section: MixedSection,
    layout: Layout,
    strains: Callable[[Expr], Expr],
    span: Interval,
    dq: Expr,
) -> list[Expr]:
    """The same over a sub-interval, for any strains: averaged stresses on the mid-point's strains.

    Stresses are averaged such that the work is the change of the energy, eqs. (20)-(22), (32).
    """
    e = end = strains(span.at)
    N = last = section.forces(layout, span.unknown)
    if span.a is not span.b:
        # linear: the average of the stresses is the stress of the averages
        e = stress_average(strains(span.a), strains(span.b), span.beta)
        mean = stress_average(section.forces(layout, span.a), last, span.beta)
        N = section.where_held(last, mean)
    de = variation(strains, span.mid, dq)
    found = [ufl.dot(s, de) for s in section.stress(e, N)]
    found[-1] += ufl.dot(section.forces(layout, dq), section.gap(e, end, last))
    return found
