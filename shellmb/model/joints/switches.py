"""Joints with windows of time, and locks, which begin and end to act."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from dolfinx import fem

from shellmb.arrays import Bools
from shellmb.errors import ConvergenceError
from shellmb.model.joints.constraints import ConstraintGroup
from shellmb.model.joints.linear import HeldCoordinates
from shellmb.restart import Restartable

Windows = Sequence[tuple[float, float]]
State = Callable[[str], fem.Function]

# a joint may begin to act if its ends are apart by less than this part of the scene's
# length, or its directions by this angle, rad
CLOSED = 1e-6
# times closer than this part of the scene's end are one
SAME_TIME = 1e-12


class Switched(Restartable):
    """A group of constraints of which some act in windows of time only.

    Args:
        group: The group, with switches.
        windows: Windows of each of its items; None: always.
        t_end: End of the scene, s.
    """

    remembered: ClassVar[tuple[str, ...]] = ("acting",)

    def __init__(
        self, group: ConstraintGroup, windows: Sequence[Windows | None], t_end: float
    ) -> None:
        self.group, self._windows, self._t_end = group, list(windows), t_end
        self.acting = self.at(0.0)
        self._switch()

    @property
    def events(self) -> set[float]:
        """Times inside the scene at which something changes, s."""
        times = {t for windows in self._windows for window in windows or () for t in window}
        return {t for t in times if 0 < t < self._t_end}

    def at(self, t: float) -> Bools:
        """Items that act in a step that begins at `t`, shape (items,)."""
        late = t + SAME_TIME * self._t_end
        return np.array(
            [
                windows is None or any(start <= late < end for start, end in windows)
                for windows in self._windows
            ]
        )

    def _switch(self) -> None:
        self.group.switch(np.repeat(self.acting[:, None], self.group.count, axis=1))

    def update(self, t: float, state: State) -> bool:
        """Switch for a step that begins at `t`; whether an item begins to act; collective.

        Args:
            t: Time, s.
            state: Gives the current state of a body of the system.

        Raises:
            ConvergenceError: If a joint is to act whose ends are apart.
        """
        before, self.acting = self.acting, self.at(t)
        if np.array_equal(before, self.acting):
            return False
        self._switch()
        begun = self.acting & ~before
        self._begin(begun, t, state(self.group.name))
        return bool(np.any(begun))

    def _begin(self, begun: Bools, t: float, q: fem.Function) -> None:
        """Nothing is held as it is: the joint must be closed."""
        group = self.group
        gaps = group.apart(q)
        open_ = [
            (float(gap), int(item), group.said(component, float(gap)))
            for row, item in enumerate(group.nodes.item)
            for component, gap in enumerate(gaps[row])
            if begun[item] and gap > CLOSED
        ]
        found = [pair for part in group.nodes.mesh.comm.allgather(open_) for pair in part]
        if found:
            _, item, said = max(found)
            raise ConvergenceError(
                f"joint '{group.labels[item]}' is to act from t = {t:g} on, but is open by "
                f"{said} then; it must be closed, to {CLOSED:g} of the scene's length and in rad: "
                "change its window or the motion before it",
                group.name,
            )

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up a saved state."""
        super().restore(state)
        self._switch()


class Locks(Switched):
    """Coordinates fixed in windows of time at the values they have when a window begins."""

    group: HeldCoordinates
    remembered = ("acting", "values")

    def __init__(self, group: HeldCoordinates, windows: Sequence[Windows], t_end: float) -> None:
        self.values = np.zeros(len(windows))
        self._begun = False
        super().__init__(group, windows, t_end)

    def update(self, t: float, state: State) -> bool:
        """Open and close the locks; what is locked at the start is fixed where it is then."""
        if not self._begun:
            self._begun = True
            self._begin(self.acting, t, state(self.group.name))
        return super().update(t, state)

    def _begin(self, begun: Bools, t: float, q: fem.Function) -> None:
        self.values = np.where(begun, self.group.values(q), self.values)
        self.group.hold(self.values)

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take up a saved state."""
        super().restore(state)
        self._begun = True
        self.group.hold(self.values)


class Switches(Restartable):
    """All that is switched in a scene.

    Args:
        items: The groups with their windows.

    Attributes:
        events: Times at which steps must end, ascending, s.
    """

    remembered = ("items",)

    def __init__(self, items: Sequence[Switched] = ()) -> None:
        self.items = list(items)
        self.events = tuple(sorted(set().union(*(item.events for item in items))))

    def update(self, t: float, state: State) -> bool:
        """Switch for a step that begins at `t`.

        Args:
            t: Time, s.
            state: Gives the current state of a body of the system.

        Returns:
            Whether something begins to act, so that velocities must be made consistent with it.

        Raises:
            ConvergenceError: If a joint is to act whose ends are apart.
        """
        return any([item.update(t, state) for item in self.items])

    @property
    def key(self) -> tuple[bytes, ...]:
        """Key of what acts now, for comparison."""
        return tuple([item.acting.tobytes() for item in self.items])
