"""Numbers that are found in each of many steps, and read for several of them at a time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from shellmb.arrays import Floats


class DeferredValues:
    """Numbers of many steps.

    Args:
        find: Finds them as they are now, shape (n,); collective.
        size: How many they are.
        steps: How many steps are kept.
    """

    def __init__(self, find: Callable[[], Floats], size: int, steps: int) -> None:
        self.find, self._found = find, np.zeros((steps, size))

    def take(self, row: int) -> None:
        """Find what they are now; collective.

        Args:
            row: Which of the steps.
        """
        self._found[row] = self.find()

    def of(self, rows: slice) -> Floats:
        """Numbers of some steps that were taken, shape (k, n); not collective."""
        return self._found[rows]
