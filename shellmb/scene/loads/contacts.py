"""Contact of bodies with rigid obstacles that are fixed in space."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import InstanceOf

from shellmb.errors import SceneError
from shellmb.scene.values.validate import (
    Axis,
    Name,
    NonNegative,
    Place,
    Positive,
    Vec3,
    described,
    show,
)

__all__ = ["Ball", "Contact", "Obstacle", "Plane", "Rod"]


class Obstacle:
    """A rigid obstacle that is fixed in space."""

    label: ClassVar[str]


@described("plane")
class Plane(Obstacle):
    """The half-space below a plane.

    Args:
        point: A point of the plane [m].
        normal: Its normal, towards the body; any length.
    """

    point: Vec3 = (0.0, 0.0, 0.0)
    normal: Axis = (0.0, 0.0, 1.0)


@described("ball")
class Ball(Obstacle):
    """A ball, or what is outside of one.

    Args:
        center: Its centre [m].
        radius: Its radius [m].
        inside: Whether the body is in the ball, and what is outside of it is the obstacle.
    """

    center: Vec3
    radius: Positive
    inside: bool = False


@described("rod")
class Rod(Obstacle):
    """A circular cylinder without ends, or what is outside of one: a shaft, a mandrel, a tube.

    Args:
        point: A point of its axis [m].
        axis: Direction of the axis; any length.
        radius: Its radius [m].
        inside: Whether the body is in the tube, and what is outside of it is the obstacle.
    """

    point: Vec3
    axis: Axis
    radius: Positive
    inside: bool = False


@described("contact")
class Contact:
    """Points of a body that an obstacle pushes away where they are in it, by a penalty.

    Of a shell or beam these are the nodes, each for its share of the area or length.

    Args:
        name: Its name in the results: ``NAME.Fx`` to ``NAME.Fz`` [N] on the body, ``NAME.normal``
            and ``NAME.friction`` [N], ``NAME.penetration`` [m], ``NAME.energy`` and ``NAME.loss``
            [J].
        obstacle: A ``Plane``, a ``Ball`` or a ``Rod``.
        stiffness: Force per penetration: per area of a shell [N/m^3], per length of an edge or a
            beam [N/m^2], or at each point [N/m].
        body: Name of the body; None: the only one.
        at: Where on it: edges or areas of a shell, or points, as a name, several, or coordinates
            [m]; None: all of a shell or beam, or the reference point of a rigid body.
        radius: Distance from the points to the surface that touches: the radius of a ball, half
            the thickness of a plate [m].
        smoothing: Penetration over which the stiffness sets in [m]; 0: at once.
        relative_damping: The force grows by this part of itself per speed of the penetration
            [s/m], and falls as much on the way back, but never below zero.
        friction: Coulomb's coefficient of friction.
        slip_speed: Slip at which friction is 0.71 of Coulomb's; below it is viscous [m/s].
        preloaded: Whether points may be in the obstacle at the start.
    """

    name: Name
    obstacle: InstanceOf[Obstacle]
    stiffness: Positive
    body: Name | None = None
    at: Place | None = None
    radius: NonNegative = 0.0
    smoothing: NonNegative = 0.0
    relative_damping: NonNegative = 0.0
    friction: NonNegative = 0.0
    slip_speed: Positive | None = None
    preloaded: bool = False

    def __post_init__(self) -> None:
        """Check that friction is complete, and that a body in a ball or tube has room.

        Raises:
            SceneError: Otherwise.
        """
        who = f"contact '{self.name}'"
        if self.friction > 0 and self.slip_speed is None:
            raise SceneError(
                f"{who}: friction is {self.friction:g} and slip_speed is missing; it must be the "
                "slip [m/s] below which friction is viscous, a hundredth of the speeds of interest"
            )
        if self.friction == 0 and self.slip_speed is not None:
            raise SceneError(
                f"{who}: slip_speed is {show(self.slip_speed)} and friction is 0; it must be left "
                "out without friction"
            )
        obstacle: Any = self.obstacle
        if getattr(obstacle, "inside", False) and self.radius >= obstacle.radius:
            raise SceneError(
                f"{who}: radius is {self.radius:g}; it must be less than that of the "
                f"{obstacle.label} that the body is in, which is {obstacle.radius:g}"
            )
