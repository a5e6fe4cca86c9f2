"""Rotations beyond half a turn: what a rotation vector, which is known up to pi, has gone through.

At half a turn a rotation vector goes over from `pi n` to `-pi n`. A continuous one keeps count,

    c = p + 2 pi k m

with `p` up to pi, whole turns `k` and their axis `m`. That axis follows the one of `p` where `p` is
long enough to tell; near a whole turn, where `p` is small and has any direction, it stays. There
`c` keeps the count but is no rotation vector of the rotation. So the result is the one next to `c`
that is: all of them are `p + 2 pi j p/|p|`. It is so for steps of less than half a turn.
"""

from __future__ import annotations

import math

import numpy as np

from shellmb.arrays import Floats
from shellmb.restart import Restartable

TURN = 2 * math.pi
# from this angle on a rotation vector tells the axis
TELLS = math.pi / 2
# up to this angle across the axis a rotation is a whole turn about it: round-off of directors
ROUND_OFF = 1e-12


class WholeTurns(Restartable):
    """Counts the whole turns of one rotation."""

    remembered = ("_turns", "_axis", "_last")

    def __init__(self) -> None:
        self._turns, self._axis = 0, np.zeros(3)
        # the last vector, up to pi
        self._last = np.zeros(3)

    def count(self, vector: Floats) -> Floats:
        """The continuous rotation vector, shape (3,), rad.

        Args:
            vector: The rotation vector up to pi, shape (3,), rad.
        """
        size = float(np.linalg.norm(vector))
        axis = vector / (size or 1.0)
        # next to the last one is not it, but what goes on behind half a turn the other way
        passed = bool(axis @ self._last - size < -math.pi)
        if passed or size > TELLS:
            way = -axis if passed else axis
            along = -1 if self._turns and way @ self._axis < 0 else 1
            self._axis = along * way
            self._turns += along * passed
        self._last = vector
        counted = np.asarray(vector + TURN * self._turns * self._axis)
        if np.linalg.norm(vector - vector @ self._axis * self._axis) < ROUND_OFF:
            return counted
        return np.asarray(vector + TURN * round(float(axis @ counted - size) / TURN) * axis)
