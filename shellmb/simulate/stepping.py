"""Stepping from one accepted state to the next, for the loop of a simulation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

from shellmb.arrays import Floats
from shellmb.model.rank_consistency import TimesAlike
from shellmb.restart import Restartable
from shellmb.simulate.predictor import Predictor
from shellmb.simulate.problem import Problem
from shellmb.simulate.rotation_per_step import RotationPerStep, turned
from shellmb.simulate.stepsize.errors import StepErrors

Arrays = dict[str, Floats]

# angle by which a load turns a director [rad], and iterations that it takes, beyond which Newton's
# method may have come to an equilibrium that the body does not come to: a strip that is rolled up
# at once may leave its plane. Loads that end in the same one take up to 18
SAFE_TURN, SAFE_ITERATIONS = 2.5, 24


@dataclass(frozen=True)
class StepInfo:
    """The step just solved.

    Args:
        t: Time at its start, s.
        dt: Its length, s.
        iterations: Newton iterations.
        jump: Largest jump between the states j and i relative to the parts' scales; None where the
            scheme has none.
        error: Estimate of its error (`errors`); None without a tolerance.
    """

    t: float
    dt: float
    iterations: int
    jump: float | None
    error: float | None = None


class Attempt(NamedTuple):
    """A step that is solved, and not accepted yet.

    Args:
        iterations: Newton iterations.
        dt: Its length; shorter than requested if an event lies within it.
        error: Estimate of its error (`errors`), where the scene has a tolerance for it; of a load
            how far it is from where Newton's method is sure to end, one being safe.
    """

    iterations: int
    dt: float
    error: float | None = None


class TimeSteps(Restartable):
    """Steps in time, or in the load parameter of statics.

    Args:
        problem: The system of one step.

    Attributes:
        finished: Whether the end is reached before the last time.
    """

    remembered = ("_guesses", "_errors")
    finished = False

    def __init__(self, problem: Problem) -> None:
        self._problem, self._turns = problem, RotationPerStep(problem)
        self._loads = not problem.scheme.dynamic and not problem.scheme.linear
        self._times = TimesAlike(problem.model.scene, problem.model.comm)
        controlled = problem.model.scene.step_control.step_error is not None
        self._errors = StepErrors(problem) if controlled else None

    def attempt(self, t: float, dt: float) -> Attempt:
        """Solve for the state a step ahead; the accepted state stays as it is.

        Args:
            t: Time of the accepted state, s.
            dt: Length of the step, s.

        Raises:
            ConvergenceError: If there is no solution.
        """
        self._times.check(t, dt)
        self._turns.check(t, dt)
        self._problem.prepare(t, dt)
        iterations = self._problem.solve(dt)
        self._turns.followed(dt)
        if self._loads:
            # how far off Newton's method may have gone, in parts of what is safe
            astray = max(turned(self._problem) / SAFE_TURN, iterations / SAFE_ITERATIONS)
            return Attempt(iterations, dt, astray)
        return Attempt(iterations, dt, None if self._errors is None else self._errors.estimate(dt))

    def accept(self, dt: float) -> None:
        """Make the solved state the accepted one."""
        self._problem.accept(dt)
        if self._errors is not None:
            self._errors.accept(dt)

    def forget(self, velocities: bool) -> None:
        """The motion does not continue smoothly: what went before tells nothing.

        Args:
            velocities: Whether they have jumped; if not, forces or their rates have.
        """
        if velocities:
            self._problem.predictor.clear()
        if self._errors is not None:
            self._errors.forget()

    @property
    def _guesses(self) -> Predictor:
        return self._problem.predictor

    def restore(self, state: Any | None) -> None:
        """Take up states of earlier steps; with None they begin anew."""
        if state is None:
            self.forget(velocities=True)
            return
        self._guesses.restore(state["guesses"])
        self._guesses.key = self._problem.switches
        if self._errors is not None and state["errors"] is not None:
            self._errors.restore(state["errors"])
