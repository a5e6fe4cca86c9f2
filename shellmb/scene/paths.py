"""Static path following: through limit points, turning points and bifurcations."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from shellmb.errors import SceneError
from shellmb.scene.values.validate import NONE, Finite, Listed, PositiveInt, Untrue, described, show

Angle = Annotated[float, Field(gt=0, lt=90, allow_inf_nan=False)]


@described("path following")
class PathFollowing:
    """Follow the curve of equilibria by its arc length, the load factor being an unknown.

    All loads of the scene are multiplied by the load factor, 1 being the loads as described, and
    so are potentials with ``load=True``. What is prescribed by a function (``Fixed``, ``Driven``,
    ``Driver``) is its value at the load factor, which takes the place of time, from 0 on. Time
    is the arc length of the displacements, scaled such that it grows like the load factor at the
    unloaded state: a structure that stays linear reaches its full load at time 1. The scene's
    ``dt`` is the first step, ``t_end`` the longest path.

    Args:
        load_end: Load factor at which the path ends before ``t_end``; a step ends exactly there.
            None: it ends at ``t_end`` only.
        load_levels: Load factors at which steps end, whenever the path passes them.
        iterations: Target number of Newton iterations per step; the step size is adapted to it.
        turn_deg: Angle between the tangents at both ends of a step beyond which the step is
            repeated with a smaller one [degrees].
        branches: What to do at bifurcations: ``"ignore"`` them, ``"detect"`` and locate them by the
            inertia of the stiffness matrix, or ``"switch"`` to the other branch.
        side: On which side of the path a branch is taken.
        switches: Number of branches to switch to at most, one after the other.
    """

    load_end: Finite | None = None
    load_levels: Listed[Finite] = NONE
    iterations: PositiveInt = 5
    turn_deg: Angle = 30.0
    branches: Literal["ignore", "detect", "switch"] = "detect"
    side: Annotated[Literal[1, -1], Untrue] = 1
    switches: PositiveInt = 1

    def __post_init__(self) -> None:
        """Check that the end is not the start, and that levels differ.

        Raises:
            SceneError: If `load_end` or a level is zero, or a level is given twice.
        """
        if self.load_end == 0.0:
            raise SceneError(
                "path following: load_end is 0; it must be another load factor, because the path "
                "starts there"
            )
        if 0.0 in self.load_levels or len(set(self.load_levels)) < len(self.load_levels):
            raise SceneError(
                f"path following: load_levels is {show(self.load_levels)}; they must be different "
                "load factors other than 0, where the path starts"
            )
