"""A step at Gauss' points in time, with its weights as Constants, for nonlinear sections."""

from collections.abc import Sequence
from typing import Any

from ufl.core.expr import Expr

from shellmb.forms.steps.general_strains import GeneralRow, GeneralStep
from shellmb.forms.steps.path import Moment, Points
from shellmb.schemes.notation import MomentWeights, PathPage
from shellmb.schemes.residuals.rows import bare_moment, bare_slope, both_rows, constants
from shellmb.schemes.residuals.weights import (
    POINTS,
    PairWeights,
    at_end,
    at_point,
    rate_at_point,
    slope_at_point,
)


def at_points(page: PathPage, mesh: Any, alpha: float, unknown: Sequence[Expr]) -> Points:
    """Rows of nonlinear sections.

    Args:
        page: The page of the scheme.
        mesh: Mesh of the body.
        alpha: Dissipation.
        unknown: Unknown states of the rows P0 and P1.
    """
    first, second = unknown

    def row(k: int) -> list[PairWeights]:
        return [PairWeights(at_point(page, p), slope_at_point(page, k, p), True) for p in POINTS]

    def free(weights: MomentWeights) -> Moment:
        return bare_moment(mesh, weights, first)

    rates = [free(rate_at_point(page, p)) for p in POINTS]
    held = [first + constants(mesh, p)[0] * second for p in POINTS]
    half = alpha / 2 * page.bow
    damping = [[PairWeights(half, page.slopes(k)[1], False)] for k in range(2)]
    return Points(
        both_rows(mesh, [row(0), row(1)], held),
        (rates[0], rates[1]),
        free(at_end(page, -1)),
        free(at_end(page, 1)),
        free(2.0 * page.strains(0.0)[1]),
        free(page.bow),
        (bare_slope(mesh, page.slopes(0)[0]), bare_slope(mesh, page.slopes(1)[0])),
        both_rows(mesh, damping, [first], [page.bow])[0],
        alpha > 0,
    )


def of_general_strains(mesh: Any) -> GeneralStep:
    """Rows of strains of any form, on the mesh of a body."""

    def row(points: Sequence[float], middle: float, by_velocity: float, k: int) -> GeneralRow:
        numbers = [*points, middle, by_velocity, float(k == 0), float(k == 1)]
        a, b, middling, turned, first, second = constants(mesh, numbers)
        return GeneralRow((a, b), middling, turned, (first, second))

    first, last = constants(mesh, POINTS)
    rows = row((0.5, 0.5), 0.0, 1 / 3, 0), row([p / 2 for p in POINTS], 1 / 3, 0.0, 1)
    return GeneralStep((first, last), rows)
