"""Limit points between two states of a path, where limit loads have derivatives in closed form.

A limit load moves with a parameter by `f' = -(x.dR/dp) / (x.dR/df)`, `x` being the left null vector
of the Jacobian there: how the point moves does not matter. The state is found by Newton's method
from the cubic between the states of the run; what the run reports as its load is that cubic's.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from shellmb.arrays import Floats
from shellmb.simulate.paths.branches import PathState, limit_point

# rate of the load, relative to those at both ends, at which a point is the limit point: its
# derivative is off by as much
STILL = 1e-7
# error of the unknowns, relative to the step
NEAR = 1e-6
MOST = 12

# factorises the Jacobian at unknowns and a load factor; gives the residual there, and the
# derivative of the unknowns by the load factor
Linearise = Callable[[Floats, float], tuple[Floats, Floats]]


def locate(
    ends: tuple[PathState, PathState],
    unknowns: tuple[Floats, Floats],
    normal: Floats,
    weight: Floats,
    dot: Callable[[Floats, Floats], float],
    linearise: Linearise,
    inverse: Callable[[Floats], Floats],
) -> tuple[Floats, float, Floats] | None:
    """Locate the limit point between two states; its Jacobian is the last that is factorised.

    Args:
        ends: The states.
        unknowns: Their unknowns.
        normal: Normal of planes across the path.
        weight: Weights of displacements among the unknowns.
        dot: Scalar product over all ranks.
        linearise: Factorises at unknowns and a load factor.
        inverse: Multiplies with the inverse of the Jacobian last factorised.

    Returns:
        Unknowns, load factor, and the derivative of the unknowns by it; None if there is none.
    """
    a, b = ends
    h, point = b.t - a.t, limit_point(a, b)
    s, factor = (point.t - a.t) / h, point.load_factor
    u = _between(s, unknowns, (h * a.tangent, h * b.tangent))
    # how the rate changes, and the last move with the rate before it
    steep: float = (b.rate - a.rate) / h
    last: tuple[float, float] | None = None
    reference = max(abs(a.rate), abs(b.rate))
    for _ in range(MOST):
        residual, v = linearise(u, factor)
        off, along = inverse(residual), dot(normal, v)
        change = dot(normal, off) / along
        correction = change * v - off
        rate = 1.0 / along
        if not (math.isfinite(rate) and math.isfinite(change)):
            return None
        wrong = abs(dot(normal, correction)) + np.sqrt(
            dot(normal * correction, normal * correction)
        )
        size = np.sqrt(dot(normal * v, normal * v)) * abs(rate) * abs(h)
        if abs(rate) <= STILL * reference and wrong <= NEAR * size:
            return u, factor, v
        if last is not None and rate != last[1]:
            steep = (rate - last[1]) / last[0]
        move = -rate / steep
        if not abs(move) <= abs(h):
            return None
        u, factor, last = (
            u + correction + (move * rate) * v,
            factor + change + move * rate,
            (move, rate),
        )
    return None


def _between(s: float, values: tuple[Floats, Floats], slopes: tuple[Floats, Floats]) -> Floats:
    """Cubic that has two values and slopes, at a part of the way."""
    rest = 1.0 - s
    return np.asarray(
        rest**2 * ((1.0 + 2.0 * s) * values[0] + s * slopes[0])
        + s**2 * ((1.0 + 2.0 * rest) * values[1] - rest * slopes[1])
    )
