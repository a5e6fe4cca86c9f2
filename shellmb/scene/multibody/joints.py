"""Joints between two bodies, or a body and the ground.

Every joint connects a point of ``first`` with a point of ``second``: nodes of shells and beams, any
point of a rigid body or of the ground. ``at`` says where, for both ends: coordinates in the
reference configuration, the name of a point of the first body (of a rigid body its reference
point if left out), or an :class:`Offset` from one of its nodes; ``second_at`` where the second end
differs. Axes and normals are those of the
reference configuration, in the scene's axes. A joint may have a mass, which both ends carry by
halves, and may act in windows ``(start, end)`` of time only. Rolling and blades forbid velocities
and not positions.
"""

import math
from collections.abc import Callable
from dataclasses import KW_ONLY, field
from typing import Any, ClassVar

import numpy as np

from shellmb.scene.multibody.offsets import Point
from shellmb.scene.types import NONE, Axis, Finite, Listed, Name, NonNegative, Positive, Windows
from shellmb.scene.values.times import TimeFunction
from shellmb.scene.values.validate import Sentences, described, differ, frame, show, unit_vector

GROUND = "ground"


@described("joint")
class Joint:
    """Base class of joints.

    Args:
        name: What drivers, force elements and results call it.
        first: Name of a body, or ``"ground"``.
        second: Name of the other, or ``"ground"``.
        at: Where it is, for both ends: coordinates [m], the name of a point of the first body, or
            an ``Offset`` from a node of it; None: the reference point of a rigid first body.
        second_at: Where its second end is, if elsewhere.
        mass: Mass of the joint, half of it at each end [kg].
        active: When it acts: one window ``(start, end)`` of time [s] or several; None: always.

    Attributes:
        freedoms: The relative coordinates that drivers and force elements may act on.
        observed: Further ones, which the history has and nothing acts on.
        shells: Whether a shell's node, which has no frame, will do as first and as second end.
        along_edges: Whether it goes along edges of shells, and not from point to point.
        of_regions: Whether its second end may be a region, all nodes of which it holds.
        rolls: Whether it forbids velocities, and not places.
        along_scene: Whether its forces are reported along the scene's axes, as these turn with the
            first body, and not along its own.
        about_director: Whether its axis is the director of a shell.
        tied: Coordinates that change in proportion.
        above: What its functions of time must be greater than.
    """

    name: Name
    first: Name
    second: Name = GROUND
    _: KW_ONLY
    at: Point | None = None
    second_at: Point | None = None
    mass: NonNegative = 0.0
    active: Windows | None = None

    freedoms: ClassVar[tuple[str, ...]] = ()
    observed: ClassVar[tuple[str, ...]] = ()
    shells: ClassVar[tuple[bool, bool]] = (False, False)
    along_edges: ClassVar[bool] = False
    of_regions: ClassVar[bool] = False
    rolls: ClassVar[bool] = False
    along_scene: ClassVar[bool] = False
    about_director: ClassVar[bool] = False
    tied: ClassVar[tuple[str, ...]] = ()
    above: ClassVar[float] = -math.inf
    label: ClassVar[str] = "joint"

    def _wrong(self) -> Sentences:
        """Check that there are two bodies."""
        return differ(self, "first", "second")

    @property
    def said(self) -> str:
        """Name that messages use for it."""
        return f"{self.label} '{self.name}'"

    @property
    def lines(self) -> tuple[Axis, ...]:
        """Directions on both bodies of its axis or normal; empty: it has none."""
        line = getattr(self, "axis", None) or getattr(self, "normal", None)
        return (line, line) if line else ()

    @property
    def given(self) -> tuple[TimeFunction, ...]:
        """Functions of time that its constraints contain."""
        return ()


@described("spherical joint")
class Spherical(Joint):
    """Two points stay together; see :class:`Joint` for the parameters."""

    shells = (True, True)


@described("revolute joint")
class Revolute(Joint):
    """Two points stay together and the bodies turn about an axis only.

    Args:
        axis: Direction of the axis; see :class:`Joint` for the other parameters.
    """

    axis: Axis = field(kw_only=True)

    freedoms = ("rotation",)


@described("universal joint")
class Universal(Joint):
    """Two points stay together, an axis of each body stays perpendicular to one of the other.

    Args:
        axis: Direction of the axis fixed to the first body.
        second_axis: Direction of that fixed to the second, perpendicular to ``axis``; see
            :class:`Joint` for the other parameters.
    """

    axis: Axis = field(kw_only=True)
    second_axis: Axis = field(kw_only=True)

    @property
    def lines(self) -> tuple[Axis, ...]:
        """Both axes."""
        return self.axis, self.second_axis

    def __post_init__(self) -> None:
        """Check the axes.

        Raises:
            SceneError: If they are not perpendicular.
        """
        frame(self.said, "axis", self.axis, "second_axis", self.second_axis)


@described("cylindrical joint")
class Cylindrical(Joint):
    """The bodies turn about an axis and slide along it.

    Args:
        axis: Direction of the axis; see :class:`Joint` for the other parameters.
    """

    axis: Axis = field(kw_only=True)

    freedoms = ("rotation", "translation")


@described("prismatic joint")
class Prismatic(Joint):
    """The bodies slide along an axis and do not turn.

    Args:
        axis: Direction of the axis; see :class:`Joint` for the other parameters.
    """

    axis: Axis = field(kw_only=True)

    freedoms = ("translation",)


@described("planar joint")
class Planar(Joint):
    """The second body slides in a plane of the first and turns about its normal.

    Args:
        normal: Normal of the plane; see :class:`Joint` for the other parameters.
    """

    normal: Axis = field(kw_only=True)

    observed = ("rotation",)


@described("screw joint")
class Screw(Joint):
    """The bodies turn about an axis and slide along it in proportion.

    Args:
        axis: Direction of the axis.
        pitch: Sliding of the second body along the axis per turn, right-handed if positive
            [m per turn]; see :class:`Joint` for the other parameters.
    """

    axis: Axis = field(kw_only=True)
    pitch: Finite = field(kw_only=True)

    freedoms = ("rotation",)
    tied = ("rotation", "translation")

    def _wrong(self) -> Sentences:
        """Check the pitch."""
        if self.pitch == 0:
            yield "pitch", "it must not be zero, or use Revolute"


@described("weld")
class Weld(Joint):
    """The bodies do not move relative to each other; see :class:`Joint` for the parameters.

    The second body may be a shell. Then ``second_at`` is one of its nodes, or the name of an edge
    or an area (``Shell(areas=...)``), all nodes of which are fixed to the frame of the first body,
    as by rows of bolts: force and moment of the joint are those of all of them, the moment about
    ``at``, in the scene's axes as they turn with the first body.
    """

    shells = (False, True)
    of_regions = True


@described("distance joint")
class Distance(Joint):
    """Distance between two points, as by a massless link with spherical joints.

    Args:
        length: The distance [m], a number or a function of time; None: that of the reference
            configuration; see :class:`Joint` for the other parameters.
    """

    length: Positive | TimeFunction | None = field(default=None, kw_only=True)

    shells = (True, True)
    above = 0.0

    def _wrong(self) -> Sentences:
        """Check its ends."""
        if self.second_at is None:
            yield "second_at is missing; it must be the other end of the distance"

    @property
    def given(self) -> tuple[TimeFunction, ...]:
        """The distance, where it is a function of time."""
        return (self.length,) if callable(self.length) else ()


@described("in-plane joint")
class InPlane(Joint):
    """A point of the second body stays in a plane fixed to the first.

    Args:
        normal: Normal of the plane; see :class:`Joint` for the other parameters.
    """

    normal: Axis = field(kw_only=True)

    shells = (False, True)


@described("shell revolute joint")
class ShellRevolute(Joint):
    """A frame (first) and a node of a shell (second) that turns in it about its director; eq. 35.

    Both stay together, and the shell's director is fixed in the frame. Nothing resists rotation
    about the director, for which the shell has no moment.

    Args:
        axis: The shell's director; None: that of the shell's mesh; see :class:`Joint` for the
            other parameters.
    """

    axis: Axis | None = field(default=None, kw_only=True)

    shells = (False, True)
    about_director = True


@described("own joint")
class OwnJoint(Joint):
    """A joint whose constraints are a function of its two places.

    A place has a position ``x`` and vectors ``e``: three axes of a rigid body, beam or the ground,
    the director of a shell, none of an own body. The vectors of both places coincide in the
    reference configuration, and are those of the scene unless there is an ``axis``.

    Args:
        constraints: ``constraints(first, second, *values)`` is a list of scalars in UFL that
            vanish, each at most quadratic in all of these. Positions should enter as lengths (m).
        values: Functions of time that the constraints contain; what moves them does the work.
        axis: Direction of the third vector of both places; see :class:`Joint` for the other
            parameters.
    """

    constraints: Callable[..., Any] = field(kw_only=True)
    values: Listed[TimeFunction] = NONE
    axis: Axis | None = field(default=None, kw_only=True)

    shells = (True, True)

    @property
    def given(self) -> tuple[TimeFunction, ...]:
        """The values."""
        return self.values


@described("edge hinge")
class EdgeHinge(Joint):
    """Two shells that share a straight edge line and turn about it; or a shell and a rigid body.

    The edges stay together at every node, and the directors turn freely about the line. The nodes
    of the two edges may coincide or not. Springs, dampers, stops, locks and events act on the
    rotation of the hinge as on that of a revolute joint. Constraints that supports imply, or at
    single nodes other hinges, as at a corner, are left out without an error.

    Args:
        name: What drivers, force elements and results call it.
        first: Name of a shell, a rigid body, or ``"ground"``.
        second: Name of the other; one of the two must be a shell.
        at: Edge of the first body if that is a shell; None otherwise.
        second_at: Edge of the second body if that is a shell; None otherwise.
        axis: Direction along the edge about which the second shell's rotation is right-handed;
            None: that in which x grows along the edge, or else y, or else z.
        rigid_angle: Whether the angle is the same all along the edge. If False, each node has its
            own: stiffness and damping of springs, dampers and stops are distributed evenly along
            the edge, locks hold each angle, ``NAME.rotation`` is the mean, and ``NAME.1.rotation``
            and so on are the angles along ``axis``.
        active: None: it acts always.
        mass: 0: the shells or a rigid body have the mass of the hardware.
    """

    axis: Axis | None = field(default=None, kw_only=True)
    rigid_angle: bool = field(default=False, kw_only=True)

    freedoms = ("rotation",)
    shells = (True, True)
    along_edges = True

    def _wrong(self) -> Sentences:
        """Check what concerns the hinge alone."""
        if self.mass:
            yield (
                f"mass is {show(self.mass)}; it must be 0, where the mass of a hinge is part of a "
                "rigid body or of a shell"
            )
        if self.active is not None:
            yield "active", "it must be left out, because an edge hinge acts always"
        for name in ("at", "second_at"):
            where = getattr(self, name)
            if where is not None and not isinstance(where, str):
                yield (
                    f"{name} is {show(where)}; it must be the name of an edge, or be left out "
                    "where the body is no shell"
                )


@described("revolute joint")
class FramedHinge(Revolute):
    """Revolute joint in place of an edge hinge whose edges both move as frames."""

    along_scene = True


# sine of the angle between a wheel's axis (a blade) and the normal below which it lies flat
# (stands up): the direction it heads in is lost
FLAT = 1e-6


@described("contact")
class Contact(Joint):
    """A body on a plane that it stays on, and on which it cannot slip."""

    normal: Axis = field(kw_only=True)

    rolls = True

    def _wrong(self) -> Sentences:
        """Check what a contact cannot have."""
        if self.second == GROUND:
            yield (
                "second is 'ground'; it must be the body that moves on the plane, and the plane "
                "belongs to the first"
            )
        if self.active is not None:
            yield "active", "it must be None: contacts act always"

        # a sphere has no axis
        for what in ("axis", "direction"):
            direction = getattr(self, what, None)
            if direction is not None and _sine(self.normal, direction) < FLAT:
                yield (
                    f"{what} {show(direction)} is normal to the plane; it must not be: there is no "
                    "direction that it could move in"
                )


def _sine(a: Axis, b: Axis) -> float:
    """Sine of the angle between two directions."""
    return float(np.linalg.norm(np.cross(unit_vector(a, "normal"), unit_vector(b, "direction"))))


@described("rolling joint")
class Rolling(Contact):
    """A wheel with a thin rim, or a sphere, rolls on a plane of the first body without slip.

    The plane goes through the point ``at`` of the first body. The centre of the wheel is the point
    ``second_at`` of the second body, its reference point if left out. The contact holds in both
    directions: where it pulls (``NAME.F3`` is negative), a real wheel would lift off.

    Args:
        name: Its name in the results.
        first: Body of the plane, or ``"ground"``.
        second: Body that moves on it.
        at: Point of the plane on the first body: coordinates [m], the name of a point of it, or an
            ``Offset``.
        second_at: Centre of the wheel on the second body; None: its reference point.
        normal: Normal of the plane, which turns with the first body; its sign does not matter.
        mass: Mass of the joint [kg], half of it at each of its ends.
        active: None: contacts act always.
        radius: Radius of the rim, or the sphere [m].
        axis: Axis of the wheel, which turns with it; None: a sphere.
    """

    radius: Positive = field(kw_only=True)
    axis: Axis | None = field(default=None, kw_only=True)


@described("knife-edge joint")
class KnifeEdge(Contact):
    """A point of the second body stays on a plane of the first and moves along a blade only.

    Args:
        name: Its name in the results.
        first: Body of the plane, or ``"ground"``.
        second: Body that moves on it.
        at: Point of the plane on the first body: coordinates [m], the name of a point of it, or an
            ``Offset``.
        second_at: Where the blade is on the second body; None: at ``at``.
        normal: Normal of the plane, which turns with the first body; its sign does not matter.
        mass: Mass of the joint [kg], half of it at each of its ends.
        active: None: contacts act always.
        direction: Direction of the blade, which turns with the second body.
    """

    direction: Axis = field(kw_only=True)
