"""Rotations beyond half a turn: what a rotation vector, which is known up to pi, has gone through.

At half a turn a rotation vector goes over from `pi n` to `-pi n`. A continuous one keeps count,

    r = p + 2 pi k m

with `p` up to pi, whole turns `k` and their axis `m`. That axis follows the one of `p`, so that `r`
is a rotation vector of the same rotation; but near a whole turn, where `p` is small and has any
direction, it stays. It is so for steps of less than half a turn.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from shellmb.arrays import Floats

TURN = 2 * math.pi
# from this angle on a rotation vector tells the axis
TELLS = math.pi / 2


class WholeTurns:
    """Counts the whole turns of one rotation."""

    def __init__(self) -> None:
        self._turns, self._axis = 0, np.zeros(3)
        # the last vector, up to pi
        self._last = np.zeros(3)

    def nearest(self, vectors: Floats) -> Floats:
        """Rotation vectors that may pass pi a little, those which are nearest to the last one.

        Args:
            vectors: Rotation vectors up to pi, shape (n, 3), rad.
        """
        size = np.linalg.norm(vectors, axis=1)
        axes = vectors / np.where(size > 0, size, 1.0)[:, None]
        # on the line through the vector, turns from it to the place next to the last one
        turns = np.rint((axes @ self._last - size) / TURN)
        return np.asarray(vectors + TURN * turns[:, None] * axes)

    def count(self, vector: Floats) -> Floats:
        """The continuous rotation vector, shape (3,), rad.

        Args:
            vector: One of the `nearest` vectors, or a mean of such, shape (3,), rad.
        """
        size = float(np.linalg.norm(vector))
        p = vector
        if size > TELLS:
            axis = vector / size
            along = -1 if self._turns and axis @ self._axis < 0 else 1
            self._axis = along * axis
            if size > math.pi:
                self._turns += along
                p = vector - TURN * axis
        self._last = p
        return np.asarray(p + TURN * self._turns * self._axis)

    def state(self) -> dict[str, Any]:
        """State for a restart."""
        vectors = {"axis": self._axis.tolist(), "last": self._last.tolist()}
        return {"turns": self._turns, **vectors}

    def restore(self, state: dict[str, Any]) -> None:
        """Take it up."""
        self._turns = int(state["turns"])
        self._axis, self._last = np.array(state["axis"]), np.array(state["last"])
