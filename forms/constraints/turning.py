"""The angle of a joint over a step that is quadratic in time, eq. (Q4).

Cosine and sine are quadratic in the unknowns, the angle is not: its forces are those of a stress on
cosine and sine (`coordinates.angle_moments`).
"""

from collections.abc import Callable

import ufl
from ufl.core.expr import Expr

from shellmb.forms.constraints.coordinates import angle_moments, perpendicular, swing_moment
from shellmb.forms.constraints.pathconstraints import ConstraintRow
from shellmb.forms.steps.discrete import variation
from shellmb.forms.steps.path import Path, measure


def turning_row(
    angle: Callable[[Expr], Expr],
    part: Callable[[Expr, str], Expr],
    gap: Expr,
    path: Path,
    k: int,
    dq: Expr,
) -> ConstraintRow:
    """The equation `x = angle` in one of the rows, with forces that do no work.

    Args:
        angle: Cosine and sine as a function of the state, shape (2,).
        part: Part "x" of a state, the coordinate.
        gap: The equation at the end of the step, shape (1,).
        path: The step.
        k: Row, 0 for P0 and 1 for P1.
        dq: Direction.
    """
    quad = measure(angle).quad
    a_i, a_f = angle(path.start), angle(path.end)
    rate_i, rate_f = variation(angle, path.start, path.push), variation(angle, path.end, path.rate)
    x, D, z = path.mean, path.chord, path.bow
    bow = 2 * variation(angle, x + 0.4 * z, z) + quad(D, D) / 6
    moments = angle_moments(a_i, a_f, bow)
    alpha = path.alpha
    rates = (1 + alpha) * rate_f + (1 - alpha) * rate_i
    extra, share = swing_moment(a_i, a_f, rates, alpha)
    swing = (extra + share * moments[0], share * moments[1])

    def row(stress: tuple[Expr, Expr]) -> Expr:
        """Stress on cosine and sine, linear in time, in this row (Q2)."""
        chord = quad(path.chord, dq) / 6
        if k == 0:
            mean = variation(angle, path.mean, dq)
            return ufl.dot(stress[0], mean) + ufl.dot(stress[1], chord)
        late = variation(angle, path.mean + 0.4 * path.bow, dq) / 3
        return ufl.dot(stress[0], chord) + ufl.dot(stress[1], late)

    normal = perpendicular((a_i + a_f) / 2)
    dx = part(dq, "x")
    if k == 0:
        turned = ufl.dot(normal, quad(path.swing, dq)) + row(swing)
        return ConstraintRow(_row(dx - row(moments)), _row(-turned), gap, (path.end, path.rate))
    turned = ufl.dot(normal, variation(angle, path.middle, dq)) + row(swing)
    rate = part(path.rate, "x") - ufl.dot(perpendicular(a_f), rate_f)
    return ConstraintRow(_row(dx - turned), _row(-row(moments)), _row(rate), (path.rate, path.end))


def _row(value: Expr) -> Expr:
    return ufl.as_vector([value])
