"""Rates of strains over a step, their weights as Constants, eq. (D1) of `forms.steps.damping`."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.forms.steps.damping import Straining
from shellmb.forms.steps.path import Moment, Rows, Stress
from shellmb.schemes.interval import A, B
from shellmb.schemes.notation import De, MomentWeights, PathPage, SlopeWeights, e, lin, x, z
from shellmb.schemes.residuals.rows import both_rows, bound, constants, moment_of
from shellmb.schemes.residuals.weights import (
    AT_REFERENCE,
    FIRST,
    LAST,
    UNKNOWN,
    ChangeWeights,
    PairWeights,
)

# changes of a strain over a sub-interval, and over the one before and behind it, whose chord is z
CHANGE = e(B) - e(A)
BEFORE = e(A) - e(A - z)
BEHIND = e(B + z) - e(B)

# state at the start, and the unknown ones of the rows P0 and P1
type Sources = tuple[Expr, Expr, Expr]

# what the rows of a scheme of one and of two sub-intervals see, the shares of the unknown states in
# x, D, z, y there, and what the work (D2) is of
ROWS: dict[tuple[int, int], MomentWeights] = {
    (1, 0): CHANGE,
    (2, 0): 4 * CHANGE + BEHIND,
    (2, 1): CHANGE + BEFORE,
}
SHARES: dict[tuple[int, int], list[Floats]] = {
    (1, 0): [LAST],
    (2, 0): [LAST - z, z],
    (2, 1): [FIRST + z, LAST],
}
WORKS: dict[tuple[int, int], list[MomentWeights]] = {
    (1, 0): [CHANGE],
    (2, 0): [CHANGE + BEHIND, CHANGE],
    (2, 1): [CHANGE + BEFORE, BEFORE],
}


def over_interval(
    mesh: Any,
    states: tuple[Expr, ...],
    place: tuple[int, int],
    dt: Expr,
    linear: bool,
) -> Straining:
    """The row of a sub-interval.

    Args:
        mesh: Mesh of the body.
        states: Mean and chord of the sub-interval, and the chord of the other one.
        place: Number of sub-intervals, and which of them it is.
        dt: Length of the step.
        linear: Whether strains are linear.
    """
    n = 1 + place[0]

    def weights(strain: MomentWeights) -> MomentWeights:
        return lin(strain.linear) if linear else strain

    def holder(moment: MomentWeights) -> Expr:
        """Resultants of states change as strains do."""
        numbers = constants(mesh, moment.linear[1:n])
        parts = [c * state for c, state in zip(numbers, states[1:n], strict=True)]
        return sum(parts[1:], parts[0])

    slope, seen = AT_REFERENCE if linear else De(x), weights(ROWS[place])
    shares = [float(seen.linear @ share) for share in SHARES[place]]
    pair = _pair(seen, slope, SHARES[place], shares)
    works = [weights(work) for work in WORKS[place]]
    change = tuple(moment_of(mesh, work, holder(work)) for work in works)
    own = bound(mesh, pair, holder(seen))
    stress = Stress(own.moment, (own.slope,), None)
    return Straining(Rows(states, (stress,), ((own,),), place[1:], n), change, dt)


def over_path(
    page: PathPage,
    mesh: Any,
    alpha: float,
    states: tuple[Expr, ...],
    sources: Sources,
    dt: Expr,
) -> Straining:
    """The rows of a step that is quadratic in time.

    Args:
        page: The page of the scheme.
        mesh: Mesh of the body.
        alpha: Dissipation.
        states: Mean, chord, bow and mean velocity of the path.
        sources: State at the start, and the unknown ones of both rows.
        dt: Length of the step.
    """
    change, shares = 2.0 * page.strains(0.0)[1], page.states(alpha)[:, UNKNOWN].T
    # resultants are S_0 and S_1 of (Q3): what of S_i and of them the bow and the change are
    bow = np.array([1.0, -1, 1]) * 2 / (1 + alpha)
    held = np.array([0.0, 0, 2]) - alpha * bow, bow

    def holder(weights: Floats) -> Expr:
        parts = [c * q for c, q in zip(constants(mesh, weights), sources, strict=True)]
        return sum(parts[1:], parts[0])

    own = held[0], 3 * held[1]
    seen = list(zip((change, 3.0 * page.bow), own, strict=True))
    pairs = [
        [_pair(moment, slope, shares, w[1:]) for (moment, w), slope in zip(seen, row, strict=True)]
        for row in (page.slopes(0), page.slopes(1))
    ]
    works: tuple[Moment, ...] = tuple(
        moment_of(mesh, *both) for both in zip((change, page.bow), map(holder, held), strict=True)
    )
    return Straining(both_rows(mesh, states, pairs, [holder(w) for w in own]), works, dt)


def _pair(
    moment: MomentWeights, slope: SlopeWeights, shares: Iterable[Floats], held: Iterable[float]
) -> PairWeights:
    """A pair whose compatibility is demanded elsewhere.

    Args:
        moment: Its moment.
        slope: What its stress acts on.
        shares: Those of the unknown states in x, D, z, y.
        held: Those of their resultants in the resultants of the moment.
    """
    both = enumerate(zip(shares, held, strict=True))
    changes = {c: ChangeWeights(share, False, float(own), 0.0) for c, (share, own) in both}
    return PairWeights(moment, slope, False, changes)
