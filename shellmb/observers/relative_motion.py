"""Motions of a point as a frame sees them: that of a rigid body, or of a node of a beam.

The frame has its point `p` and its directors `d_k`. With `r = x - p` the point is at `d_k . r` in
it and moves there with the rate of that, `d_k . (v - p') + d_k' . r`: whatever turns with the frame
is at rest in it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from shellmb.arrays import Floats
from shellmb.observers.fields.nodal import NodalValues, rotation_vectors


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
