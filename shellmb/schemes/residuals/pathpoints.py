"""A step at Gauss' points in time, with its weights as Constants, for nonlinear sections."""

from collections.abc import Sequence
from typing import Any

from ufl.core.expr import Expr

from shellmb.forms.steps.path import Moment, Pair, Points
from shellmb.schemes.residuals.rows import bound, constants, moment_of, slope_of
from shellmb.schemes.residuals.weights import (
    BOW,
    POINTS,
    SLOPES,
    UNKNOWN,
    ChangeWeights,
    MomentWeights,
    PairWeights,
    SlopeWeights,
    at_end,
    at_point,
    combined,
    moments,
    path_states,
    rate_at_point,
    slope_at_point,
)


def at_points(mesh: Any, alpha: float, unknown: Sequence[Expr]) -> Points:
    """What rows of nonlinear sections consist of.

    Args:
        mesh: Mesh of the body.
        alpha: Dissipation.
        unknown: Unknown states of the rows P0 and P1.
    """
    first, second = unknown
    states = path_states(alpha)[:, UNKNOWN].T

    def pair(
        moment: MomentWeights, slope: SlopeWeights, shares: Sequence[float], holder: Expr
    ) -> Pair:
        """A moment and a slope; `shares` are those of the unknown states in its resultants."""
        numbered = enumerate(zip(states, shares, strict=True))
        changes = {c: ChangeWeights(s, share != 0, share, 1.0) for c, (s, share) in numbered}
        return bound(mesh, PairWeights(moment, slope, any(shares), changes), holder)

    def row(k: int) -> tuple[Pair, Pair]:
        a, b = (
            pair(at_point(p), slope_at_point(k, p), (1.0, p), first + place * second)
            for p, place in zip(POINTS, places, strict=True)
        )
        return a, b

    def free(weights: MomentWeights) -> Moment:
        return moment_of(mesh, weights, first)

    places = [constants(mesh, p)[0] for p in POINTS]
    rates = [free(rate_at_point(p)) for p in POINTS]
    half = combined((alpha / 2, BOW))
    damping = [pair(half, SLOPES[k][1], (0.0, 0.0), first) for k in range(2)]
    return Points(
        (row(0), row(1)),
        (rates[0], rates[1]),
        free(at_end(-1)),
        free(at_end(1)),
        free(combined((2.0, moments(0.0)[1]))),
        free(BOW),
        (slope_of(mesh, SLOPES[0][0]), slope_of(mesh, SLOPES[1][0])),
        (damping[0], damping[1]),
        alpha > 0,
    )
