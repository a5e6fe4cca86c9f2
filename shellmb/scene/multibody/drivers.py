"""Drivers and locks: coordinates of joints that are given.

The coordinate of a joint is the rotation [rad] or the translation [m] of its second body relative
to its first, about or along the joint's axis, right-handed, and begins as zero; a rotation counts
whole turns.
"""

from __future__ import annotations

from typing import Any, Literal

from pydantic import InstanceOf

from shellmb.errors import SceneError
from shellmb.scene.control.events import ALWAYS, Event
from shellmb.scene.control.sensors import Condition
from shellmb.scene.values.times import TimeFunction
from shellmb.scene.values.validate import NOTHING, Name, OneWindowOrMore, described

Coordinate = Literal["rotation", "translation"]


@described("driver")
class Driver:
    """Prescribes coordinates of a joint; the torque or force that this takes is a result.

    Args:
        name: Its name in the results.
        joint: Name of the joint.
        rotation: Relative rotation over time [rad], or the ``Acceleration`` that a controller
            commands.
        translation: Relative translation over time [m], likewise.
    """

    name: Name
    joint: Name
    rotation: TimeFunction | None = None
    translation: TimeFunction | None = None

    def __post_init__(self) -> None:
        """Check that a motion is given.

        Raises:
            SceneError: If there is neither a rotation nor a translation.
        """
        if self.rotation is None and self.translation is None:
            raise SceneError(
                f"driver '{self.name}': neither rotation nor translation is given; give one at "
                "least"
            )

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """The prescribed coordinates."""
        given: tuple[tuple[Coordinate, Any], ...] = (
            ("rotation", self.rotation),
            ("translation", self.translation),
        )
        return tuple(name for name, function in given if function is not None)


@described("lock")
class Lock:
    """Holds the coordinates of a joint at the values that they have when it begins to act.

    Args:
        joint: Name of the joint.
        active: When it acts: one window ``(start, end)`` of time [s] or several; a lock whose
            windows all begin after the scene's end does not act.
        coordinate: Which coordinate; None: all that the joint has.
        when: In place of ``active`` the condition at which it begins to act, as
            ``Sensor("hinge.rotation") >= 1.5``, or the name of an event: it acts while that is on.
        until: The condition at which it ends to act; without ``when`` it acts from the start.
    """

    joint: Name
    active: OneWindowOrMore = NOTHING
    coordinate: Coordinate | None = None
    when: Name | InstanceOf[Condition] | None = None
    until: InstanceOf[Condition] | None = None

    def __post_init__(self) -> None:
        """Check that one thing says when it acts.

        Raises:
            SceneError: If nothing does, or two things do.
        """
        said = f"lock of joint '{self.joint}'"
        if (self.active is None) == (self.when is None and self.until is None):
            state = "none is" if self.active is None else "both are"
            raise SceneError(
                f"{said}: of active and conditions (when, until) {state} given; it must be one of "
                "them"
            )
        if isinstance(self.when, str) and self.until is not None:
            raise SceneError(
                f"{said}: when is event '{self.when}' and until is given; it must be the event's"
            )

    @property
    def event(self) -> Event | None:
        """The event of its own conditions."""
        if self.active is not None or isinstance(self.when, str):
            return None
        which = "" if self.coordinate is None else f" {self.coordinate}"
        when = ALWAYS if self.when is None else self.when
        return Event(f"{self.joint}{which} lock", when, self.until)

    @property
    def switch(self) -> str | None:
        """Name of the event while which it acts; None where it has windows."""
        return self.when if isinstance(self.when, str) else getattr(self.event, "name", None)
