"""Rotations of drivers and joints: what a step can tell of them.

Positions and directors tell an angle up to whole turns only. A driver that turns by half a turn or
more in a step, or in one of its sub-intervals, would do another work than its torque does over the
way that the bodies take (`forms.constraints.coordinates`), and they would turn the other way round.
A joint whose rate is half a turn a step or more would lose whole turns.
"""

import math
from collections.abc import Callable

from mpi4py import MPI

import numpy as np
from dolfinx import fem

from shellmb.arrays import Floats
from shellmb.errors import ConvergenceError
from shellmb.model.body import FixedDofs, PrescribedTurn
from shellmb.model.joints.coordinates import CoordinateGroup
from shellmb.model.massless import gathered
from shellmb.preprocessing.bodyfields import body_directors
from shellmb.schemes.base import END, Levels
from shellmb.simulate.problem import Problem


def turned(problem: Problem) -> float:
    """Largest angle by which the step just solved turns a director, rad; collective.

    Args:
        problem: The functions of all bodies.
    """
    least = 1.0
    for body in problem.model.bodies:
        found, levels = body_directors(body), problem.levels[body.name]
        if found is None:
            continue
        before, now = (
            (found.reference + f.x.array[found.dofs].reshape(found.reference.shape))
            for f in (levels.q, levels.unknown[END])
        )
        least = min(least, float(np.min(np.vecdot(before, now), initial=1.0)))
    return math.acos(max(problem.model.comm.allreduce(least, op=MPI.MIN), -1.0))


class RotationPerStep:
    """Looks at drivers, driven supports, and rotations of joints before each step.

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
        mechanism, scheme = problem.model.mechanism, problem.scheme
        follows = scheme.dynamic and not scheme.linear
        driven = {(c.name, c.kind) for c in mechanism.drivers.values()}
        self._free: list[tuple[CoordinateGroup, Levels, Floats]] = []
        self._names = list[str]()
        for group in mechanism.coordinate_groups:
            # of joints with several angles the mean: single directors tremble after an impact
            owners = [c.joint or c.name for c in group.coordinates]
            names = [n for n in dict.fromkeys(owners) if (n, group.kind) not in driven]
            if group.kind == "rotation" and names and follows:
                shares = [
                    [c.share * (o == n) for n in names]
                    for c, o in zip(group.coordinates, owners, strict=True)
                ]
                self._free.append((group, problem.levels[group.name], np.array(shares)))
                self._names += names

    def check(self, t: float, dt: float) -> None:
        """See whether a step can be made; collective.

        Args:
            t: Time at its start, s.
            dt: Its length, s.

        Raises:
            ConvergenceError: If something turns too far; names it, its angle and the step for it.
        """
        if self._free:
            self._follow(dt)
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

    def _follow(self, dt: float) -> None:
        """See whether joints turn slowly enough to tell by how much; collective."""
        self._before = self._read(lambda levels: levels.q)
        self._rates = self._read(lambda levels: levels.rates["v"])
        fastest = int(np.argmax(np.abs(self._rates)))
        rate = abs(float(self._rates[fastest]))
        if rate * dt >= math.pi:
            raise ConvergenceError(
                f"joint '{self._names[fastest]}' turns by {rate * dt:.4g} rad in a step of "
                f"{dt:.3g} s; it must be less than pi: use dt < {math.pi / rate:.2g} s"
            )

    def followed(self, dt: float) -> None:
        """See whether joints have turned as they were about to; collective.

        Beyond what a scheme follows its equations have other solutions, which turn bodies back.

        Args:
            dt: Length of the step that is solved, s.

        Raises:
            ConvergenceError: If one differs by half a turn; names it.
        """
        if not self._free:
            return
        made = self._read(lambda levels: levels.unknown[END]) - self._before
        wrong = np.abs(made - dt * self._rates)
        worst = int(np.argmax(wrong))
        if wrong[worst] >= math.pi:
            raise ConvergenceError(
                f"joint '{self._names[worst]}' turns by {made[worst]:.4g} rad in a step of "
                f"{dt:.3g} s, where its rate at the start makes {dt * self._rates[worst]:.4g} rad; "
                "they must differ by less than pi: use a smaller dt"
            )

    def _read(self, function: Callable[[Levels], fem.Function]) -> Floats:
        """Values of the rotations of joints that are not driven, the same on all ranks."""
        found = []
        for group, levels, shares in self._free:
            values = function(levels).x.array[group.mixed.dofs["x"]]
            found.append(gathered(group.nodes, values) @ shares)
        return np.concatenate(found)

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
