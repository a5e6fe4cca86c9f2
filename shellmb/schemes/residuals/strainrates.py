"""Rates of strains over a step, their weights as Constants, eq. (D1) of `forms.steps.damping`."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from ufl.core.expr import Expr

from shellmb.forms.steps.damping import Straining
from shellmb.forms.steps.path import Moment, Row
from shellmb.schemes.residuals.rows import bound, moment_of
from shellmb.schemes.residuals.weights import (
    AT_REFERENCE,
    BOW,
    LAST,
    MIDDLE,
    SLOPES,
    UNKNOWN,
    ChangeWeights,
    Floats,
    MomentWeights,
    PairWeights,
    SlopeWeights,
    combined,
    moments,
    path_states,
)

# changes of a strain over a sub-interval, and over the one before and behind it, whose chord is z
CHANGE = MomentWeights(np.array([0.0, 1, 0, 0]), np.array([0.0, 1, 0, 0, 0, 0, 0]))
BEFORE = MomentWeights(np.array([0.0, 0, 1, 0]), np.array([0, 0, 1, 0, -1 / 2, -1 / 2, 0]))
BEHIND = MomentWeights(np.array([0.0, 0, 1, 0]), np.array([0, 0, 1, 0, 1 / 2, 1 / 2, 0]))

# what the rows of a scheme of one and of two sub-intervals see, the shares of the unknown states in
# x, D, z, y there, and what the work (D2) is of
type Parts = tuple[tuple[float, MomentWeights], ...]

ROWS: dict[tuple[int, int], Parts] = {
    (1, 0): ((1, CHANGE),),
    (2, 0): ((4, CHANGE), (1, BEHIND)),
    (2, 1): ((1, CHANGE), (1, BEFORE)),
}
SHARES: dict[tuple[int, int], list[Floats]] = {
    (1, 0): [LAST],
    (2, 0): [np.array([0.5, 1, -1, 0]), np.array([0.0, 0, 1, 0])],
    (2, 1): [np.array([0.5, -1, 1, 0]), LAST],
}
WORKS: dict[tuple[int, int], list[Parts]] = {
    (1, 0): [((1, CHANGE),)],
    (2, 0): [((1, CHANGE), (1, BEHIND)), ((1, CHANGE),)],
    (2, 1): [((1, CHANGE), (1, BEFORE)), ((1, BEFORE),)],
}


def over_interval(
    mesh: Any,
    states: tuple[Expr, ...],
    place: tuple[int, int],
    holder: Expr,
    dt: Expr,
    linear: bool,
) -> Straining:
    """The row of a sub-interval.

    Args:
        mesh: Mesh of the body.
        states: Mean and chord of the sub-interval, and the chord of the other one.
        place: Number of sub-intervals, and which of them it is.
        holder: The unknown state at its end.
        dt: Length of the step.
        linear: Whether strains are linear.
    """

    def weights(parts: Parts) -> MomentWeights:
        found = combined(*parts)
        return MomentWeights(found.linear, np.zeros(7)) if linear else found

    slope = AT_REFERENCE if linear else MIDDLE
    pair = _pair(weights(ROWS[place]), slope, SHARES[place])
    change = tuple(moment_of(mesh, weights(work), holder) for work in WORKS[place])
    return Straining(Row(states, (bound(mesh, pair, holder),), 1 + place[0]), change, dt)


def over_path(
    mesh: Any, alpha: float, states: tuple[Expr, ...], row: int, holder: Expr, dt: Expr
) -> Straining:
    """A row of a step that is quadratic in time.

    Args:
        mesh: Mesh of the body.
        alpha: Dissipation.
        states: Mean, chord, bow and swing of the path.
        row: 0 for P0, 1 for P1.
        holder: The unknown state of the row.
        dt: Length of the step.
    """
    change, shares = combined((2.0, moments(0.0)[1])), path_states(alpha)[:, UNKNOWN].T
    seen = zip((change, combined((3.0, BOW))), SLOPES[row], strict=True)
    pairs = tuple(bound(mesh, _pair(moment, slope, shares), holder) for moment, slope in seen)
    works: tuple[Moment, ...] = tuple(moment_of(mesh, w, holder) for w in (change, BOW))
    return Straining(Row(states, pairs), works, dt)


def _pair(moment: MomentWeights, slope: SlopeWeights, shares: Iterable[Floats]) -> PairWeights:
    """A pair without resultants."""
    changes = {c: ChangeWeights(share, False, 0.0, 0.0) for c, share in enumerate(shares)}
    return PairWeights(moment, slope, False, changes)
