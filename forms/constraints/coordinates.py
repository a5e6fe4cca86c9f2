"""Relative coordinates between two places as unknowns of their own.

Drivers prescribe them, springs, dampers and motors act on them, a screw ties two of them together.
Each comes with one equation, whose multiplier is the generalised force that the rest of the model
exerts on the coordinate.

A distance `l` with `l^2 = |x2 - x1|^2` and a translation `s = e3 . (x2 - x1)` are quadratic, and
their mid-point gradient is exact. A rotation is not: with `c = e1 . e1'` and `s = e2 . e1'` its
increment over a sub-interval is

    delta = atan2(c_a s_b - s_a c_b, c_a c_b + s_a s_b)

and with `c, s` quadratic in the unknowns

    delta = delta / (c_a s_b - s_a c_b) [c_m Ds - s_m Dc](q_m)[q_b - q_a]

holds exactly, so the bracket is an exact discrete gradient. The angle that belongs to `c, s` is
known up to whole turns only, so the equation of a rotation `x` is that its change since the start
of the sub-interval is the angle from `(cos x_a, sin x_a)` to `(c, s)`, the one below half a turn:
the path that its torques work on. It is linear in `x`, so that Newton's method cannot get to
another turn; and as it begins with `x_a` itself, no error adds up from step to step.

The angle of a joint over a step that is quadratic in time, eq. (Q4).

Cosine and sine are quadratic in the unknowns, the angle is not: its forces are those of a stress on
cosine and sine (`coordinates.angle_moments`).
"""

from collections.abc import Callable

import ufl
from ufl.core.expr import Expr

from shellmb.forms.constraints.elements import GAUSS
from shellmb.forms.constraints.joints import Place
from shellmb.forms.measure import measure
from shellmb.forms.steps.discrete import variation
from shellmb.forms.steps.path import Path

# below this tangent of the increment its series is exact to round-off
SMALL_TANGENT = 1e-3


def cosine_sine(a: Place, b: Place) -> Expr:
    """Cosine and sine of the rotation of the second place about the axis of the first, (2,)."""
    return ufl.as_vector([ufl.dot(a.e[0], b.e[0]), ufl.dot(a.e[1], b.e[0])])


def increment(start: Expr, end: Expr) -> Expr:
    """Angle between two values of `cosine_sine`, in (-pi, pi], rad."""
    return ufl.atan2(start[0] * end[1] - start[1] * end[0], start[0] * end[0] + start[1] * end[1])


def increment_gradient(start: Expr, end: Expr, change: Expr, torque: Expr | float = 1.0) -> Expr:
    """Discrete gradient of `increment`: along `end - start` it is the increment itself.

    That holds for vectors of any length, as they are before Newton's method has converged.
    Derivatives go through the few numbers that are variables.

    Args:
        start: Cosine and sine at the start of the sub-interval, shape (2,).
        end: The same at its end.
        change: Variation of cosine and sine at the mid-point configuration, shape (2,).
        torque: What works on it.
    """
    start, end = ufl.variable(start), ufl.variable(end)
    sine = start[0] * end[1] - start[1] * end[0]
    cosine = start[0] * end[0] + start[1] * end[1]
    near = ufl.lt(abs(sine), SMALL_TANGENT * cosine)
    tangent = sine / ufl.conditional(near, cosine, 1.0)
    # delta / sine
    series = (1 - tangent**2 / 3 + tangent**4 / 5) / ufl.conditional(near, cosine, 1.0)
    ratio = ufl.conditional(
        near, series, ufl.atan2(sine, cosine) / ufl.conditional(near, 1.0, sine)
    )
    return ufl.dot(ufl.variable(torque * ratio * perpendicular((start + end) / 2)), change)


def angle_change(at: Expr, change: Expr, torque: Expr | float = 1.0) -> Expr:
    """Change of the angle for a change of cosine and sine, at a single state, rad.

    Args:
        at: Cosine and sine, shape (2,).
        change: Their change, shape (2,).
        torque: What works on it.
    """
    at = ufl.variable(at)
    return ufl.dot(ufl.variable(torque / ufl.dot(at, at) * perpendicular(at)), change)


def rotation_gap(a: Place, b: Place, x: Expr, before: Expr) -> Expr:
    """Difference of the angle `x` and the rotation of the places, rad.

    Args:
        a: First place.
        b: Second place.
        x: The angle.
        before: An angle that the rotation differs from by less than half a turn: `x` at the start
            of a step, or `x` itself, from which the difference is known up to whole turns.
    """
    start = ufl.as_vector([ufl.cos(before), ufl.sin(before)])
    return x - before - increment(start, cosine_sine(a, b))


def translation(a: Place, b: Place) -> Expr:
    """Displacement of the second point along the axis of the first place, m."""
    return ufl.dot(a.e[2], b.x - a.x)


def translation_gap(a: Place, b: Place, s: Expr) -> Expr:
    """Difference of `s` and the translation of the places, m."""
    return s - translation(a, b)


def distance_gap(a: Place, b: Place, l: Expr, size: Expr) -> Expr:  # noqa: E741 - the usual letter
    """`(l^2 - |x2 - x1|^2) / (2 size)`, near `l = size` the difference of the lengths, m."""
    gap = b.x - a.x
    return (l**2 - ufl.dot(gap, gap)) / (2 * size)


# squares of changes of a cosine or sine below this leave no digits of the correction
_TINY = 1e-16


def angle_moments(start: Expr, end: Expr, bow: Expr) -> tuple[Expr, Expr]:
    """Discrete gradient of the angle over a step that is quadratic in time (`forms.steps.path`).

    With the moments `T_0, T_1` of its gradient along the path of cosine and sine, projected on
    linear functions of time, `T_0 . (end - start) + T_1 . bow` is the increment of the angle, by a
    correction that is far below the order of the scheme.

    Args:
        start: Cosine and sine at the start, shape (2,).
        end: The same at the end.
        bow: Their bow, `e_i + e_f - 2 <e>`.
    """
    chord = end - start
    first, second = 0 * start, 0 * start
    for g, weight in GAUSS:
        tau = (1 + g) / 2
        a = start + tau * chord + 3 * (tau**2 - tau) * bow
        slope = perpendicular(a) / ufl.dot(a, a)
        first, second = first + weight * slope, second + 3 * g * weight * slope
    defect = increment(start, end) - ufl.dot(first, chord) - ufl.dot(second, bow)
    ratio = defect / (ufl.dot(chord, chord) + ufl.dot(bow, bow) + _TINY)
    return first + ratio * chord, second + ratio * bow


def perpendicular(a: Expr) -> Expr:
    """A vector of the plane turned by a right angle."""
    return ufl.as_vector([-a[1], a[0]])


def rate_moment(start: Expr, end: Expr, rates: Expr, alpha: Expr) -> tuple[Expr, Expr]:
    """Part of the force of an angle's rate that a quadratic constraint would not have.

    The rate is `a x a'` of cosine and sine `a`. Forces `J_m.Da` with the mean of both ends, as of a
    quadratic constraint, work on `a_m x (..)` instead of it; the vector works the difference on the
    chord, and the number times the discrete gradient of the angle makes up for `alpha`.

    Args:
        start: Cosine and sine at the start, shape (2,).
        end: The same at the end.
        rates: `(1 + alpha) a'_f + (1 - alpha) a'_i`, times the step.
        alpha: Dissipation.

    Returns:
        The vector and the number.
    """
    angle = increment(start, end)
    sine = start[0] * end[1] - start[1] * end[0]
    near = ufl.lt(angle**2, SMALL_TANGENT**2)
    series = -(angle**2) / 6 + angle**4 / 120
    share = ufl.conditional(near, series, sine / ufl.conditional(near, 1.0, angle) - 1)
    return -perpendicular(rates) / 4, alpha * share


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
