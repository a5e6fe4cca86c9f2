"""Rates of strains over a step, their weights as Constants, eq. (D1) of `forms.steps.damping`.

And stresses of other combinations of the same two, eq. (V3) of `forms.steps.relaxation`.
"""

from collections.abc import Iterable, Iterator, Sequence
from functools import reduce
from operator import add
from typing import Any, NamedTuple

import numpy as np
from dolfinx import fem
from ufl.core.expr import Expr
from ufl.corealg.traversal import traverse_unique_terminals

from shellmb.arrays import Floats
from shellmb.forms.steps.damping import Straining
from shellmb.forms.steps.path import Moment, Rows, Stress
from shellmb.schemes.interval import A, B
from shellmb.schemes.notation import De, MomentWeights, PathPage, e, lin, x, z
from shellmb.schemes.residuals.rows import (
    AT_REFERENCE,
    PairWeights,
    both_rows,
    constants,
    moment_of,
    slope_of,
)

# changes of a strain over a sub-interval, and over the one before and behind it, whose chord is z
CHANGE = e(B) - e(A)
BEFORE = e(A) - e(A - z)
BEHIND = e(B + z) - e(B)

# state at the start, and the unknown ones of the rows P0 and P1
type Sources = tuple[Expr, Expr, Expr]

# shares of the stresses S_0 and S_1 in the rows of a scheme of one and of two sub-intervals, and
# the change of the strain over the step with its bow
ROWS: dict[tuple[int, int], tuple[float, ...]] = {(1, 0): (1,), (2, 0): (1, -1), (2, 1): (1, 0)}
CHANGES: dict[tuple[int, int], list[MomentWeights]] = {
    (1, 0): [CHANGE],
    (2, 0): [CHANGE + BEHIND, -1 * CHANGE],
    (2, 1): [CHANGE + BEFORE, -1 * BEFORE],
}


class Mixed(NamedTuple):
    """Strains of the stresses S_0 and S_1.

    Args:
        weights: Weights of the change of the strain and of its bow, shape (2, 2).
        given: Strains that are added; none: nothing is.
    """

    weights: Floats
    given: Sequence[Expr] = ()


# the rate times the step, eq. (D1)
RATE = Mixed(np.diag([1.0, 3.0]))


def over_interval(
    mesh: Any,
    states: tuple[Expr, ...],
    place: tuple[int, int],
    dt: Expr,
    linear: bool,
    mixed: Mixed = RATE,
) -> Straining:
    """The row of a sub-interval.

    Args:
        mesh: Mesh of the body.
        states: Mean and chord of the sub-interval, and the chord of the other one.
        place: Number of sub-intervals, and which of them it is.
        dt: Length of the step.
        linear: Whether strains are linear.
        mixed: Strains of the stresses.
    """
    n, row = 1 + place[0], ROWS[place]

    def weights(strain: MomentWeights) -> MomentWeights:
        return lin(strain.linear) if linear else strain

    def holder(moment: MomentWeights) -> Expr:
        """Resultants of states change as strains do."""
        numbers = constants(mesh, moment.linear[1:n])
        return reduce(add, [c * state for c, state in zip(numbers, states[1:n], strict=True)])

    changes = [weights(moment) for moment in CHANGES[place]]
    slope = AT_REFERENCE if linear else De(x)
    seen = _sum(np.array(row) @ mixed.weights[: len(row)], changes)
    change = tuple(moment_of(mesh, moment, holder(moment)) for moment in changes)
    own = moment_of(mesh, seen, holder(seen))
    if mixed.given:
        own = own._replace(given=_given(row, mixed.given))
    stress = Stress(own, (slope_of(mesh, slope),), None)
    return Straining(Rows(states, (stress,), place[1:], n), change, dt)


def over_path(
    page: PathPage,
    mesh: Any,
    alpha: float,
    states: tuple[Expr, ...],
    sources: Sources,
    dt: Expr,
    mixed: Mixed = RATE,
) -> Straining:
    """The rows of a step that is quadratic in time.

    Args:
        page: The page of the scheme.
        mesh: Mesh of the body.
        alpha: Dissipation.
        states: Mean, chord, bow and mean velocity of the path.
        sources: State at the start, and the unknown ones of both rows.
        dt: Length of the step.
        mixed: Strains of the stresses.
    """
    change = 2.0 * page.strains(0.0)[1]
    # resultants are S_0 and S_1 of (Q3): what of S_i and of them the bow and the change are
    bow = np.array([1.0, -1, 1]) * 2 / (1 + alpha)
    held = np.array([0.0, 0, 2]) - alpha * bow, bow

    def holder(weights: Floats) -> Expr:
        numbers = constants(mesh, weights)
        return reduce(add, [c * q for c, q in zip(numbers, sources, strict=True)])

    own = mixed.weights @ held
    moments = [_sum(row, (change, page.bow)) for row in mixed.weights]
    pairs = [
        [PairWeights(moment, slope, False) for moment, slope in zip(moments, row, strict=True)]
        for row in (page.slopes(0), page.slopes(1))
    ]
    works: tuple[Moment, ...] = tuple(
        moment_of(mesh, *both) for both in zip((change, page.bow), map(holder, held), strict=True)
    )
    like = [_sum(np.abs(row), map(abs, (change, page.bow))) for row in mixed.weights]
    stresses = both_rows(mesh, pairs, [holder(w) for w in own], like)
    if mixed.given:
        both = zip(stresses, mixed.given, strict=True)
        stresses = tuple(s._replace(moment=s.moment._replace(given=e)) for s, e in both)
    return Straining(Rows(states, stresses, (0, 1)), works, dt)


def _given(row: Sequence[float], strains: Sequence[Expr]) -> Expr:
    return reduce(add, [c * e for c, e in zip(row, strains, strict=False) if c])


def _sum(weights: Iterable[float], moments: Iterable[MomentWeights]) -> MomentWeights:
    return reduce(add, [float(w) * m for w, m in zip(weights, moments, strict=False)])


def renew(rows: Rows, other: Rows) -> None:
    """Take the numbers of other rows, of the same kind."""
    for mine, its in zip(_constants(rows), _constants(other), strict=True):
        mine.value[...] = its.value


def _constants(item: Any) -> Iterator[Any]:
    """Constants of rows, in the order in which these were made."""
    if isinstance(item, Expr):
        yield from (c for c in traverse_unique_terminals(item) if isinstance(c, fem.Constant))
    elif isinstance(item, tuple):
        for part in item:
            yield from _constants(part)
