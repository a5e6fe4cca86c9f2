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
from shellmb.simulate.paths.arclength import PathSteps
from shellmb.simulate.paths.branches import cubic, limit_point

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
    path: PathSteps,
    unknowns: tuple[Floats, Floats],
    linearise: Linearise,
    inverse: Callable[[Floats], Floats],
) -> tuple[Floats, float, Floats] | None:
    """Locate the limit point in the solved step; its Jacobian is the last that is factorised.

    Args:
        path: The path of the run.
        unknowns: Unknowns at the start and at the end of the step.
        linearise: Factorises at unknowns and a load factor.
        inverse: Multiplies with the inverse of the Jacobian last factorised.

    Returns:
        Unknowns, load factor, and the derivative of the unknowns by it; None if there is none.
    """
    a, b, normal, dot = path.here, path.ahead, path.normal, path.bordered.dot
    h, point = b.t - a.t, limit_point(a, b)
    s, factor = (point.t - a.t) / h, point.load_factor
    between = cubic(unknowns, (h * a.tangent, h * b.tangent))
    u = np.asarray(np.polyval(between, s), dtype=np.float64)
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
        step = path.size_of(v) * abs(rate * h)
        if abs(rate) <= STILL * reference and path.size_of(correction) <= NEAR * step:
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
