"""Force elements of the scene on their coordinates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from shellmb.model.joints.coordinates import Coordinate
from shellmb.scene import Scene
from shellmb.scene.multibody import elements as scene_elements
from shellmb.scene.multibody.elements import Element, JointElement


@dataclass(frozen=True)
class BoundElement:
    """A force element with its coordinate.

    Args:
        element: Description.
        coordinate: The coordinate it acts on.
        parameter: Stiffness or damping; 0 with a law of its own.
        law: Potential of a spring, law of a damper or motor; None: linear.
        rest: Change of the coordinate at which a spring's argument is zero.
    """

    element: Element
    coordinate: Coordinate
    parameter: float
    law: Callable[..., Any] | None
    rest: float = 0.0

    @property
    def key(self) -> tuple[str, object]:
        """Key that elements with common kernels share."""
        return type(self).kind_of(self.element), self.law

    @staticmethod
    def kind_of(element: Element) -> str:
        """One of "spring", "damper", "motor", "stop"."""
        return element.label.removeprefix("joint ")


def bind_element(element: Any, coordinate: Coordinate) -> BoundElement:
    """A scene's force element on its coordinate."""
    match element:
        case scene_elements.JointSpring():
            k = element.stiffness or 0.0
            return BoundElement(element, coordinate, k, element.potential, element.rest)
        case scene_elements.Spring():
            natural = 0.0
            if element.potential is None:
                natural = coordinate.start if element.length is None else element.length
            k, rest = element.stiffness or 0.0, natural - coordinate.start
            return BoundElement(element, coordinate, k, element.potential, rest)
        case scene_elements.JointDamper() | scene_elements.Damper():
            return BoundElement(element, coordinate, element.damping or 0.0, element.law)
        case scene_elements.JointStop():
            return BoundElement(element, coordinate, element.stiffness, None)
        case scene_elements.Motor():
            return BoundElement(element, coordinate, 0.0, element.law)
        case _:
            raise NotImplementedError(f"no form for {element.label}")


def coordinate_of(scene: Scene, element: Any) -> tuple[str, str]:
    """Coordinate on which a force element acts."""
    if isinstance(element, JointElement):
        (kind,) = scene.coordinates_of(element)
        return element.joint, kind
    return element.name, "distance"
