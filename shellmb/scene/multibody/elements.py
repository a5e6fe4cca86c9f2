"""Drivers and locks of joints' coordinates, and force elements: springs, dampers, stops, motors.

The coordinate of a joint is the rotation [rad] or the translation [m] of its second body relative
to its first, about or along the joint's axis, right-handed, and begins as zero; a rotation counts
whole turns.
"""

import math
from collections.abc import Callable
from dataclasses import field
from typing import Any, ClassVar, Literal

from pydantic import InstanceOf

from shellmb.scene.control.sensors import ALWAYS, Condition, Event
from shellmb.scene.control.signals import Command, Input
from shellmb.scene.multibody.offsets import Point
from shellmb.scene.types import NOTHING, Finite, Name, NonNegative, OneWindowOrMore, Positive
from shellmb.scene.values.damping import Prony
from shellmb.scene.values.times import TimeFunction
from shellmb.scene.values.validate import Sentences, described, differ, show

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

    def _wrong(self) -> Sentences:
        """Check that a motion is given."""
        if not self.given:
            yield "neither rotation nor translation is given; give one at least"

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """The prescribed coordinates."""
        return tuple(self.given)

    @property
    def given(self) -> dict[Coordinate, TimeFunction]:
        """Their functions of time."""
        both: dict[Coordinate, Any] = {"rotation": self.rotation, "translation": self.translation}
        return {name: function for name, function in both.items() if function is not None}


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

    def _wrong(self) -> Sentences:
        """Check that one thing says when it acts."""
        if (self.active is None) == (self.when is None and self.until is None):
            state = "none is" if self.active is None else "both are"
            yield f"of active and conditions (when, until) {state} given; it must be one of them"
        if isinstance(self.when, str) and self.until is not None:
            yield f"when is event '{self.when}' and until is given; it must be the event's"

    @property
    def said(self) -> str:
        """Name that messages use for it."""
        return f"lock of joint '{self.joint}'"

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


class Element:
    """Base class of force elements.

    Attributes:
        name: Its name in the results.
        stiffness: Stiffness [N/m or N m/rad], if it has one.
        relaxation: Prony series of its stiffness; None: it does not relax.
        laws: Two parameters of which one is given, its law; none: it has one anyway.
        command: What commands it; None: nothing does.
    """

    name: str
    label: ClassVar[str]
    laws: ClassVar[tuple[str, ...]] = ()
    stiffness: float | None = None
    relaxation: Prony | None = None
    command: Any = None

    def _wrong(self) -> Sentences:
        """Check that it has one law, of which there are shares where it relaxes."""
        given = [name for name in self.laws if getattr(self, name) is not None]
        if self.laws and len(given) != 1:
            state = "both are" if given else "neither is"
            yield f"of {' and '.join(self.laws)} {state} given; it must be exactly one"
        if self.relaxation is not None and "potential" in given:
            yield (
                "it has a relaxation and a potential; a spring that relaxes must have a stiffness, "
                "of which its Prony series tells shares"
            )


@described("element of a joint")
class JointElement(Element):
    """A force element that acts on one ``coordinate`` of a joint; None: the only one.

    Args:
        name: Its name in the results.
        joint: Name of the joint.
    """

    name: Name
    joint: Name


@described("element between points")
class PointElement(Element):
    """A force element between two points, along the line that connects them.

    Args:
        name: Its name in the results.
        first: Name of a body, or ``"ground"``.
        second: Name of the other.
        at: Where on the first: coordinates [m], the name of a point of it, or an ``Offset``.
        second_at: Where on the second.
    """

    name: Name
    first: Name
    second: Name
    at: Point
    second_at: Point

    # as of joints
    of_regions = False

    def _wrong(self) -> Sentences:
        """Check that it has two ends."""
        return differ(self, "first", "second", "they must be two bodies")


@described("joint spring")
class JointSpring(JointElement):
    """A spring on a coordinate of a joint.

    Args:
        name: Its name in the results.
        joint: Name of the joint.
        stiffness: Its stiffness [N m/rad or N/m].
        potential: In place of a stiffness its energy [J] as a function of ``coordinate - rest``,
            written with operators and UFL functions.
        rest: Coordinate at which it is at rest [rad or m].
        coordinate: ``"rotation"`` or ``"translation"``; None: the joint's only one.
        relaxation: Prony series of its stiffness; None: it does not relax.
    """

    stiffness: Positive | None = None
    potential: Callable[[Any], Any] | None = None
    rest: Finite = 0.0
    coordinate: Coordinate | None = None
    relaxation: Prony | None = None

    laws = ("stiffness", "potential")


@described("joint damper")
class JointDamper(JointElement):
    """A damper on a coordinate of a joint.

    Args:
        name: Its name in the results.
        joint: Name of the joint.
        damping: Torque or force per rate [N m s/rad or N s/m].
        law: In place of it the resisting torque [N m] or force [N] as a function of the rate,
            written with operators and UFL functions.
        coordinate: ``"rotation"`` or ``"translation"``; None: the joint's only one.
    """

    damping: NonNegative | None = None
    law: Callable[[Any], Any] | None = None
    coordinate: Coordinate | None = None

    laws = ("damping", "law")


@described("joint stop")
class JointStop(JointElement):
    """Limits of a coordinate of a joint, by a penalty: a door's stop, the end of a slide.

    Args:
        name: Its name in the results.
        joint: Name of the joint.
        lower: Least coordinate [rad or m]; None: any.
        upper: Largest coordinate [rad or m]; None: any.
        stiffness: Torque or force per coordinate beyond a limit [N m/rad or N/m].
        smoothing: Coordinate beyond a limit over which the stiffness sets in [rad or m]; 0: at
            once.
        relative_damping: Hunt-Crossley damping: F (1 + relative_damping * rate), never negative,
            with the rate into the stop [s/rad or s/m].
        coordinate: ``"rotation"`` or ``"translation"``; None: the joint's only one.
    """

    lower: Finite | None = None
    upper: Finite | None = None
    stiffness: Positive = field(kw_only=True)
    smoothing: NonNegative = 0.0
    relative_damping: NonNegative = 0.0
    coordinate: Coordinate | None = None

    def _wrong(self) -> Sentences:
        """Check that there is a limit, and that the joint starts between both."""
        if self.lower is None and self.upper is None:
            yield "neither lower nor upper is given; give one at least"
        low = -math.inf if self.lower is None else self.lower
        high = math.inf if self.upper is None else self.upper
        if not (low < high and low <= 0 <= high):
            yield (
                f"lower is {show(self.lower)} and upper {show(self.upper)}; they must be such that "
                "0 is between them, which is where the joint starts"
            )


@described("motor")
class Motor(JointElement):
    """A torque or force on the second body, and its opposite on the first, by a law.

    Args:
        name: Its name in the results.
        joint: Name of the joint.
        law: ``law(coordinate, rate, time)`` gives the torque [N m] or force [N], written with
            operators and UFL functions.
        coordinate: ``"rotation"`` or ``"translation"``; None: the joint's only one.
        command: In place of a law what a controller commands, or an ``Input`` [N m or N].
    """

    law: Callable[[Any, Any, Any], Any] | None = None
    coordinate: Coordinate | None = None
    command: InstanceOf[Command] | InstanceOf[Input] | None = None

    laws = ("law", "command")


@described("spring")
class Spring(PointElement):
    """A spring between two points.

    Args:
        name: Its name in the results.
        first: Name of a body, or ``"ground"``.
        second: Name of the other.
        at: Where on the first: coordinates [m], the name of a point of it, or an ``Offset``.
        second_at: Where on the second.
        stiffness: Its stiffness [N/m].
        potential: In place of a stiffness its energy [J] as a function of its length, written with
            operators and UFL functions.
        length: Natural length [m], with a stiffness; None: the initial one.
        relaxation: Prony series of its stiffness; None: it does not relax.
    """

    stiffness: Positive | None = None
    potential: Callable[[Any], Any] | None = None
    length: NonNegative | None = None
    relaxation: Prony | None = None

    laws = ("stiffness", "potential")

    def _wrong(self) -> Sentences:
        """Check that its law is one."""
        if self.potential is not None and self.length is not None:
            yield (
                f"length is {self.length:g}; it must be left out with a potential, which is a "
                "function of the whole length"
            )


@described("damper")
class Damper(PointElement):
    """A damper between two points.

    Args:
        name: Its name in the results.
        first: Name of a body, or ``"ground"``.
        second: Name of the other.
        at: Where on the first: coordinates [m], the name of a point of it, or an ``Offset``.
        second_at: Where on the second.
        damping: Force per rate of its length [N s/m].
        law: In place of it the resisting force [N] as a function of the rate of length, written
            with operators and UFL functions.
    """

    damping: NonNegative | None = None
    law: Callable[[Any], Any] | None = None

    laws = ("damping", "law")
