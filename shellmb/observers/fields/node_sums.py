"""Sums over the nodes of a body: what forces at them are together, and how far it turns."""

from __future__ import annotations

import numpy as np

from shellmb.arrays import Floats, Ints


class NodeSums:
    """Sums over nodes: positions first, then directors and what turns like them.

    Args:
        dofs: Of vectors of three: positions and what turns with the body, shape (n, 3).
        reference: Their values where the dofs are zero, shape (n, 3).
        positions: How many of them are positions.
    """

    def __init__(self, dofs: Ints, reference: Floats, positions: int) -> None:
        self._dofs, self._reference, self._positions = dofs, reference, positions

    def resultants(self, q: Floats, whole: float, forces: Floats, counted: Floats) -> Floats:
        """Force, moment about the origin and sum of the sizes of forces at nodes, shape (k, 7).

        Args:
            q: Dofs of states, or changes of them, shape (k, dofs).
            whole: One for states, zero for changes.
            forces: Forces at all dofs of the body, shape (k, dofs).
            counted: One at dofs that count, zero at others.
        """
        found = np.empty((len(q), 7))
        for row, state, acting in zip(found, q, forces, strict=True):
            # state by state: sums in another order differ in their last digit
            force = (counted * acting)[self._dofs]
            on_positions = force[: self._positions]
            row[:3] = on_positions.sum(axis=0)
            x, y, z = (whole * self._reference + state[self._dofs]).T
            a, b, c = force.T
            row[3:6] = y @ c - z @ b, z @ a - x @ c, x @ b - y @ a
            row[6] = np.sqrt((on_positions * on_positions).sum(axis=1)).sum()
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
        first, last, n = start[self._dofs], end[self._dofs], self._positions
        # the middle of the step and what it changes by, side by side
        both = np.concatenate([self._reference + (first + last) / 2, last - first], axis=1)
        sums[0], sums[1:7] = n, both[:n].sum(axis=0)
        for place, part in ((7, both[:n]), (25, both[n:])):
            products = part[:, :3].T @ part
            sums[place : place + 9] = products[:, :3].ravel()
            sums[place + 9 : place + 18] = products[:, 3:].ravel()
        change = both[n:, 3:]
        return float((change * change).reshape(-1, 3 * directors).sum(axis=1).max(initial=0.0))
