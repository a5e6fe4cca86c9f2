"""Linear constraints on coordinates (pitches, couplings, locks), and what acts at times only."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from dolfinx import fem
from ufl.core.expr import Expr

from shellmb.arrays import Bools, Floats
from shellmb.errors import ConvergenceError
from shellmb.meshes.nodes import set_constants
from shellmb.model.joints import coordinates as relative
from shellmb.model.joints.constraints import ConstraintGroup, GivenValues, Prescribed
from shellmb.model.massless import Scale
from shellmb.restart import Restartable


class TiedCoordinates(ConstraintGroup):
    """Sums of factors times coordinates that vanish, or have a given value: screws, couplings.

    Args:
        scale: Communicator and sizes.
        title: Name of the group.
        labels: A name for each.
        members: The coordinates of each, as many.
        factors: Their factors, and behind them those of the given values, shape (items, n).
        given: The given values of each: none, or one.
        size: What violations are relative to.
        switched: Whether some may be switched off.
    """

    def __init__(
        self,
        scale: Scale,
        title: str,
        labels: Sequence[str],
        members: Sequence[Sequence[relative.Coordinate]],
        factors: Floats,
        given: Sequence[Prescribed],
        size: float,
        switched: bool,
    ) -> None:
        self.members, self._factors = [list(each) for each in members], factors
        self._given, self._parts = GivenValues(given), [f"x{k + 1}" for k in range(len(members[0]))]
        targets = {
            part: relative.scalar_targets([each[k] for each in members])
            for k, part in enumerate(self._parts)
        }
        # the work of a multiplier of size one is that of a couple
        sizes = self._violation, scale.couple / size, size, switched
        own = self._given.parts
        super().__init__(title, scale.comm, len(members), 1, *sizes, targets=targets, own=own)
        self._factor = self.per_item(factors, "factors")
        self.labels = list(labels)
        self._given.prescribe(self)

    def _violation(self, q: Expr) -> Expr:
        terms = [self.layout.part(q, part) for part in self._parts]
        terms += self._given.values(q, self.layout)
        weighed = [self._factor[k] * term for k, term in enumerate(terms)]
        return relative.as_row(sum(weighed[1:], weighed[0]))

    def column(self, label: str, c: relative.Coordinate) -> str:
        """Column of the force of one, by its label, on one of its coordinates."""
        return f"{label}.{c.joint}.{c.effort}"

    def shares(self, held: fem.Function, group: relative.CoordinateGroup) -> Floats:
        """Multipliers of coordinates on which nothing acts but what ties them; collective.

        Args:
            held: Function that holds the ties' own multipliers.
            group: The coordinates.

        Returns:
            One for each coordinate of the group, shape (items,).
        """
        found = np.zeros(group.items)
        for each, forces in zip(self.members, self.forces(held), strict=True):
            for coordinate, force in zip(each, forces, strict=True):
                if coordinate.group is group:
                    found[coordinate.item] = force / float(group.force.value)
        return found

    def columns(self, held: fem.Function) -> dict[str, float]:
        """Torques and forces on the coordinates, by their columns; collective.

        Means over the step just solved, as those of drivers. While locks are open they are 0.

        Args:
            held: As of `shares`.
        """
        each = zip(self.labels, self.members, strict=True)
        names = [self.column(label, c) for label, members in each for c in members]
        return relative.summed(names, self.forces(held).ravel())

    def forces(self, held: fem.Function) -> Floats:
        """Forces [N] or torques [N m] on the coordinates of each, shape (items, n); collective.

        Args:
            held: As of `shares`.
        """
        mu = self.gathered("mu", held.x.array) * float(self.force.value)
        return -self._factors[:, : len(self.members[0])] * mu


class HeldCoordinates(TiedCoordinates):
    """Coordinates fixed at a value, `x = x_held`, switched on at times: locks.

    Args:
        scale: Communicator and sizes.
        kind: Kind of the coordinates.
        labels: A name for each.
        items: The coordinates.
    """

    def __init__(
        self, scale: Scale, kind: str, labels: Sequence[str], items: Sequence[relative.Coordinate]
    ) -> None:
        each, ones = [[c] for c in items], np.ones((len(items), 1))
        tied = each, ones, (), items[0].size, True
        super().__init__(scale, f"{kind} locks", labels, *tied)
        self._held = self.per_item(0 * ones, "held")

    def _violation(self, q: Expr) -> Expr:
        return relative.as_row(self.layout.part(q, "x1") - self._held)

    def column(self, label: str, c: relative.Coordinate) -> str:
        """Column of the force of a lock."""
        return f"{c.joint}.lock_{c.effort}"

    def values(self, q: fem.Function) -> Floats:
        """Coordinates at a state, shape (items,), the same on all ranks; collective."""
        return self.gathered("x1", q.x.array)[:, 0]

    def hold(self, values: Floats) -> None:
        """Set the values at which the coordinates are fixed, shape (items,)."""
        set_constants(self._held, self.nodes, values[:, None])


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
        acts = [w is None or any(start <= late < end for start, end in w) for w in self._windows]
        return np.array(acts)

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
