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
from typing import NamedTuple

import ufl
from ufl.core.expr import Expr

from shellmb.forms.constraints.held import ConstraintRow, VelocityJump
from shellmb.forms.constraints.joints import Place
from shellmb.forms.measure import measure
from shellmb.forms.steps.discrete import variation
from shellmb.forms.steps.mixed import Interval
from shellmb.forms.steps.path import Path
from shellmb.forms.steps.potentials import Stretch, exact_moments

# below this tangent of the increment its series is exact to round-off
SMALL_TANGENT = 1e-3


def cosine_sine(a: Place, b: Place) -> Expr:
    """Cosine and sine of the rotation of the second place about the axis of the first, (2,)."""
    return ufl.as_vector([ufl.dot(a.e[0], b.e[0]), ufl.dot(a.e[1], b.e[0])])


def increment(start: Expr, end: Expr) -> Expr:
    """Angle between two values of `cosine_sine`, in (-pi, pi], rad."""
    return ufl.atan2(start[0] * end[1] - start[1] * end[0], start[0] * end[0] + start[1] * end[1])


def increment_gradient(start: Expr, end: Expr, change: Expr) -> Expr:
    """Discrete gradient of `increment`: along `end - start` it is the increment itself.

    That holds for vectors of any length, as they are before Newton's method has converged.
    Derivatives go through the few numbers that are variables.

    Args:
        start: Cosine and sine at the start of the sub-interval, shape (2,).
        end: The same at its end.
        change: Variation of cosine and sine at the mid-point configuration, shape (2,).
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
    return ufl.dot(ufl.variable(ratio * perpendicular((start + end) / 2)), change)


def angle_change(at: Expr, change: Expr) -> Expr:
    """Change of the angle for a change of cosine and sine, at a single state, rad.

    Args:
        at: Cosine and sine, shape (2,).
        change: Their change, shape (2,).
    """
    at = ufl.variable(at)
    return ufl.dot(ufl.variable(perpendicular(at) / ufl.dot(at, at)), change)


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


def translation_gap(a: Place, b: Place, s: Expr) -> Expr:
    """Difference of `s` and the displacement of the second point along the first axis, m."""
    return s - ufl.dot(a.e[2], b.x - a.x)


def distance_gap(a: Place, b: Place, l: Expr, size: Expr) -> Expr:  # noqa: E741 - the usual letter
    """`(l^2 - |x2 - x1|^2) / (2 size)`, near `l = size` the difference of the lengths, m."""
    gap = b.x - a.x
    return (l**2 - ufl.dot(gap, gap)) / (2 * size)


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
    path = Stretch(start, end - start, bow)
    return exact_moments(lambda a: perpendicular(a) / ufl.dot(a, a), increment(start, end), path)


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


def turned(angle: Callable[[Expr], Expr], path: Path, k: int, dq: Expr) -> tuple[Expr, Expr]:
    """Virtual angles that torques work on in one of the rows; over the step they work on its rate.

    Cosine and sine, their bow and rates, and the stress on them, are variables: derivatives go
    through these few numbers.

    Args:
        angle: Cosine and sine as a function of the state, shape (2,).
        path: The step.
        k: Row, 0 for P0 and 1 for P1.
        dq: Direction.

    Returns:
        What torques of this row work on, and those of the other one.
    """
    quad = measure(angle).quad
    a_i, a_f = angle(path.start), ufl.variable(angle(path.end))
    rate_i = variation(angle, path.start, path.start_velocity)
    rate_f = variation(angle, path.end, path.end_velocity)
    x, D, z = path.mean, path.chord, path.bow
    bow = ufl.variable(2 * variation(angle, x + 0.4 * z, z) + quad(D, D) / 6)
    alpha = path.alpha
    rates = ufl.variable((1 + alpha) * rate_f + (1 - alpha) * rate_i)
    # linear in time, in both rows the same (Q2)
    mean, half = map(ufl.variable, angle_moments(a_i, a_f, bow))
    extra, share = map(ufl.variable, rate_moment(a_i, a_f, rates, alpha))
    normal, chord = perpendicular((a_i + a_f) / 2), quad(D, dq) / 6
    if k == 0:
        change = variation(angle, x, dq), chord, quad(path.mean_velocity, dq)
    else:
        change = chord, variation(angle, x + 0.4 * z, dq) / 3, variation(angle, path.middle, dq)
    first = ufl.dot(mean, change[0]) + ufl.dot(half, change[1])
    last = share * first + ufl.dot(extra, change[0]) + ufl.dot(normal, change[2])
    return (first, last) if k == 0 else (last, first)


def angle_rate(angle: Callable[[Expr], Expr], path: Path) -> Expr:
    """Rate of the angle at the end of the step, times the step, where `angle` is of length one."""
    return ufl.dot(perpendicular(angle(path.end)), variation(angle, path.end, path.end_velocity))


class Angle(NamedTuple):
    """Equations of rotations, which are not quadratic in the state, as a `held.Law`.

    Args:
        angle: Cosine and sine of the places as a function of the state, shape (2,).
        x: The coordinate in a state.
        gap: Difference of both at a state, from an angle on that is less than half a turn away.
        before: Coordinate at the start of the step, where forms are those of a single state.
    """

    angle: Callable[[Expr], Expr]
    x: Callable[[Expr], Expr]
    gap: Callable[[Expr, Expr], Expr]
    before: Expr

    def interval(self, span: Interval, dq: Expr) -> ConstraintRow:
        """The equation at the end of the sub-interval, its force along a discrete gradient."""
        if span.a is span.b:
            own, before = self.slope(span.mid, dq), self.before
        else:
            start, end, before = self.angle(span.a), self.angle(span.b), self.x(span.a)
            turned_by = increment_gradient(start, end, variation(self.angle, span.mid, dq))
            own = ufl.as_vector([self.x(dq) - turned_by])
        return ConstraintRow(own, self.gap(span.holding, before), span.unknown)

    def path(self, path: Path, k: int, dq: Expr, inertialess: bool) -> ConstraintRow:
        """The equation and its rate at the end of a step, two forces without work for both."""
        own, other = turned(self.angle, path, k, dq)
        own, other = ufl.as_vector([self.x(dq) - own]), ufl.as_vector([-other])
        first, last = path.end, path.end_velocity
        if k == 0:
            return ConstraintRow(own, self.gap(first, self.x(path.start)), first, other, last)
        rate = self.x(last) - angle_rate(self.angle, path)
        return ConstraintRow(own, ufl.as_vector([rate]), last, other, first)

    def velocity(self, v: Expr, mid: Expr, dv: Expr) -> ConstraintRow:
        """The rate of the coordinate is that of the places, with the impulse for that."""
        return ConstraintRow(self.slope(mid, dv), self.slope(mid, v), v)

    def jump(self, step: VelocityJump, dq: Expr) -> None:
        """None: angles hold the jump, as they are not quadratic."""

    def slope(self, q: Expr, dq: Expr) -> Expr:
        """Derivative of the equation at a state, shape (1,)."""
        change = angle_change(self.angle(q), variation(self.angle, q, dq))
        return ufl.as_vector([self.x(dq) - change])
