"""Force elements of the scene on their coordinates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from shellmb.model.joints.coordinates import Coordinate
from shellmb.scene import Scene
from shellmb.scene.control.inputs import Input
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
        """Key that elements with common kernels share, or the strains of one that relaxes."""
        own = None if self.element.relaxation is None else self.element.name
        return type(self).kind_of(self.element), self.law or own

    @staticmethod
    def kind_of(element: Element) -> str:
        """One of "spring", "damper", "motor", "stop"."""
        return element.label.removeprefix("joint ")


def _stiffness(element: Any, static: bool) -> float:
    """Stiffness in statics, or the long-term one, beside which branches act; 0 with a law."""
    series = element.relaxation
    part = 1.0 if series is None else series.at_rest if static else series.long_term
    return part * float(element.stiffness or 0.0)


def bind_element(element: Any, coordinate: Coordinate, static: bool) -> BoundElement:
    """A scene's force element on its coordinate.

    Args:
        element: Description.
        coordinate: The coordinate it acts on.
        static: Whether the scene has no motion in time.
    """
    match element:
        case scene_elements.JointSpring():
            k = _stiffness(element, static)
            return BoundElement(element, coordinate, k, element.potential, element.rest)
        case scene_elements.Spring():
            natural = 0.0
            if element.potential is None:
                natural = coordinate.start if element.length is None else element.length
            k, rest = _stiffness(element, static), natural - coordinate.start
            return BoundElement(element, coordinate, k, element.potential, rest)
        case scene_elements.JointDamper() | scene_elements.Damper():
            return BoundElement(element, coordinate, element.damping or 0.0, element.law)
        case scene_elements.JointStop():
            return BoundElement(element, coordinate, element.stiffness, None)
        case scene_elements.Motor():
            held = element.command.mean if isinstance(element.command, Input) else 0.0
            return BoundElement(element, coordinate, held, element.law)
        case _:
            raise NotImplementedError(f"no form for {element.label}")


def coordinate_of(scene: Scene, element: Any) -> tuple[str, str]:
    """Coordinate on which a force element acts."""
    if isinstance(element, JointElement):
        (kind,) = scene.coordinates_of(element)
        return element.joint, kind
    return element.name, "distance"
