"""Stresses of a potential of any form of measures that are at most quadratic, exact over a step.

A potential `U(e)` of measures `e(q)` of the position (coordinates, squares of distances) is treated
as a strain energy is. Over a sub-interval its stress `S` satisfies `S.(e_b - e_a) = U_b - U_a`;
over a step that is quadratic in time (`forms.steps.path`) `S_0 + S_1 P1` satisfies
`S_0.(e_f - e_i) + S_1.bow = U_f - U_i`. Both are means of the slopes along the path, by four Gauss
points, and what those lack of the change of the energy, along chord and bow (after O. Gonzalez,
J. Nonlinear Sci. 6 (1996) 449-467).

A potential `U(g)` of a distance `g(e)` that follows from several measures is treated in two stages:
its stress `s` on the distance, and the mean slopes of the distance by the measures, each with a
correction of its own. What Gauss points lack where `U` has a kink then acts along the normal, and
none of it along a surface that a body slides on.

Springs, dampers, motors and stops are written in the coordinate of a mechanism itself, an unknown
of the model, so that their virtual work is `force dx`.

What dissipates in ED and ED3 acts on the jump of `e` and on its bow with the change of the slope.
Where the potential is concave that would gain energy: there it is scaled down to nothing.

===========  =====================================================================  ====
symbol       name                                                                   eq.
===========  =====================================================================  ====
`S_0, S_1`   stress, linear in time                                                 (Q3)
`beta`       share of the jump of the stress                                        (32)
`alpha`      dissipation                                                            (Q5)
===========  =====================================================================  ====
"""

from collections.abc import Callable
from typing import NamedTuple

import ufl
from ufl.algorithms.ad import expand_derivatives
from ufl.core.expr import Expr

from shellmb.forms.steps.discrete import gradient
from shellmb.forms.steps.mixed_nonlinear import tangent

Potential = Callable[[Expr], Expr]

# squares of changes of measures of order one below which a correction is round-off
TINY = 1e-16
# Gauss points on [-1, 1] with their weights: the mean slope of a polynomial of degree 8 is exact
GAUSS = (
    (-0.8611363115940526, 0.1739274225687269),
    (-0.3399810435848563, 0.3260725774312731),
    (0.3399810435848563, 0.3260725774312731),
    (0.8611363115940526, 0.1739274225687269),
)

# An increment below this part of the coordinate's size is left to Gauss' rule: its error, of the
# ninth order, is below round-off, while a correction by differences of energies would lose digits.
SMALL_INCREMENT = 1e-4
# Gauss points on [-1, 1] of the smooth slopes of a distance in each half of a step
INNER = 1 / 3**0.5
# cosine of the angle of a motion and the change of a slope from which the dissipation is whole
WHOLE = 0.1


class Stretch(NamedTuple):
    """Extension of a spring over a step that is quadratic in time (`forms.steps.path`).

    Args:
        start: At the start.
        chord: Its change.
        bow: `e_i + e_f - 2 <e>`, twice the bow of the path.
    """

    start: Expr
    chord: Expr
    bow: Expr


def linear_potential(k: Expr) -> Potential:
    """Energy of a linear spring of stiffness `k`."""
    return lambda e: k * e**2 / 2


def linear_stiffness(k: Expr) -> Expr:
    """Second derivative of the energy of a linear spring."""
    U = linear_potential(k)
    return expand_derivatives(slope(lambda e: slope(U, e), ufl.as_ufl(1.0)))


def slope(U: Potential, e: Expr) -> Expr:
    """Force `U'(e)`."""
    return gradient(lambda v: ufl.as_ufl(U(v)), e)


def path_stresses(U: Potential, e: Stretch, alpha: Expr, smooth: float = 0.0) -> tuple[Expr, Expr]:
    """`S_0` and `S_1` over a step that is quadratic in time, shape (n,) each.

    Args:
        U: Energy as a function of measures of order one, shape (n,).
        e: The measures over the step.
        alpha: Dissipation.
        smooth: Change of the measures up to which Gauss points are exact to round-off.
    """
    change = U(e.start + e.chord) - U(e.start)
    first, second = exact_moments(lambda x: gradient(U, x), change, e, smooth)
    damping = alpha / 2 * convex(ufl.dot(curvature(U, e), e.bow), e.bow)
    return first, second + damping


def exact_moments(
    slope: Callable[[Expr], Expr], change: Expr, e: Stretch, smooth: float = 0.0
) -> tuple[Expr, Expr]:
    """Mean and first moment of a slope over a step, whose work is a change; shape (n,) each.

    Args:
        slope: The slope as a function of the measures.
        change: What they work, as the first on the chord and the second on the bow.
        e: The measures over the step.
        smooth: As of `path_stresses`.
    """
    first, second = 0 * e.start, 0 * e.start
    for g, weight in GAUSS:
        tau = (1 + g) / 2
        here = slope(e.start + tau * e.chord + 3 * (tau**2 - tau) * e.bow)
        first, second = first + weight * here, second + 3 * g * weight * here
    work = ufl.dot(first, e.chord) + ufl.dot(second, e.bow)
    size = ufl.dot(e.chord, e.chord) + ufl.dot(e.bow, e.bow)
    ratio = _missing(change - work, size, smooth)
    return first + ratio * e.chord, second + ratio * e.bow


def _missing(change: Expr, size: Expr, smooth: float) -> Expr:
    """Change of an energy that Gauss points lack, over the square of that of the measures.

    Args:
        change: What they lack.
        size: Square of the change of the measures.
        smooth: Change of the measures up to which this is the round-off of the energy, which would
            be divided by a small number.
    """
    if smooth:
        change = ufl.conditional(ufl.gt(size, smooth**2), change, 0.0)
    return change / (size + TINY)


def interval_stress(
    U: Potential, a: Expr, b: Expr, beta: Expr | float, smooth: float = 0.0
) -> Expr:
    """Stress over a sub-interval, eqs. (21), (32), shape (n,).

    Args:
        U: Energy as a function of measures of order one, shape (n,).
        a: The measures at its start.
        b: The measures at its end.
        beta: Share of the jump.
        smooth: Change of the measures up to which Gauss points are exact to round-off.
    """
    increment = b - a
    stress = 0 * a
    for g, weight in GAUSS:
        stress += weight * gradient(U, (a + b) / 2 + g / 2 * increment)
    work, size = ufl.dot(stress, increment), ufl.dot(increment, increment)
    stress += _missing(U(b) - U(a) - work, size, smooth) * increment
    if isinstance(beta, float):
        # no jump at all
        return stress
    return stress + beta / 2 * convex(gradient(U, b) - gradient(U, a), increment)


def distance_stretch(g: Potential, e: Stretch) -> Stretch:
    """A distance over a step as if it were quadratic in time: by its ends and its middle, (1,)."""
    places = e.start, e.start + e.chord / 2 - 3 * e.bow / 4, e.start + e.chord
    return through(*(ufl.as_vector([g(x)]) for x in places))


def through(start: Expr, middle: Expr, end: Expr) -> Stretch:
    """Measures over a step as if they were quadratic, by their ends and their middle, (n,) each."""
    return Stretch(start, end - start, 4 * ((start + end) / 2 - middle) / 3)


def distance_stresses(U: Potential, g: Potential, e: Stretch, alpha: Expr) -> tuple[Expr, Expr]:
    """`S_0` and `S_1` of a potential of a distance over a step, shape (n,) each.

    Args:
        U: Energy as a function of the distance, shape (1,).
        g: The distance as a function of measures of order one, shape (n,).
        e: The measures over the step.
        alpha: Dissipation.
    """
    d = distance_stretch(g, e)
    (s_0,), (s_1,) = path_stresses(U, d, alpha)
    # means of the slopes of chord and bow of the distance by chord and bow of the measures; the
    # bow is 2/3 of what the second half of the step has less than the first, turned about
    rows = [[0 * e.start, 0 * e.start], [0 * e.start, 0 * e.start]]
    for half, sign in ((0.0, 1.0), (0.5, -1.0)):
        for point in (-INNER, INNER):
            tau = half + (1 + point) / 4
            slope = gradient(g, e.start + tau * e.chord + 3 * (tau**2 - tau) * e.bow) / 4
            for row, share in zip(rows, (1.0, -2 / 3 * sign), strict=True):
                row[0] = row[0] + share * slope
                row[1] = row[1] + 3 * (2 * tau - 1) * share * slope
    size = ufl.dot(e.chord, e.chord) + ufl.dot(e.bow, e.bow) + TINY
    for row, change in zip(rows, (d.chord[0], d.bow[0]), strict=True):
        ratio = (change - ufl.dot(row[0], e.chord) - ufl.dot(row[1], e.bow)) / size
        row[0], row[1] = row[0] + ratio * e.chord, row[1] + ratio * e.bow
    (chord, bow) = rows
    return s_0 * chord[0] + s_1 * bow[0], s_0 * chord[1] + s_1 * bow[1]


def interval_jump(U: Potential, a: Expr, b: Expr) -> Expr:
    """Elastic part of `c^2`, eq. (34): work of the stress's jump on that of the measures."""
    return ufl.dot(convex(gradient(U, b) - gradient(U, a), b - a), b - a) / 2


def path_loss(U: Potential, e: Stretch) -> Expr:
    """Energy of the bow, `bow.C bow/2` of eq. (Q5)."""
    return ufl.dot(convex(ufl.dot(curvature(U, e), e.bow), e.bow), e.bow) / 2


def curvature(U: Potential, e: Stretch) -> Expr:
    """Second derivative of the energy in the middle of the chord, shape (n, n)."""
    return tangent(U, e.start + e.chord / 2)


def convex(change: Expr, motion: Expr) -> Expr:
    """A change of a slope, scaled down to zero where it works against the motion.

    Args:
        change: The change, shape (n,).
        motion: The motion that it is due to, shape (n,).
    """
    # a root of zero has no derivative
    sizes = ufl.sqrt(ufl.dot(change, change) * ufl.dot(motion, motion) + 1e-60)
    cosine = ufl.dot(change, motion) / (WHOLE * sizes)
    above = ufl.conditional(ufl.lt(cosine, 1), cosine, 1)
    return ufl.conditional(ufl.gt(cosine, 0), above, 0) * change
