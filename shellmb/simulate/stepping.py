"""How a simulation gets from one accepted state to the next: what its loop asks for."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from shellmb.simulate.problem import Problem
from shellmb.simulate.turns import PrescribedTurns

Arrays = dict[str, npt.NDArray[np.float64]]


class Attempt(NamedTuple):
    """A step that is solved, and not accepted yet.

    Args:
        iterations: Newton iterations.
        dt: Its length; shorter than asked for where something on the way must not be passed.
    """

    iterations: int
    dt: float


class Stepping(Protocol):
    """Gets from one accepted state to the next."""

    @property
    def finished(self) -> bool:
        """Whether the end is reached before the last time."""
        ...

    def attempt(self, t: float, dt: float) -> Attempt:
        """Solve for the state a step ahead; the accepted state stays as it is.

        Args:
            t: Time of the accepted state, s.
            dt: Length of the step, s.

        Raises:
            ConvergenceError: If there is no solution.
        """
        ...

    def accept(self, dt: float) -> None:
        """Make the state of the last attempt the accepted one."""
        ...

    def arrays(self) -> Arrays:
        """Arrays that a restart needs, beside the states of the bodies."""
        ...

    def state(self) -> Any:
        """Numbers that a restart needs."""
        ...

    def restore(self, arrays: Arrays, state: Any, last_dt: float) -> None:
        """Take up what was saved, the bodies having their states.

        Args:
            arrays: As from `arrays`.
            state: As from `state`.
            last_dt: Length of the last step, s.
        """
        ...


class TimeSteps:
    """Steps in time, or in the load parameter of statics.

    Args:
        problem: The system of one step.
    """

    def __init__(self, problem: Problem) -> None:
        self._problem, self._turns = problem, PrescribedTurns(problem)

    @property
    def finished(self) -> bool:
        """Only the last time is the end."""
        return False

    def attempt(self, t: float, dt: float) -> Attempt:
        """Solve for the state at `t + dt`."""
        self._turns.check(t, dt)
        self._problem.prepare(t, dt)
        return Attempt(self._problem.solve(dt), dt)

    def accept(self, dt: float) -> None:
        """Make the solved state the accepted one."""
        self._problem.accept(dt)

    def arrays(self) -> Arrays:
        """States of earlier steps, from which first guesses are made."""
        return self._problem.predictor.arrays()

    def state(self) -> Any:
        """How well they did."""
        return self._problem.predictor.state()

    def restore(self, arrays: Arrays, state: Any, last_dt: float) -> None:
        """Take them up."""
        self._problem.predictor.restore(arrays, state, self._problem.key(last_dt))
