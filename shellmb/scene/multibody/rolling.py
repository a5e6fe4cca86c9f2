"""Rolling and blades: joints that forbid velocities and not positions."""

from dataclasses import field

import numpy as np

from shellmb.errors import SceneError
from shellmb.scene.multibody.joints import GROUND, Joint
from shellmb.scene.types import Axis, Positive
from shellmb.scene.values.validate import described, refused, show, unit_vector

# sine of the angle between a wheel's axis (a blade) and the normal below which it lies flat
# (stands up): the direction it heads in is lost
FLAT = 1e-6


@described("contact")
class Contact(Joint):
    """A body on a plane that it stays on, and on which it cannot slip."""

    normal: Axis = field(kw_only=True)

    rolls = True

    def __post_init__(self) -> None:
        """Check what a contact cannot have.

        Raises:
            SceneError: If the second body is the ground, or there are windows of time.
        """
        super().__post_init__()
        if self.second == GROUND:
            raise SceneError(
                f"{self.said}: second is 'ground'; it must be the body that moves on the plane, "
                "and the plane belongs to the first"
            )
        if self.active is not None:
            raise refused(self, "active", "it must be None: contacts act always")

    def _across(self, direction: Axis, what: str) -> None:
        """Check that a direction of the second body is not normal to the plane."""
        n = unit_vector(self.normal, f"{self.said}: normal")
        d = unit_vector(direction, f"{self.said}: {what}")
        if float(np.linalg.norm(np.cross(n, d))) < FLAT:
            raise SceneError(
                f"{self.said}: {what} {show(direction)} is normal to the plane; it must not be: "
                "there is no direction that it could move in"
            )


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

    def __post_init__(self) -> None:
        """Check the axis.

        Raises:
            SceneError: If it is normal to the plane.
        """
        super().__post_init__()
        if self.axis is not None:
            self._across(self.axis, "axis")


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

    def __post_init__(self) -> None:
        """Check the direction.

        Raises:
            SceneError: If it is normal to the plane.
        """
        super().__post_init__()
        self._across(self.direction, "direction")
