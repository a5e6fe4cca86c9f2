"""Limit points between two states of a path, located by Newton's method.

It begins at the cubic between the states at both ends of the step, and goes along the path to where
the load stands still. All unknowns are in one matrix there: next to a limit point the reduced one
of thin bodies leaves few digits.
"""

import math
from typing import NamedTuple

import numpy as np

from shellmb.arrays import Floats
from shellmb.simulate.paths.branches import PathState, cubic, limit_point
from shellmb.system.direct.linear import Unreduced
from shellmb.system.direct.mumps import new_prefix
from shellmb.system.newton.bordered import Bordered

# rate of the load, relative to those at both ends, at which a point is the limit point: its
# derivative is off by as much, and the load by the square of it
STILL = 1e-7
# error of the unknowns, relative to the step
NEAR = 1e-6
MOST = 12


class Whole:
    """The Jacobian at a state of a path with all unknowns in one matrix.

    Args:
        bordered: Evaluates states of the path.

    Attributes:
        dot: Scalar product over all ranks.
    """

    def __init__(self, bordered: Bordered) -> None:
        system = bordered.system
        self._bordered, self._direct = bordered, Unreduced(system, new_prefix(self))
        self._given, self._found = system.x.duplicate(), system.x.duplicate()
        self.dot = bordered.dot

    def linearise(self, u: Floats, factor: float) -> tuple[Floats, Floats]:
        """Factorise at a state, which the fields take.

        Args:
            u: Owned unknowns.
            factor: Load factor.

        Returns:
            The residual, and the derivative of the unknowns by the load factor.

        Raises:
            ConvergenceError: If the matrix is singular.
        """
        rest, load, v = self._bordered.along(u, factor, None)
        self._check(self._direct.factorise())
        return rest, v - self.inverse(load)

    def inverse(self, b: Floats) -> Floats:
        """`J^-1 b` with the Jacobian factorised last, of owned unknowns."""
        self._given.array[:] = b
        self._check(self._direct.solve(self._given, self._found, True))
        return np.array(self._found.array_r)

    def _check(self, reason: str | None) -> None:
        if reason is not None:
            raise self._bordered.iteration.convergence.error(reason)


class Limit(NamedTuple):
    """A limit point in a solved step.

    Args:
        unknowns: Its unknowns, owned ones.
        factor: Its load factor.
        along: Derivative of the unknowns by the load factor, which is large.
    """

    unknowns: Floats
    factor: float
    along: Floats


def locate(
    ends: tuple[PathState, PathState], unknowns: tuple[Floats, Floats], metric: Floats, whole: Whole
) -> Limit | None:
    """Locate the limit point in a solved step; its Jacobian is the last that is factorised.

    Args:
        ends: States at the start and at the end of the step.
        unknowns: Their unknowns.
        metric: Weights of owned unknowns in squares of arc lengths.
        whole: Linearises on the way.

    Returns:
        The point; None if there is none to be found.

    Raises:
        ConvergenceError: If a matrix on the way is singular.
    """
    (a, b), dot = ends, whole.dot
    normal = metric * a.tangent
    h, point = b.t - a.t, limit_point(a, b)
    s, factor = (point.t - a.t) / h, point.load_factor
    between = cubic(unknowns, (h * a.tangent, h * b.tangent))
    u = np.asarray(np.polyval(between, s), dtype=np.float64)
    # how the rate changes, and the last move with the rate before it
    steep: float = (b.rate - a.rate) / h
    last: tuple[float, float] | None = None
    reference = max(abs(a.rate), abs(b.rate))
    for _ in range(MOST):
        residual, v = whole.linearise(u, factor)
        off, along = whole.inverse(residual), dot(normal, v)
        change = dot(normal, off) / along
        correction = change * v - off
        rate = 1.0 / along
        if not (math.isfinite(rate) and math.isfinite(change)):
            return None
        step = math.sqrt(dot(metric * v, v)) * abs(rate * h)
        error = math.sqrt(dot(metric * correction, correction))
        if abs(rate) <= STILL * reference and error <= NEAR * step:
            # what is left of the residual, on the plane of this point
            return Limit(u, factor + change, v)
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
