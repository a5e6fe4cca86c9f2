"""Prescribed rotations: what a step can tell of them.

Positions and directors tell an angle up to whole turns only. A driver that turns by half a turn or
more in a step, or in one of its sub-intervals, would do another work than its torque does over the
way that the bodies take (`forms.coordinates`), and they would turn the other way round.
"""

from __future__ import annotations

import math

from mpi4py import MPI

import numpy as np

from shellmb.errors import ConvergenceError
from shellmb.model.body import FixedDofs, PrescribedTurn
from shellmb.schemes.base import Levels
from shellmb.simulate.problem import Problem


class PrescribedTurns:
    """Looks at the drivers and driven supports of a scene before each step.

    Args:
        problem: The functions of all bodies.
    """

    def __init__(self, problem: Problem) -> None:
        self._scheme, self._comm = problem.scheme, problem.model.comm
        self._turns: list[tuple[PrescribedTurn, FixedDofs, Levels]] = [
            (fixed.turn, fixed, problem.levels[body.name])
            for body in problem.model.bodies
            for fixed in body.fixed
            if fixed.turn is not None and not problem.scheme.linear
        ]

    def check(self, t: float, dt: float) -> None:
        """See whether a step can be made; collective.

        Args:
            t: Time at its start, s.
            dt: Its length, s.

        Raises:
            ConvergenceError: If something turns too far; names it, its angle and the step for it.
        """
        for turn, fixed, levels in self._turns:
            angle = abs(float(turn.angle(t + dt)) - float(turn.angle(t)))
            if turn.unknown:
                angle = max(angle, self._inside(fixed, levels, t, dt))
            if angle >= math.pi:
                raise ConvergenceError(
                    f"{turn.who} turns by {angle:.4g} rad in a step of {dt:.3g} s; it must be less "
                    f"than pi: use dt < {dt * math.pi / angle:.2g} s if it turns steadily; a jump "
                    "of its angle no step can follow"
                )

    def _inside(self, fixed: FixedDofs, levels: Levels, t: float, dt: float) -> float:
        """Largest angle of the sub-intervals before and after a jump, rad."""
        stage = self._scheme.dissipation()[1]
        if stage is None:
            return 0.0
        rates = {name: function.x.array[fixed.dofs] for name, function in levels.rates.items()}
        middle = self._scheme.prescribed(stage, fixed.value, t, dt, rates)
        states = [fixed.value(t), middle, fixed.value(t + dt)]
        largest = float(np.max(np.abs(np.diff(states, axis=0)), initial=0.0))
        return largest if self._comm.size == 1 else self._comm.allreduce(largest, op=MPI.MAX)
