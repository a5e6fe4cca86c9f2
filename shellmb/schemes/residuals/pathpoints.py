"""A step at Gauss' points in time, with its weights as Constants, for nonlinear sections."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from ufl.core.expr import Expr

from shellmb.forms.steps.general_strains import GeneralRow, GeneralStep
from shellmb.forms.steps.path import Moment, Points
from shellmb.schemes.notation import MomentWeights, PathPage
from shellmb.schemes.residuals.rows import bare_moment, bare_slope, both_rows, constants
from shellmb.schemes.residuals.weights import (
    POINTS,
    UNKNOWN,
    ChangeWeights,
    PairWeights,
    at_end,
    at_point,
    rate_at_point,
    slope_at_point,
)


def at_points(
    page: PathPage, mesh: Any, states: tuple[Expr, ...], alpha: float, unknown: Sequence[Expr]
) -> Points:
    """Rows of nonlinear sections.

    Args:
        page: The page of the scheme.
        mesh: Mesh of the body.
        states: Mean, chord, bow and mean velocity of the path.
        alpha: Dissipation.
        unknown: Unknown states of the rows P0 and P1.
    """
    first, second = unknown
    parts = page.states(alpha)[:, UNKNOWN].T

    def changes(shares: Sequence[float]) -> dict[int, ChangeWeights]:
        """Changes of moments, with the shares of the unknown states in their resultants."""
        numbered = enumerate(zip(parts, shares, strict=True))
        return {c: ChangeWeights(s, share != 0, share, 1.0) for c, (s, share) in numbered}

    def row(k: int) -> list[PairWeights]:
        of_points = [
            (at_point(page, p), slope_at_point(page, k, p), True, changes((1.0, p))) for p in POINTS
        ]
        return [PairWeights(*pair) for pair in of_points]

    def free(weights: MomentWeights) -> Moment:
        return bare_moment(mesh, weights, first)

    rates = [free(rate_at_point(page, p)) for p in POINTS]
    held = [first + constants(mesh, p)[0] * second for p in POINTS]
    half, none = alpha / 2 * page.bow, changes((0.0, 0.0))
    damping = [[PairWeights(half, page.slopes(k)[1], False, none)] for k in range(2)]
    return Points(
        both_rows(mesh, states, [row(0), row(1)], held),
        (rates[0], rates[1]),
        free(at_end(page, -1)),
        free(at_end(page, 1)),
        free(2.0 * page.strains(0.0)[1]),
        free(page.bow),
        (bare_slope(mesh, page.slopes(0)[0]), bare_slope(mesh, page.slopes(1)[0])),
        both_rows(mesh, states, damping, [first], [page.bow]),
        alpha > 0,
    )


def of_general_strains(page: PathPage, mesh: Any, alpha: float) -> GeneralStep:
    """Rows of strains of any form.

    Args:
        page: The page of the scheme.
        mesh: Mesh of the body.
        alpha: Dissipation.
    """

    def row(points: Sequence[float], middle: float, by_velocity: float, k: int) -> GeneralRow:
        numbers = [*points, middle, by_velocity, float(k == 0), float(k == 1)]
        a, b, middling, turned, first, second = constants(mesh, numbers)
        return GeneralRow((a, b), middling, turned, (first, second))

    first, last = constants(mesh, POINTS)
    rows = row((0.5, 0.5), 0.0, 1 / 3, 0), row([p / 2 for p in POINTS], 1 / 3, 0.0, 1)
    # of the states on the path, and of those that hold the resultants of both rows
    held = np.eye(2)
    shares = np.concatenate([page.states(alpha)[:, UNKNOWN], held]).T
    return GeneralStep((first, last), rows, tuple(constants(mesh, list(s)) for s in shares))
