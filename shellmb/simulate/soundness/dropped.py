"""Constraints that were left out as redundant: they have to hold all the same.

Which constraints others imply is told by the velocities that they allow at the start. At a singular
position, the change point of a parallelogram say, that is more of them than anywhere else: what was
left out there is missing as soon as the bodies have moved.
"""

from __future__ import annotations

import numpy as np
from dolfinx import fem

from shellmb.errors import ConvergenceError
from shellmb.model.joints.joints import JointGroup
from shellmb.simulate.problem import Problem

# a joint whose constraint is implied by others stays closed to round-off; relative to the scene
OPENED = 1e-6


class DroppedConstraints:
    """Watches them; nothing to do where none were left out.

    Args:
        problem: The functions of all bodies.
    """

    def __init__(self, problem: Problem) -> None:
        self._problem, self._comm = problem, problem.model.comm
        # joints that act at times only may open
        names = {j.name for j in problem.model.scene.joints if j.active is None}
        groups = problem.model.mechanism.groups
        self._watched = [_Watched(group, names) for group in groups if not np.all(group.allowed)]

    def check(self, t: float) -> None:
        """Look at the state at the end of the step just solved; collective.

        Args:
            t: Time at its start, s.

        Raises:
            ConvergenceError: If a joint opens; names it.
        """
        if not self._watched:
            return
        last = self._problem.last
        found = max(w.worst(self._problem.levels[w.name].unknown[last]) for w in self._watched)
        gap, joint = max(self._comm.allgather(found)) if self._comm.size > 1 else found
        if gap > OPENED * self._problem.model.length:
            raise ConvergenceError(
                f"t = {t:g}: joint '{joint}' opens by {gap:.3g}: one of its constraints was left "
                "out as redundant, which it is at the position of the start only, a singular one; "
                "begin at another position, or use joints with fewer constraints"
            )


class _Watched:
    """Joints of a group of which constraints were left out.

    Args:
        group: The group.
        names: Names of the joints to look at.
    """

    def __init__(self, group: JointGroup, names: set[str]) -> None:
        self.name, self._group = group.name, group
        looked = np.array([label in names for label in group.labels])
        self._counts = (~group.allowed & looked[:, None])[group.nodes.item]

    def worst(self, q: fem.Function) -> tuple[float, str]:
        """Largest violation of what was left out, on this rank, and the joint."""
        # what was left out is off for good, so that `violations` has zeros there
        found = np.abs(self._group.all_violations(q))
        found = np.where(self._counts, found, 0.0).max(axis=1, initial=0.0)
        if not len(found):
            return 0.0, ""
        k = int(np.argmax(found))
        return float(found[k]), self._group.labels[int(self._group.nodes.item[k])]
