"""Load levels on which steps of a path land: where a step first passes one, and how to get there.

Between two states the load factor is close to the cubic of the arc length that has their values and
rates. It tells where the level is, also where the load only goes there and turns round within the
step; the secant rule, kept between states on either side of the level, does the rest.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from shellmb.errors import ConvergenceError
from shellmb.simulate.paths.branches import PathState, load_cubic, real_between

# a load factor is on a level when it is as near to it, relative to it, as Newton's method gets
REACHED = 1e-9
# how far the cubic may be off where the load turns round, relative to what it does in the step
CUBIC = 0.05
# solutions at most to get there
TRIALS = 40


@dataclass(frozen=True)
class Crossing:
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
        return Crossing(level, min(real_between(cubic), default=line), True)
    # where the load turns round the cubic is as good as the step is short
    unsure = CUBIC * max(abs(a.factor - b.factor), abs(begin), abs(end))
    for share in real_between(np.polyder(cubic)):
        if math.copysign(1.0, begin) * (np.polyval(cubic, share) - level) < unsure:
            return Crossing(level, share, False)
    return None


def _turn(
    a: PathState, b: PathState, level: float, shorter: Callable[[float], PathState]
) -> PathState | None:
    """A state beyond a level where the load goes there and turns round; None if it does not."""
    begin, low, high = math.copysign(1.0, _begin(a, level)), a, b
    for _ in range(TRIALS):
        cubic = load_cubic(low, high)
        share = min(real_between(np.polyder(cubic)), default=0.5)
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


def land(
    a: PathState, b: PathState, crossing: Crossing, shorter: Callable[[float], PathState]
) -> bool:
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
