"""Numbers that are taken in every step and booked for many steps at a time.

A step leaves few numbers, and they are cheap to take. What follows from them (sums, largest values,
columns of the history) is evaluated for many steps at once, which for small systems costs a
fraction of what it does between two solutions. Whoever asks for it gets what is true now: the steps
that are not booked yet are booked first. So controllers, events and watches see each step, and
steps of a run in which nobody asks are booked `STEPS` at a time, or fewer where each leaves much.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats
from shellmb.simulate.simulation import BaseObserver, Simulation

# steps that are booked together: a step of three links (EP) takes 5 % less than with 32, where most
# of the time is that of the first calls after so many solutions, and as long as with 128
STEPS = 64
# numbers of a table of all local dofs, 16 MB: tables take memory as their rows are used, and steps
# of large systems gain nothing from being booked together
NUMBERS = 2_000_000

type Row = dict[str, float]
type Mark = tuple[int, int, bool, Row]
type Find = Callable[[slice, Floats], None]


class StepValues:
    """Numbers that are found in each step, and read for several steps at a time.

    Args:
        find: Finds them as they are now, always in one shape; it may be collective. It must not
            know who has it: what knows itself is not freed at once.
    """

    def __init__(self, find: Callable[[], Any]) -> None:
        self._find, self._table = find, np.zeros(0)

    def take(self, row: int) -> None:
        """Find those of a step.

        Args:
            row: Which of the steps that are booked together.
        """
        found = self._find()
        if not len(self._table):
            self._table = np.zeros((STEPS, *np.shape(found)))
        self._table[row] = found

    def of(self, rows: slice) -> Floats:
        """Numbers of some steps that were taken, shape (k, ...); not collective."""
        return self._table[rows]


def copies(arrays: Iterable[Floats]) -> StepValues:
    """Copies of arrays in each step, one behind the other; there may be none."""
    return StepValues(partial(np.concatenate, [np.zeros(0), *arrays]))


class SharedTable:
    """Numbers of steps that ranks find together: their sums, or the largest ones.

    Booking is not collective: where there are several ranks, the numbers are found when a step is
    taken; else of many steps at once. Who finds them fills zeros of shape (k, *shape), of some
    steps on this rank.

    Args:
        comm: Communicator.
        shape: Shape of the numbers of a step.
        op: How ranks join theirs.
    """

    def __init__(self, comm: MPI.Comm, shape: tuple[int, ...], op: MPI.Op = MPI.SUM) -> None:
        self._comm, self._op, self._table = comm, op, np.zeros((STEPS, *shape))

    def take(self, row: int, find: Find) -> None:
        """Take those of a step; collective."""
        if self._comm.size > 1 and self._table.size:
            self._fill(slice(row, row + 1), find)
            self._comm.Allreduce(MPI.IN_PLACE, self._table[row : row + 1], op=self._op)

    def of(self, rows: slice, find: Find) -> Floats:
        """Numbers of some steps that were taken, shape (k, *shape)."""
        if self._comm.size == 1:
            self._fill(rows, find)
        return self._table[rows]

    def _fill(self, rows: slice, find: Find) -> None:
        found = self._table[rows]
        found[:] = 0.0
        find(rows, found)


class Booked[T]:
    """A finding of a `DeferredObserver`: whoever reads it gets what is true with all steps booked.

    The observer has it under the same name with an underscore before it.
    """

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = f"_{name}"

    def __get__(self, observer: DeferredObserver, owner: type) -> T:
        observer.book()
        found: T = getattr(observer, self._name)
        return found


class DeferredObserver(BaseObserver):
    """An observer that takes numbers in each step and books them later.

    One that inherits from it has `take_solved` and `take_accepted`, which put what a step leaves
    into the row of that number; `book_rows`; and `kept` and `take_up`, which are a state and its
    opposite. Booking is not collective: what ranks have to agree on is taken together.

    Attributes:
        count: Number of steps taken so far.
        mark: Rows, steps, whether something was switched, and columns, when a state was taken.
    """

    def __init__(self) -> None:
        self.count = self._taken = 0
        # number of steps that are booked together; zero: not known yet
        self._most = 0
        self._now: Row = {}
        # rows for a history that collects them
        self._rows: list[Row] | None = None
        # the state before the last step that is booked, or before something was switched
        self._before: dict[str, Any] = {}
        self._switched = False
        self.mark: Mark = 0, 0, False, {}

    def take_solved(self, simulation: Simulation, row: int) -> None:
        """Take numbers of a step that is solved: both of its ends are at hand."""

    def take_accepted(self, simulation: Simulation, row: int) -> None:
        """Take numbers of the state that is accepted."""

    def book_rows(self, rows: slice) -> list[Row]:
        """Book the steps in some rows, one after the other.

        Returns:
            Columns of the history, of each step.
        """
        raise NotImplementedError

    def kept(self) -> dict[str, Any]:
        """State that must survive a restart, all steps being booked."""
        found: dict[str, Any] = super().state()
        return found

    def take_up(self, state: dict[str, Any]) -> None:
        """Take up what was `kept`."""
        super().restore(state)

    def begin(self, row: Row) -> None:
        """Have columns before the first step.

        Args:
            row: The columns.
        """
        self._now = row

    def solved(self, simulation: Simulation) -> None:
        """Take the step."""
        if not self._most:
            # a rank may have none
            size = max(1, len(simulation.problem.system.numbering.local_to_global))
            self._most = min(STEPS, NUMBERS // size + 1)
        if self._taken >= self._most:
            # nobody requests the state before the last step any more: another one is solved
            taken, self._taken = self._taken, 0
            self._book(slice(0, taken))
        self.take_solved(simulation, self._taken)

    def accepted(self, simulation: Simulation) -> None:
        """Take the new state."""
        self.take_accepted(simulation, self._taken)
        self._taken += 1
        self.count += 1

    def switched(self, simulation: Simulation) -> None:
        """Something is switched: what was taken before is booked before."""
        self.book()
        if not self._switched:
            self._before, self._switched = self.kept(), True

    def book(self) -> None:
        """Book all that was taken."""
        taken, self._taken = self._taken, 0
        if taken > 1:
            self._book(slice(0, taken - 1))
        if taken:
            if not self._switched:
                self._before = self.kept()
            self._book(slice(taken - 1, taken))

    def _book(self, rows: slice) -> None:
        found = self.book_rows(rows)
        self._switched, self._now = False, found[-1]
        if self._rows is not None:
            self._rows += found

    def collect(self, count: int) -> list[Row]:
        """Hand over columns of steps that have not been handed over; from the first call on.

        Args:
            count: Of how many steps.
        """
        self.book()
        if self._rows is None:
            self._rows = []
        found, self._rows = self._rows[:count], self._rows[count:]
        return found

    def measure(self) -> Row:
        """Columns of the history."""
        self.book()
        return dict(self._now)

    def finish(self, simulation: Simulation, error: BaseException | None) -> None:
        """Book what is left."""
        self.book()

    def state(self) -> dict[str, Any]:
        """State that must survive a restart."""
        self.book()
        self.mark = len(self._rows or ()), self.count, self._switched, self._now
        return self.kept()

    def state_at(self, count: int) -> dict[str, Any]:
        """State that must survive a restart from behind the last step, or the one before it.

        Args:
            count: Number of steps that had been taken there.
        """
        self.book()
        assert self.count - count in (0, 1)
        return self._before if count < self.count or self._switched else self.kept()

    def restore(self, state: dict[str, Any]) -> None:
        """Take up a saved state; what was taken since then does not count."""
        self._taken = 0
        rows, self.count, self._switched, self._now = self.mark
        if self._rows is not None:
            del self._rows[rows:]
        self.take_up(state)
