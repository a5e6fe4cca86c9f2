"""Initial velocities."""

from __future__ import annotations

from shellmb.scene.values.validate import Name, Vec3, described

__all__ = ["InitialVelocity"]


@described("initial velocity")
class InitialVelocity:
    """A rigid motion: velocities ``linear + spin x (X - about)``, of directors ``spin x D``.

    Args:
        linear: Velocity of the point ``about`` [m/s].
        spin: Angular velocity [rad/s].
        about: A point of the axis of rotation [m].
        body: Name of the body; None: all of them.
    """

    linear: Vec3 = (0.0, 0.0, 0.0)
    spin: Vec3 = (0.0, 0.0, 0.0)
    about: Vec3 = (0.0, 0.0, 0.0)
    body: Name | None = None
