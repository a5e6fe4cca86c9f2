"""Motions of a point as a frame sees them, and rotations beyond half a turn.

A frame is that of a rigid body, or of a node of a beam. It has its point `p` and its directors
`d_k`. With `r = x - p` the point is at `d_k . r` in it and moves there with the rate of that,
`d_k . (v - p') + d_k' . r`: whatever turns with the frame is at rest in it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from shellmb.arrays import Floats
from shellmb.observers.fields.nodal import NodalValues, rotation_vectors
from shellmb.restart import Restartable

TURN = 2 * math.pi
# from this angle on a rotation vector tells the axis
TELLS = math.pi / 2
# up to this angle across the axis a rotation is a whole turn about it: round-off of directors
ROUND_OFF = 1e-12


class Pose(NamedTuple):
    """A point and its directors in the reference, now, and their velocities.

    Args:
        X: Reference position, shape (3,), m.
        x: Position.
        v: Velocity, m/s.
        D: Reference directors as rows, shape (m, 3).
        d: Directors.
        rate: Their velocities, 1/s.
    """

    X: Floats
    x: Floats
    v: Floats
    D: Floats
    d: Floats
    rate: Floats

    @property
    def spin(self) -> Floats:
        """Angular velocity of a frame in the scene's axes, shape (3,), rad/s."""
        return np.asarray(np.cross(self.d, self.rate).sum(axis=0) / 2)


def packed(values: NodalValues) -> Floats:
    """Sums over nodes of all that a pose consists of, shape (9 + 9 m,)."""
    points = (values.reference, values.position, values.velocity)
    vectors = (values.reference_directors, values.directors, values.director_velocity)
    return np.concatenate([v.sum(axis=0).ravel() for v in (*points, *vectors)])


def unpacked(row: Floats) -> Pose:
    """The pose of `packed` means."""
    X, x, v = row[:9].reshape(3, 3)
    return Pose(X, x, v, *row[9:].reshape(3, -1, 3))


def seen(quantity: str, point: Pose, frame: Pose) -> Floats:
    """A quantity relative to a frame, components along its directors, shape (3,).

    Args:
        quantity: Name of a motion that a probe records.
        point: The point.
        frame: The frame.
    """
    r, d = point.x - frame.x, frame.d
    match quantity:
        case "position":
            return np.asarray(d @ r)
        case "displacement":
            return np.asarray(d @ r - frame.D @ (point.X - frame.X))
        case "velocity":
            return np.asarray(d @ (point.v - frame.v) + frame.rate @ r)
        case "director":
            return np.asarray(d @ point.d[0])
        case "rotation":
            before, now = point.D @ frame.D.T, point.d @ d.T
            return rotation_vectors(before[None], now[None])[0]
        case "angular_velocity":
            return np.asarray(d @ (point.spin - frame.spin))
    raise NotImplementedError(f"no {quantity} in a frame")


class WholeTurns(Restartable):
    """Counts the whole turns of one rotation, whose vector is known up to pi.

    At half a turn a rotation vector goes over from `pi n` to `-pi n`. A continuous one keeps count,

        c = p + 2 pi k m

    with `p` up to pi, whole turns `k` and their axis `m`. That axis follows the one of `p` where
    `p` is long enough to tell; near a whole turn, where `p` is small and has any direction, it
    stays. There `c` keeps the count but is no rotation vector of the rotation. So the result is the
    one next to `c` that is: all of them are `p + 2 pi j p/|p|`. It is so for steps of less than
    half a turn.
    """

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
