"""Constraints that were left out as redundant: they have to hold all the same.

Which constraints others imply follows from the velocities that they allow at the start. At a
singular position, the change point of a parallelogram say, that is more of them than anywhere else:
what was left out there is missing as soon as the bodies have moved.
"""

from __future__ import annotations

import numpy as np
from dolfinx import fem

from shellmb.errors import ConvergenceError
from shellmb.model.joints.joints import JointGroup
from shellmb.preprocessing.constraint_analysis.redundancy import worst_of
from shellmb.simulate.problem import Problem

# a joint whose constraint is implied by others stays closed to round-off: positions relative to the
# scene's length, directions by the sine of their angle
OPENED = 1e-6


class DroppedConstraints:
    """Watches them; nothing to do where none were left out.

    Args:
        problem: The functions of all bodies.
    """

    def __init__(self, problem: Problem) -> None:
        self._problem, self._comm = problem, problem.model.comm
        groups = problem.model.mechanism.groups
        # in linear statics and dynamics positions close joints to first order only
        self._watched = [
            group for group in groups if not (problem.scheme.linear or np.all(group.allowed))
        ]

    def check(self, t: float) -> None:
        """Look at the state at the end of the step just solved; collective.

        Args:
            t: Time at its start, s.

        Raises:
            ConvergenceError: If a joint opens; names it.
        """
        if not self._watched:
            return
        last, levels = self._problem.last, self._problem.levels
        worst = max(_worst(group, levels[group.name].unknown[last]) for group in self._watched)
        apart, joint, said = max(self._comm.allgather(worst)) if self._comm.size > 1 else worst
        if apart > OPENED:
            raise ConvergenceError(
                f"t = {t:g}: joint '{joint}' opens by {said}: one of its constraints "
                "was left out as redundant, which it is at the position of the start only, a "
                "singular one; begin at another position, or use joints with fewer constraints"
            )


def _worst(group: JointGroup, q: fem.Function) -> tuple[float, str, str]:
    """Largest violation of what was left out of the joints that act, on this rank."""
    return worst_of(group, np.where(group.allowed[group.nodes.item], 0.0, group.apart(q)))
