"""First guess of a step: the steps before it, extrapolated; directors stay on the sphere.

Steps may differ in length. In schemes that are quadratic in time each unknown has another one that
tells its slope: velocities those of positions and directors, first moments of forces those of
their means. Both are extrapolated by Hermite's polynomials. Guesses of forces are a fourth as far
off as those from means alone (three links, 15.6 ms: 2 % in place of 8 %), those of positions a
tenth.
"""

import math
from collections.abc import Hashable, Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

from petsc4py import PETSc

import numpy as np
import numpy.typing as npt

from shellmb.arrays import Floats, Ints
from shellmb.restart import Restartable, constant
from shellmb.system.newton.iteration import Iteration

# so many states are kept: polynomials of degree 0, 1, 2, 3 in time
STATES = 4
# of how many of the newest states a polynomial has the values, and of how many the slopes; and
# where there are no slopes
KNOTS = ((1, 0), (1, 1), (1, 2), (2, 2), (3, 3))
PLAIN = ((1, 0), (2, 0), (3, 0), (4, 0))
# error of guesses without slopes, relative to the size of bodies, from which on no motion is
# continued: bodies turn by as much as a radian
FAR = 0.5
# share of the last error in the mean that tells which polynomial does best
MEMORY = 0.5

type Times = Sequence[float] | Floats


class _Errors(Restartable):
    """Mean errors of guesses so far: those of several polynomials, of which more become possible.

    Attributes:
        mean: They, of so many as there were guesses of.
    """

    remembered = ("mean",)

    def __init__(self) -> None:
        self.mean: list[float] = []

    def best(self, default: int, bound: float = math.inf) -> int:
        """Number of the polynomial that does best; the default where none is within a bound."""
        least = min(self.mean, default=bound)
        return self.mean.index(least) if least < bound else default

    def add(self, found: list[float]) -> None:
        """Add the errors of a step."""
        both = zip(found, self.mean, strict=False)
        self.mean = [MEMORY * e + (1 - MEMORY) * old for e, old in both] + found[len(self.mean) :]


class Pairs(NamedTuple):
    """Unknowns of which some tell the slope in time of others.

    Args:
        values: These others, by their places.
        slopes: Unknowns that tell their slopes.
        times: Change in a step at that slope over the unknown that tells it.
    """

    values: Ints
    slopes: Ints
    times: Floats


class Predictor(Restartable):
    """Extrapolates the unknowns of steps that continue one another.

    Which polynomial does best depends on the motion: high degrees do for smooth ones, low degrees
    where stiff parts oscillate. The one with the smallest error in the steps before is taken, by
    itself of what moves and of forces, whose errors tell nothing of each other.

    Args:
        iteration: Knows the directors, and measures errors as it measures updates.
        pairs: Owned unknowns: either each of them is in a pair, or none.

    Attributes:
        key: What the steps so far have in common; None: there are none.
    """

    remembered = ("_past", "_times", "_motion", "_forces")

    def __init__(self, iteration: Iteration, pairs: Pairs) -> None:
        self._nodes, self._convergence = iteration.nodes, iteration.convergence
        self._pairs = pairs
        moving = iteration.convergence.moving
        of_pairs = pairs.slopes[np.isin(pairs.values, moving)]
        # with the slopes of what moves
        self._moving = np.union1d(moving, of_pairs)
        self._guess = iteration.system.x.duplicate()
        owned = iteration.system.numbering.owned
        self._table = np.zeros((len(KNOTS), owned))
        # states have what is in pairs side by side: first the values, then the slopes
        ordered = np.concatenate([pairs.values, pairs.slopes])
        self._order = ordered if len(ordered) else np.arange(owned)
        self._back = np.argsort(self._order)
        # change in a step over the unknown that tells it; one of values
        ones = np.ones(owned - len(pairs.times))
        self._divisors = np.concatenate([ones, pairs.times])[self._back]
        # of all ranks alike
        self._has_pairs = bool(iteration.system.comm.allreduce(len(pairs.values)))
        every = KNOTS if self._has_pairs else PLAIN
        # how many of these, by the number of states
        self._possible = [sum(max(k) <= known for k in every) for known in range(STATES + 1)]
        self.clear()

    def clear(self) -> None:
        """Forget the past: motion does not continue smoothly."""
        # the last states, the newest first, shape (k, n)
        self._past = constant(np.zeros((0, self._table.shape[1])))
        # times from the first of them to each, s
        self._times: tuple[float, ...] = ()
        self._motion, self._forces = _Errors(), _Errors()
        self.key: Hashable = None
        # length of the step that the table is foreseen for, s
        self._ahead: float | None = None

    def guess(self, key: Hashable, dt: float) -> PETSc.Vec | None:
        """Unknowns at the end of the next step; None if the past does not tell.

        Args:
            key: What steps have in common that continue one another.
            dt: Its length, s.
        """
        if not len(self._past) or key != self.key:
            return None
        rows = self._foresee(dt)
        default, bound = (1, math.inf) if self._has_pairs else (0, FAR)
        forces, motion = self._forces.best(0), self._motion.best(default, bound)
        guess = self._guess.array
        guess[:] = rows[forces]
        if motion != forces:
            guess[self._moving] = rows[motion, self._moving]
        self._nodes.normalise(self._guess)
        return self._guess

    def _foresee(self, dt: float) -> Floats:
        """Unknowns a step ahead by each of the polynomials that are possible, a row each.

        Args:
            dt: Length of the step, s.
        """
        known = len(self._past)
        rows = self._table[: self._possible[known]]
        if self._ahead == dt:
            return rows
        self._ahead, times = dt, tuple(t / dt for t in self._times)
        if self._has_pairs:
            # of each state a row of values, and one of slopes
            past = self._past.reshape(2 * known, len(self._pairs.times))
            ahead = (knot_weights(times, dt) @ past).reshape(rows.shape)
            np.take(ahead, self._back, axis=1, out=rows, mode="clip")
            rows /= self._divisors
        else:
            rows[:] = plain_weights(times) @ self._past
        return rows

    def accept(self, x: PETSc.Vec, key: Hashable, dt: float) -> None:
        """Remember the solution of a step.

        Args:
            x: Unknowns.
            key: What steps have in common that continue one another.
            dt: Length of the step, s.
        """
        if key != self.key:
            self.clear()
        self.key = key
        new = x.array_r
        if len(self._past):
            wrong = self._foresee(dt)
            wrong -= new
            motion, forces = self._convergence.sizes(new, wrong).T.tolist()
            self._motion.add(motion)
            self._forces.add(forces)
        ordered = new[self._order]
        ordered[len(ordered) - len(self._pairs.times) :] *= self._pairs.times / dt
        self._past = constant(np.concatenate([ordered[None], self._past[: STATES - 1]]))
        self._times = (0.0, *(t - dt for t in self._times))[:STATES]
        self._ahead = None

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up a saved past, which continues steps with the `key` that is then set."""
        super().restore(state)
        self._ahead = None


def hermite_weights(values: Times, slopes: Times, wanted: npt.NDArray[Any]) -> Floats:
    """Weights of values and of slopes at some times in what is wanted of their polynomial.

    Args:
        values: Times of the values.
        slopes: Times of the slopes.
        wanted: What the powers of time, from 0 on, contribute to it, shape (p, ...): as many as
            there are values and slopes.

    Returns:
        Of the values, then of the slopes, shape (p, ...).
    """
    powers = np.arange(len(wanted))
    at, along = (np.array(times, dtype=float)[:, None] for times in (values, slopes))
    rows = [at**powers, powers * along ** np.maximum(powers - 1, 0)]
    return np.asarray(np.linalg.solve(np.concatenate(rows).T, wanted))


@lru_cache
def plain_weights(times: tuple[float, ...]) -> Floats:
    """Weights of known states in polynomials through the newest one, two, ... of them.

    Args:
        times: As of `knot_weights`, n of them.

    Returns:
        For the state a step ahead, row k for the polynomial of degree k, shape (n, n).
    """
    return np.ascontiguousarray(knot_weights(times, 1.0, PLAIN)[::2, ::2])


@lru_cache
def knot_weights(
    times: tuple[float, ...], dt: float, every: tuple[tuple[int, int], ...] = KNOTS
) -> Floats:
    """Weights of known states and their slopes in Hermite's polynomials.

    Args:
        times: Times of n states from the newest, in steps to come, the newest first.
        dt: Length of the step to come, in the unit of time of the slopes.
        every: Knots of the polynomials.

    Returns:
        Of each polynomial a row for the state a step ahead, and one for its slope times the step,
        shape (2 p, 2 n): as many as there are states for; of each state the weight of its value,
        and of its slope.
    """
    n, found = len(times), []
    for values, slopes in (knots for knots in every if max(knots) <= n):
        powers = np.arange(values + slopes)
        ahead = np.stack([np.ones(len(powers)), powers], axis=1)
        solved = hermite_weights(times[:values], times[:slopes], ahead)
        wide: Any = np.zeros((n, 2, 2))
        wide[:values, 0], wide[:slopes, 1] = solved[:values], solved[values:] * dt
        found.append(wide.reshape(2 * n, 2))
    return np.ascontiguousarray(np.concatenate([both.T for both in found]))
