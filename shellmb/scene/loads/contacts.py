"""Contact, potentials of the place of bodies, and volumes that shells enclose with gas or fluid."""

from collections.abc import Callable, Mapping
from dataclasses import field
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from pydantic import InstanceOf

from shellmb.errors import SceneError
from shellmb.scene.types import NONE, Axis, Finite, Listed, Name, NonNegative, Place, Positive, Vec3
from shellmb.scene.values.times import TimeFunction
from shellmb.scene.values.validate import described, frame, refused, show


@described("potential")
class Potential:
    """Potential energy of a body's position: a foundation, a magnet, the field of a planet.

    It is exact in the energy balance of every scheme; dissipative ones never gain energy by it.

    Args:
        name: Its name in the results: ``NAME.energy`` [J], ``NAME.Fx`` to ``NAME.Fz`` [N].
        energy: ``energy(at, parameters)``, written with operators and functions of UFL, gives the
            energy per area of a shell [J/m^2], per length of an edge or a beam [J/m], or at a point
            [J]. ``at.x`` is the position, ``at.u`` the displacement, ``at.X`` the reference
            position, and ``at.directors`` are the deformed directors: one of a shell, three of a
            beam or a rigid body.
        body: Name of the body; None: the only one.
        at: Where on it: edges or areas of a shell, or a point, as a name, several, or coordinates
            [m]; None: all of a shell or beam, or the reference point of a rigid body.
        parameters: Numbers of the energy by name.
        load: Whether it is a load: the load factor of static steps and paths multiplies it, as it
            multiplies loads without a function of time. Otherwise it acts fully from the start.
    """

    name: Name
    energy: Callable[..., Any]
    body: Name | None = None
    at: Place | None = None
    parameters: Mapping[Name, Finite] = field(default_factory=dict)
    load: bool = False

    in_space = True


@described("gas")
class Gas:
    """A gas that is shut in: ``p V^exponent`` stays what it is in the reference configuration.

    Args:
        pressure: Absolute pressure in the reference configuration [Pa].
        exponent: 1 where the temperature stays, 1.4 where no heat is exchanged with air.
        ambient: Absolute pressure outside, which stays [Pa]; None: ``pressure``, so that the gas
            exerts no force in the reference configuration.
    """

    pressure: Positive
    exponent: Finite = 1.4
    ambient: Finite | None = None

    def __post_init__(self) -> None:
        """Check the exponent and the pressure outside.

        Raises:
            SceneError: If the exponent is below 1, or the pressure outside below 0.
        """
        if self.exponent < 1:
            raise SceneError(f"gas: exponent is {show(self.exponent)}; it must be 1 or more")
        if self.ambient is not None and self.ambient < 0:
            raise SceneError(f"gas: ambient is {show(self.ambient)}; it must be 0 or more")

    @property
    def outside(self) -> float:
        """Pressure outside, Pa."""
        return self.pressure if self.ambient is None else self.ambient


@described("enclosed volume")
class EnclosedVolume:
    """The volume that shells enclose, and what fills it.

    The shells together are closed: each edge is joined to another of them, or stays in a plane
    through ``origin``, which closes the volume as a lid does (planes of symmetry). Their normals
    may point inwards or outwards. The volume is that of the surface through the nodes.

    Args:
        name: Its name in the results: ``NAME.volume`` [m^3] and ``NAME.pressure`` [Pa], by which
            the pressure inside exceeds that outside.
        shells: Names of the shells; empty: the only one.
        gas: What fills it; None: a fluid whose volume is given.
        change: Relative change of the fluid's volume over time, ``V/V0 - 1``; on a path, over the
            load factor. None: the volume stays.
        origin: A point in all planes that close the volume [m].
    """

    name: Name
    shells: Listed[Name] = NONE
    gas: Gas | None = None
    change: TimeFunction | None = None
    origin: Vec3 = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Check that not both are given.

        Raises:
            SceneError: If there is a gas and a given volume, or a shell twice.
        """
        if self.gas is not None and self.change is not None:
            raise SceneError(
                f"enclosed volume '{self.name}': gas and change are given; one of them must be "
                "left out, because the volume of a gas follows from its pressure"
            )
        if len(set(self.shells)) < len(self.shells):
            raise refused(self, "shells", "each must be named once")


class Obstacle:
    """A rigid obstacle in the reference configuration.

    Attributes:
        label: What messages call it.
        deforms: Whether it moves with a body that deforms.
    """

    label: ClassVar[str]
    deforms: ClassVar[bool] = False


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
    """A solid ball, or a hollow one with the body inside.

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
    """A circular cylinder without ends: solid (a shaft, a mandrel), or hollow (a tube).

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


@described("box")
class Box(Obstacle):
    """A box; its edges and corners may be rounded.

    Args:
        center: Its centre [m].
        size: Its extent along ``axis1``, ``axis2`` and ``axis1 x axis2`` [m].
        axis1: Direction of its first edges; any length.
        axis2: Direction of its second edges, perpendicular to ``axis1``; any length.
        rounding: Radius of its edges and corners, within its size [m].
    """

    center: Vec3
    size: Vec3
    axis1: Axis = (1.0, 0.0, 0.0)
    axis2: Axis = (0.0, 1.0, 0.0)
    rounding: NonNegative = 0.0

    def __post_init__(self) -> None:
        """Check its size and axes.

        Raises:
            SceneError: If it has no volume, too large a rounding, or skew axes.
        """
        if min(self.size) <= 0:
            raise SceneError(f"box: size is {show(self.size)}; each extent must be greater than 0")
        if 2 * self.rounding >= min(self.size):
            raise SceneError(
                f"box: rounding is {self.rounding:g}; it must be less than half the smallest "
                f"extent, which is {min(self.size):g}"
            )
        _ = self.axes

    @cached_property
    def axes(self) -> np.ndarray:
        """Unit vectors along its edges as rows, shape (3, 3)."""
        return np.array(frame("box", "axis1", self.axis1, "axis2", self.axis2))


@described("faces")
class Faces(Obstacle):
    """Both faces of a shell that deforms, or of the shell itself that touches.

    Args:
        shell: Name of the shell.
        thickness: Distance between its faces [m]: points touch at half of it from the mid-surface.
    """

    shell: Name
    thickness: Positive

    deforms = True


@described("contact")
class Contact:
    """Contact of points of a body with a rigid obstacle, by a penalty.

    Of a shell or beam these are the nodes, each for its share of the area or length.

    Args:
        name: Its name in the results: ``NAME.Fx`` to ``NAME.Fz`` [N] on the body, ``NAME.normal``
            and ``NAME.friction`` [N], ``NAME.penetration`` [m], ``NAME.energy`` and ``NAME.loss``
            [J]; with ``obstacle_body`` also ``NAME.Mx`` to ``NAME.Mz`` [N m] on that body, about
            its centre of mass.
        obstacle: A ``Plane``, a ``Ball``, a ``Rod`` or a ``Box``; or the ``Faces`` of a shell.
        stiffness: Force per penetration: per area of a shell [N/m^3], per length of an edge or a
            beam [N/m^2], or at each point [N/m].
        body: Name of the body; None: the only one.
        at: Where on it: edges or areas of a shell, or points, as a name, several, or coordinates
            [m]; None: all of a shell or beam, or the reference point of a rigid body.
        radius: Distance from the points to the surface that touches: the radius of a ball, half
            the thickness of a plate [m].
        smoothing: Penetration over which the stiffness sets in [m]; 0: at once.
        relative_damping: Hunt-Crossley damping: F (1 + relative_damping * rate), never negative,
            with the rate of the penetration [s/m].
        friction: Coulomb's coefficient of friction.
        slip_speed: Regularisation velocity: below it friction is viscous; at it, 71 % of mu N
            [m/s].
        preloaded: Whether points may be in the obstacle at the start.
        obstacle_body: Name of the rigid body that the obstacle moves with; None: it is fixed in
            space. Place and axes of the obstacle are those in the reference configuration.
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
    obstacle_body: Name | None = None

    @property
    def in_space(self) -> bool:
        """Decide whether the obstacle is fixed in space."""
        return self.obstacle_body is None and not self.obstacle.deforms

    def __post_init__(self) -> None:
        """Check that friction is complete, and that a body fits into a ball or tube.

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
