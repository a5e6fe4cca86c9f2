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
known up to whole turns only, so the equation of a rotation `x` is that the angle between
`(cos x, sin x)` and `(c, s)` vanishes: `x` counts the turns, as long as no step is half a turn, and
no error adds up from step to step.
"""

import ufl
from ufl.core.expr import Expr

from .joints import Place

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

    Args:
        start: Cosine and sine at the start of the sub-interval, shape (2,).
        end: The same at its end.
        change: Variation of cosine and sine at the mid-point configuration, shape (2,).
    """
    sine = start[0] * end[1] - start[1] * end[0]
    cosine = start[0] * end[0] + start[1] * end[1]
    near = ufl.lt(abs(sine), SMALL_TANGENT * cosine)
    tangent = sine / ufl.conditional(near, cosine, 1.0)
    # delta / sine
    series = (1 - tangent**2 / 3 + tangent**4 / 5) / ufl.conditional(near, cosine, 1.0)
    ratio = ufl.conditional(
        near, series, ufl.atan2(sine, cosine) / ufl.conditional(near, 1.0, sine)
    )
    middle = (start + end) / 2
    return ratio * (middle[0] * change[1] - middle[1] * change[0])


def turning(at: Expr, change: Expr) -> Expr:
    """Change of the angle for a change of cosine and sine, at a single state, rad.

    Args:
        at: Cosine and sine, shape (2,).
        change: Their change, shape (2,).
    """
    return (at[0] * change[1] - at[1] * change[0]) / ufl.dot(at, at)


def rotation_gap(a: Place, b: Place, x: Expr) -> Expr:
    """Difference of the angle `x` and the rotation of the places, modulo whole turns, rad."""
    return increment(cosine_sine(a, b), ufl.as_vector([ufl.cos(x), ufl.sin(x)]))


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
