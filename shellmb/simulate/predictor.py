"""First guess of a step: the steps before it, extrapolated; directors stay on the sphere.

Steps may differ in length. Velocities times the step, which are unknowns of some schemes, are kept
as velocities.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping, Sequence
from functools import lru_cache

from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.native.operations import operations
from shellmb.system.newton.iteration import Iteration

# so many states are kept: polynomials of degree 0, 1, 2, 3 in time
STATES = 4
# share of the last error in the mean that tells which degree does best
MEMORY = 0.5


class Predictor:
    """Extrapolates the unknowns of steps that continue one another.

    Which degree does best depends on the motion: high degrees do for smooth ones, low degrees where
    stiff parts oscillate. The one with the smallest error in the steps before is taken.

    Args:
        iteration: Knows the directors, and measures errors as it measures updates.
        rates: Places of the owned unknowns that are velocities times the step.
    """

    def __init__(self, iteration: Iteration, rates: Ints) -> None:
        self._nodes, self._convergence = iteration.nodes, iteration.convergence
        self._rates, self._operations = rates, operations()
        self._guess = iteration.system.x.duplicate()
        self._guesses = np.zeros((STATES, iteration.system.numbering.owned))
        self.clear()

    def clear(self) -> None:
        """Forget the past: motion does not continue smoothly."""
        # the last states, the newest first, shape (k, n): a new array with each step, so that who
        # was given one may keep it
        self._past = np.zeros((0, self._guesses.shape[1]))
        # times from the first of them to each, s
        self._times: tuple[float, ...] = ()
        self._errors: list[float] = []
        self._key: Hashable = None

    def guess(self, key: Hashable, dt: float) -> PETSc.Vec | None:
        """Unknowns at the end of the next step; None if the past does not tell.

        Args:
            key: What steps have in common that continue one another.
            dt: Its length, s.
        """
        known = len(self._past)
        if not known or key != self._key:
            return None
        degree = self._errors.index(min(self._errors)) if self._errors else 0
        self._foresee(degree, dt, None, self._guess.array[None])
        self._nodes.normalise(self._guess)
        return self._guess

    def _foresee(self, first: int, dt: float, less: Floats | None, to: Floats) -> None:
        """Unknowns a step ahead, by polynomials of a degree and the next ones.

        Args:
            first: The degree.
            dt: Length of the step, s.
            less: What is subtracted.
            to: Gets them, shape (degrees, n).
        """
        rows = weights(tuple(t / dt for t in self._times))
        self._operations.foresee(first, rows, self._past, (self._rates, dt), less, to)

    def accept(self, x: PETSc.Vec, key: Hashable, dt: float) -> None:
        """Remember the solution of a step.

        Args:
            x: Unknowns.
            key: What steps have in common that continue one another.
            dt: Length of the step, s.
        """
        if key != self._key:
            self.clear()
        self._key = key
        new, known = x.array_r.copy(), len(self._past)
        if known:
            wrong = self._guesses[:known]
            self._foresee(0, dt, new, wrong)
            found = self._convergence.sizes(new, wrong).tolist()
            old = self._errors
            self._errors = [
                MEMORY * error + (1 - MEMORY) * before
                for error, before in zip(found, old, strict=False)
            ]
            self._errors += found[len(old) :]
        new[self._rates] /= dt
        self._past = np.vstack([new, self._past[: STATES - 1]])
        self._times = (0.0, *(t - dt for t in self._times))[:STATES]

    def arrays(self) -> dict[str, Floats]:
        """What a restart needs of the past: unknowns that this rank owns."""
        return {str(k): state for k, state in enumerate(self._past)}

    def state(self) -> dict[str, list[float]]:
        """The other part of it: when they were, and how each degree has done."""
        return {"times": list(self._times), "errors": list(self._errors)}

    def restore(
        self,
        arrays: Mapping[str, Floats],
        state: Mapping[str, Sequence[float]],
        key: Hashable,
    ) -> None:
        """Take up a saved past.

        Args:
            arrays: As from `arrays`.
            state: As from `state`.
            key: That of the step to come.
        """
        states = [arrays[str(k)] for k in range(len(arrays))]
        self._past = np.array(states).reshape(-1, self._guesses.shape[1])
        self._times, self._errors = tuple(state["times"]), list(state["errors"])
        self._key = key


@lru_cache
def weights(times: tuple[float, ...]) -> Floats:
    """Weights of known states in polynomials through the newest one, two, ... of them.

    Args:
        times: Their times from the newest, in steps to come, the newest first.

    Returns:
        For the state a step ahead, row k for the polynomial of degree k, shape (n, n).
    """
    found = np.zeros((len(times), len(times)))
    for degree in range(len(times)):
        through = times[: degree + 1]
        for i, own in enumerate(through):
            others = (s for k, s in enumerate(through) if k != i)
            found[degree, i] = math.prod((1 - s) / (own - s) for s in others)
    found.flags.writeable = False
    return found
