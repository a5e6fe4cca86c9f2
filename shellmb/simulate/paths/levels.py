"""Load levels on which steps of a path land: where a step first passes one, and how to get there.

Between two states the load factor is close to the cubic of the arc length that has their values and
rates. It tells where the level is, also where the load only goes there and turns round within the
step; the secant rule, kept between states on either side of the level, does the rest.

Limit points between two states of a path, located by Newton's method.

It begins at the cubic between the states at both ends of the step, and goes along the path to where
the load stands still. All unknowns are in one matrix there: next to a limit point the reduced one
of thin bodies leaves few digits.
"""

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import ConvergenceError
from shellmb.simulate.paths.branches import PathState, Trial, cubic, limit_point, load_cubic, roots
from shellmb.system.direct.linear import Unreduced
from shellmb.system.direct.mumps import new_prefix
from shellmb.system.newton.bordered import Bordered

# a load factor is on a level when it is as near to it, relative to it, as Newton's method gets
REACHED = 1e-9
# how far the cubic may be off where the load turns round, relative to what it does in the step
CUBIC = 0.05
# solutions at most to get there
TRIALS = 40

# rate of the load, relative to those at both ends, at which a point is the limit point: its
# derivative is off by as much, and the load by the square of it
STILL = 1e-7
# error of the unknowns, relative to the step
NEAR = 1e-6
MOST = 12


class Crossing(NamedTuple):
    """Crossing of a level by a step.

    Args:
        level: The load factor.
        share: Part of the step behind which it is looked for first, in (0, 1].
        sure: Whether the ends of the step lie on either side of the level. If not, `share` is where
            the load turns round, beyond the level or next to it.
    """

    level: float
    share: float
    sure: bool


def reached(factor: float, level: float) -> bool:
    """Decide whether a load factor is on a level, to the accuracy of Newton's method."""
    return abs(factor - level) <= REACHED * abs(level)


def _begin(a: PathState, level: float) -> float:
    """On which side of a level, and how far, a step begins; on it: the side to which it leaves."""
    begin = a.factor - level
    return math.copysign(REACHED * level, a.rate) if reached(a.factor, level) else begin


def _crossing(a: PathState, b: PathState, level: float) -> Crossing | None:
    """Find where a step passes a level, if it does."""
    if reached(b.factor, level):
        return Crossing(level, 1.0, True)
    begin, end, cubic = _begin(a, level), b.factor - level, load_cubic(a, b)
    if begin * end < 0:
        cubic[-1] = begin
        line = begin / (begin - end)
        return Crossing(level, min(roots(cubic), default=line), True)
    # where the load turns round the cubic is as good as the step is short
    unsure = CUBIC * max(abs(a.factor - b.factor), abs(begin), abs(end))
    for share in roots(np.polyder(cubic)):
        if math.copysign(1.0, begin) * (np.polyval(cubic, share) - level) < unsure:
            return Crossing(level, share, False)
    return None


def _turn(a: PathState, b: PathState, level: float, shorter: Trial) -> PathState | None:
    """A state beyond a level where the load goes there and turns round; None if it does not."""
    begin, low, high = math.copysign(1.0, _begin(a, level)), a, b
    for _ in range(TRIALS):
        cubic = load_cubic(low, high)
        share = min(roots(np.polyder(cubic)), default=0.5)
        state = shorter(low.t + share * (high.t - low.t) - a.t)
        missing = begin * (state.factor - level)
        if missing <= 0 or reached(state.factor, level):
            return state
        # what the cubic was wrong by tells whether the next one may find more
        wrong = abs(state.factor - float(np.polyval(cubic, share)))
        if missing > wrong or missing > begin * (low.factor - level):
            return None
        low, high = (state, high) if state.rate * low.rate > 0 else (low, state)
    return None


def crossings(a: PathState, b: PathState, levels: Iterable[float]) -> list[Crossing]:
    """Find where a step first passes or reaches some levels, in their order along it.

    Args:
        a: Start of the step; a level that it stands on counts only if it comes back to it.
        b: Its end.
        levels: Load factors.
    """
    found = [crossing for level in levels if (crossing := _crossing(a, b, level)) is not None]
    return sorted(found, key=lambda crossing: crossing.share)


def land(a: PathState, b: PathState, crossing: Crossing, shorter: Trial) -> bool:
    """Shorten a step until it ends on a level.

    Args:
        a: Its start.
        b: Its end, the state last solved for.
        crossing: Where it passes the level.
        shorter: Solves for the state at another arc length behind `a`.

    Returns:
        Whether the state last solved for is on the level; if not, the load turns round before it.

    Raises:
        ConvergenceError: If a state between does not converge, or the search does not end.
    """
    level, begin = crossing.level, _begin(a, crossing.level)
    if not crossing.sure:
        top = _turn(a, b, level, shorter)
        again = None if top is None else _crossing(a, top, level)
        if top is None or again is None:
            return False
        b, crossing = top, again
    low, high = 0.0, b.t - a.t
    last, length = (high, b.factor - level), crossing.share * high
    if reached(b.factor, level):
        return True
    near = False
    for _ in range(TRIALS):
        missing = shorter(length).factor - level
        # one more solution by the secant is as near as Newton's method gets: motions start there
        before, near = near, reached(level + missing, level)
        if near and (before or not missing):
            return True
        if begin * missing > 0:
            low = length
        else:
            high = length
        steep = (missing - last[1]) / (length - last[0]) if length != last[0] else 0.0
        last = (length, missing)
        guess = length - missing / steep if steep else low
        length = guess if low < guess < high else (low + high) / 2
    raise ConvergenceError(
        f"the load factor {level:g} could not be reached from {a.factor:g}; try smaller steps"
    )


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
