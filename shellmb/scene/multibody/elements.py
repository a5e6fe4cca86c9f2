"""Force elements: springs, dampers, stops and motors."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import field
from typing import Any, ClassVar

from pydantic import InstanceOf

from shellmb.errors import SceneError
from shellmb.scene.control.inputs import Input
from shellmb.scene.control.signals import Command
from shellmb.scene.multibody.drivers import Coordinate
from shellmb.scene.multibody.offsets import Point
from shellmb.scene.values.relaxation import Prony
from shellmb.scene.values.validate import Finite, Name, NonNegative, Positive, described, show


class Element:
    """Base class of force elements.

    Attributes:
        name: Its name in the results.
        relaxation: Prony series of its stiffness; None: it does not relax.
    """

    name: str
    label: ClassVar[str]
    relaxation: Prony | None = None


class JointElement(Element):
    """A force element that acts on a coordinate of a joint.

    Attributes:
        joint: Name of the joint.
        coordinate: Which of its coordinates; None: the only one.
    """

    joint: str
    coordinate: Coordinate | None


class PointElement(Element):
    """A force element between two points, along the line that connects them.

    Attributes:
        first: Name of a body, or ``"ground"``.
        second: Name of the other.
        at: Where on the first: coordinates [m], the name of a point of it, or an ``Offset``.
        second_at: Where on the second.
    """

    first: str
    second: str
    at: Point
    second_at: Point


def _one_of(said: str, **given: Any) -> None:
    """Exactly one of two parameters.

    Raises:
        SceneError: If both or none are given.
    """
    (a, x), (b, y) = given.items()
    if (x is None) == (y is None):
        state = "neither is" if x is None else "both are"
        raise SceneError(f"{said}: of {a} and {b} {state} given; it must be exactly one")


def _relaxes(element: Element, potential: object, said: str) -> None:
    """Springs with a stiffness have Maxwell branches.

    Raises:
        SceneError: If one with a potential relaxes.
    """
    if element.relaxation is not None and potential is not None:
        raise SceneError(
            f"{said}: it has a relaxation and a potential; a spring that relaxes must have a "
            "stiffness, of which its Prony series tells shares"
        )


def _two_ends(element: PointElement, said: str) -> None:
    if element.first == element.second:
        raise SceneError(
            f"{said}: first and second are both '{element.first}'; they must be two bodies"
        )


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

    name: Name
    joint: Name
    stiffness: Positive | None = None
    potential: Callable[[Any], Any] | None = None
    rest: Finite = 0.0
    coordinate: Coordinate | None = None
    relaxation: Prony | None = None

    def __post_init__(self) -> None:
        """Check that it has one law."""
        said = f"{self.label} '{self.name}'"
        _one_of(said, stiffness=self.stiffness, potential=self.potential)
        _relaxes(self, self.potential, said)


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

    name: Name
    joint: Name
    damping: NonNegative | None = None
    law: Callable[[Any], Any] | None = None
    coordinate: Coordinate | None = None

    def __post_init__(self) -> None:
        """Check that it has one law."""
        _one_of(f"{self.label} '{self.name}'", damping=self.damping, law=self.law)


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

    name: Name
    joint: Name
    lower: Finite | None = None
    upper: Finite | None = None
    stiffness: Positive = field(kw_only=True)
    smoothing: NonNegative = 0.0
    relative_damping: NonNegative = 0.0
    coordinate: Coordinate | None = None

    def __post_init__(self) -> None:
        """Check that there is a limit, and that the joint starts between both.

        Raises:
            SceneError: Otherwise.
        """
        said = f"{self.label} '{self.name}'"
        if self.lower is None and self.upper is None:
            raise SceneError(f"{said}: neither lower nor upper is given; give one at least")
        low = -math.inf if self.lower is None else self.lower
        high = math.inf if self.upper is None else self.upper
        if not (low < high and low <= 0 <= high):
            raise SceneError(
                f"{said}: lower is {show(self.lower)} and upper {show(self.upper)}; they must be "
                "such that 0 is between them, which is where the joint starts"
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

    name: Name
    joint: Name
    law: Callable[[Any, Any, Any], Any] | None = None
    coordinate: Coordinate | None = None
    command: InstanceOf[Command] | InstanceOf[Input] | None = None

    def __post_init__(self) -> None:
        """Check that it has one law."""
        _one_of(f"{self.label} '{self.name}'", law=self.law, command=self.command)


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

    name: Name
    first: Name
    second: Name
    at: Point
    second_at: Point
    stiffness: Positive | None = None
    potential: Callable[[Any], Any] | None = None
    length: NonNegative | None = None
    relaxation: Prony | None = None

    def __post_init__(self) -> None:
        """Check that it has one law and two ends.

        Raises:
            SceneError: Otherwise, or if a natural length comes with a potential.
        """
        said = f"{self.label} '{self.name}'"
        _two_ends(self, said)
        _one_of(said, stiffness=self.stiffness, potential=self.potential)
        _relaxes(self, self.potential, said)
        if self.potential is not None and self.length is not None:
            raise SceneError(
                f"{said}: length is {self.length:g}; it must be left out with a potential, which "
                "is a function of the whole length"
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

    name: Name
    first: Name
    second: Name
    at: Point
    second_at: Point
    damping: NonNegative | None = None
    law: Callable[[Any], Any] | None = None

    def __post_init__(self) -> None:
        """Check that it has one law and two ends."""
        said = f"{self.label} '{self.name}'"
        _two_ends(self, said)
        _one_of(said, damping=self.damping, law=self.law)
