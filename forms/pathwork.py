"""Virtual work of a mixed section over a step that is quadratic in time, eqs. (Q2), (Q3)."""

from collections.abc import Sequence
from typing import Protocol

import ufl
from ufl.core.expr import Expr

from .path import Change, Measure, Pair
from .state import Layout


class MixedSection(Protocol):
    """A linear section in mixed form: stresses from strains and independent resultants."""

    def forces(self, layout: Layout, q: Expr) -> Expr:
        """The resultants that a state holds."""
        ...

    def stress(self, e: Expr, N: Expr) -> tuple[Expr, ...]:
        """What acts on the strains, for each quadrature rule; linear in both."""
        ...

    def gap(self, e: Expr, N: Expr) -> Expr:
        """Strains less those that belong to the resultants, weighed, in the last rule."""
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
    e, N = strain.moment(pair.moment, states), section.forces(layout, pair.moment.held)
    de = strain.at(pair.slope, states, dq)
    found = [ufl.dot(s, de) for s in section.stress(e, N)]
    found[-1] += pair.own * ufl.dot(section.forces(layout, dq), section.gap(e, N))
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
    e, N = strain.moment(pair.moment, states), section.forces(layout, pair.moment.held)
    moved = strain.at(change.moment, states, trial)
    added = change.share * section.forces(layout, trial)
    de, turned = strain.at(pair.slope, states, dq), strain.quad(trial, dq)
    found = [
        ufl.dot(new, de) + change.turn * ufl.dot(old, turned)
        for new, old in zip(section.stress(moved, added), section.stress(e, N), strict=True)
    ]
    gap = section.gap(moved, added)
    found[-1] += pair.own * ufl.dot(section.forces(layout, dq), gap)
    return found
