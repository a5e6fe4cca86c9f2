"""Sums over the nodes of a body: what forces at them are together, and how far it turns."""

from __future__ import annotations

import numpy as np

from shellmb.arrays import Floats, Ints

# so many nodes of several states are summed at a time
MOST = 20_000


class NodeSums:
    """Sums over nodes: positions first, then directors and what turns like them.

    Args:
        dofs: Of vectors of three: positions and what turns with the body, shape (n, 3).
        reference: Their values where the dofs are zero, shape (n, 3).
        positions: How many of them are positions.
    """

    def __init__(self, dofs: Ints, reference: Floats, positions: int) -> None:
        self._dofs, self._reference, self._positions = dofs, reference, positions
        # one, what is there in the middle of a step, and what it changes by, side by side
        self._rows = np.ones((len(dofs), 7))

    def resultants(self, q: Floats, whole: float, forces: Floats, counted: Floats) -> Floats:
        """Force, moment about the origin and sum of the sizes of forces at nodes, shape (k, 7).

        Args:
            q: Dofs of states, or changes of them, shape (k, dofs).
            whole: One for states, zero for changes.
            forces: Forces at all dofs of the body, shape (k, dofs).
            counted: One at dofs that count, zero at others.
        """
        found = np.empty((len(q), 7))
        # as many states at a time as memory is there for; each is summed by itself, so that its
        # last digit is the same whatever others are there
        at_once = max(1, MOST // max(1, len(self._dofs)))
        for begin in range(0, len(q), at_once):
            some = slice(begin, begin + at_once)
            force = (counted * forces[some]).take(self._dofs, axis=1)
            x = whole * self._reference + q[some].take(self._dofs, axis=1)
            on_positions = force[:, : self._positions]
            found[some, :3] = on_positions.sum(axis=1)
            products = x.swapaxes(1, 2) @ force
            turning = products - products.swapaxes(1, 2)
            found[some, 3:6] = turning[:, (1, 2, 0), (2, 0, 1)]
            found[some, 6] = np.sqrt(np.vecdot(on_positions, on_positions)).sum(axis=1)
        return found

    def rotation_sums(self, directors: int, start: Floats, end: Floats, sums: Floats) -> float:
        """Largest square of the changes of a node's directors in a step; fills the sums.

        Args:
            directors: Number of directors of a node.
            start: Dofs of the body at the start of the step.
            end: Those at its end.
            sums: Number of positions, their sum in the middle of the step, that of their changes,
                and the sums of `x x, x dx, d d, d dd` of positions and directors, shape (43,).
        """
        first, last, n, rows = start[self._dofs], end[self._dofs], self._positions, self._rows
        rows[:, 1:4] = self._reference + (first + last) / 2
        rows[:, 4:] = last - first
        products = rows[:n, :4].T @ rows[:n]
        sums[:7], products = products[0], products[1:]
        for place in (7, 25):
            sums[place : place + 9] = products[:, 1:4].ravel()
            sums[place + 9 : place + 18] = products[:, 4:].ravel()
            products = rows[n:, 1:4].T @ rows[n:]
        change = rows[n:, 4:].reshape(-1, 3 * directors)
        return float(np.vecdot(change, change).max(initial=0.0))
