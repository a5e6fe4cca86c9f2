"""The angle of a joint over a step that is quadratic in time, eq. (Q4).

Cosine and sine are quadratic in the unknowns, the angle is not: its forces are those of a stress on
cosine and sine (`coordinates.angle_moments`).
"""

from collections.abc import Callable

import ufl
from ufl.core.expr import Expr

from shellmb.forms.constraints.coordinates import angle_moments, perpendicular, rate_moment
from shellmb.forms.measure import measure
from shellmb.forms.steps.discrete import variation
from shellmb.forms.steps.path import Path


def turned(
    angle: Callable[[Expr], Expr], path: Path, k: int, dq: Expr, multipliers: tuple[Expr, Expr]
) -> Expr:
    """Work of torques on the angle in one of the rows, which over the step is that on its rate.

    Cosine and sine, their bow and rates, and the stress on them, are variables: derivatives go
    through these few numbers.

    Args:
        angle: Cosine and sine as a function of the state, shape (2,).
        path: The step.
        k: Row, 0 for P0 and 1 for P1.
        dq: Direction.
        multipliers: Torques, those of both rows.
    """
    quad = measure(angle).quad
    a_i, a_f = angle(path.start), ufl.variable(angle(path.end))
    rate_i, rate_f = (
        variation(angle, path.start, path.start_velocity),
        variation(angle, path.end, path.end_velocity),
    )
    x, D, z = path.mean, path.chord, path.bow
    bow = ufl.variable(2 * variation(angle, x + 0.4 * z, z) + quad(D, D) / 6)
    alpha = path.alpha
    rates = ufl.variable((1 + alpha) * rate_f + (1 - alpha) * rate_i)
    first, last = multipliers
    moments = angle_moments(a_i, a_f, bow)
    extra, share = rate_moment(a_i, a_f, rates, alpha)
    # linear in time, in both rows the same (Q2)
    factor, normal = first + share * last, perpendicular((a_i + a_f) / 2)
    mean, half = factor * moments[0] + last * extra, factor * moments[1]
    stress = ufl.variable(ufl.as_vector([*mean, *half, *(last * normal)]))
    chord = quad(D, dq) / 6
    if k == 0:
        change = *variation(angle, x, dq), *chord, *quad(path.mean_velocity, dq)
    else:
        late = variation(angle, x + 0.4 * z, dq) / 3
        change = *chord, *late, *variation(angle, path.middle, dq)
    return ufl.dot(stress, ufl.as_vector(change))


def angle_rate(angle: Callable[[Expr], Expr], path: Path) -> Expr:
    """Rate of the angle at the end of the step, times the step, where `angle` is of length one."""
    return ufl.dot(perpendicular(angle(path.end)), variation(angle, path.end, path.end_velocity))
