"""About which axis a scene turns, and whether everything in it can turn about it steadily."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from shellmb.arrays import Floats, reals_or_nan
from shellmb.errors import SceneError
from shellmb.scene import (
    GROUND,
    Cylindrical,
    Distance,
    InPlane,
    JointDamper,
    JointSpring,
    Motor,
    Planar,
    Revolute,
    Scene,
    Spherical,
)
from shellmb.scene.lookup import by_kind, of_kind, said, small_strains
from shellmb.scene.multibody.elements import JointElement, PointElement
from shellmb.scene.values.validate import show

# directions and points closer than this, of unit vectors and of what is large, are on the axis
ON_AXIS = 1e-9


@dataclass(frozen=True)
class Axis:
    """An axis of rotation.

    Args:
        axis: Its direction.
        about: A point of it, m.
        within: How close directions and points have to be to it, of unit vectors and of what is
            large.

    Raises:
        SceneError: If the direction is no vector, or zero.
    """

    axis: Sequence[float]
    about: Sequence[float] = (0.0, 0.0, 0.0)
    within: float = ON_AXIS

    def __post_init__(self) -> None:
        """Check that there is a direction."""
        for name in ("axis", "about"):
            object.__setattr__(self, name, _three(name, getattr(self, name)))
        if not np.any(self.axis):
            raise SceneError("modes: axis is (0, 0, 0); it must have a direction")

    @property
    def unit(self) -> Floats:
        """Unit vector along the axis."""
        vector = np.asarray(self.axis, dtype=float)
        return np.asarray(vector / np.linalg.norm(vector))

    def along(self, direction: Any) -> bool:
        """Decide whether a vector is parallel to the axis, or zero."""
        vector = np.asarray(direction, dtype=float)
        away = np.linalg.norm(np.cross(self.unit, vector))
        return bool(away <= self.within * np.linalg.norm(vector))

    def has(self, point: Any, size: float = 1.0) -> bool:
        """Decide whether a point is on the axis, to a part of the size of the scene."""
        arm = np.asarray(point, dtype=float) - np.asarray(self.about)
        return bool(np.linalg.norm(np.cross(self.unit, arm)) <= self.within * max(size, 1e-300))


def find_axis(
    scene: Scene, axis: Sequence[float] | None = None, about: Sequence[float] | None = None
) -> Axis:
    """The axis that is given, or the one that the scene turns about.

    Args:
        scene: The scene.
        axis: Its direction; None: that of the scene's initial spin, driven edge or driven joint.
        about: A point of it; None: as the scene has it, or the origin.

    Raises:
        SceneError: If the scene has none, or several that differ.
    """
    if axis is not None:
        return Axis(axis, (0.0, 0.0, 0.0) if about is None else about)
    found = [Axis(*line) for line in _axes_of_parts(scene)]
    if not found:
        raise SceneError(
            f"modes: scene '{scene.name}' has no initial spin, no driven edge and no driven joint "
            "to ground, so its axis of rotation is unknown; give axis, and about"
        )
    first = found[0] if about is None else Axis(found[0].axis, about)
    for other in found:
        if not first.along(other.axis) or (
            about is None and not first.has(other.about, _size(scene))
        ):
            raise SceneError(
                f"modes: scene '{scene.name}' turns about {show(found[0].axis)} through "
                f"{show(found[0].about)} and about {show(other.axis)} through "
                f"{show(other.about)}; it must be one axis: give axis, and about"
            )
    return first


def _three(name: str, values: Any) -> tuple[float, ...]:
    """Three numbers, which the error calls by a name."""
    found = reals_or_nan(values)
    if found.shape != (3,) or not np.all(np.isfinite(found)):
        raise SceneError(f"modes: {name} is {show(values)}; it must be three numbers")
    return tuple(found.tolist())


def _axes_of_parts(scene: Scene) -> Iterator[tuple[Any, Any]]:
    """Axes and points of all that turns the scene."""
    for initial in scene.initial:
        if np.any(initial.spin):
            # where the point it is said about moves, the axis is elsewhere
            spin, linear = np.asarray(initial.spin), np.asarray(initial.linear)
            shift = np.cross(spin, linear) / np.dot(spin, spin)
            yield initial.spin, np.asarray(initial.about) + shift
    supports: tuple[Any, ...] = scene.supports
    for support in supports:
        if support.rotation is not None:
            yield support.axis, support.about
    for driver in scene.drivers:
        joint: Any = scene.joint(driver.joint)
        if driver.rotation is not None and _grounded(joint):
            yield joint.axis, _place(scene, joint.first, joint.at)


def bearing(scene: Scene) -> Axis | None:
    """The axis of the first driven edge or bearing to ground; None without any."""
    supports: tuple[Any, ...] = scene.supports
    for support in supports:
        if support.rotation is not None:
            return Axis(support.axis, support.about)
    for joint in scene.joints:
        if by_kind(_HOLDING, joint) == (True, True) and _grounded(joint):
            place = _place(scene, joint.first, joint.at)
            if place is not None:
                return Axis(joint.lines[0], place.tolist())
    return None


def _size(scene: Scene) -> float:
    """A length of the scene."""
    points = [np.asarray(b.center, dtype=float) for b in scene.rigid_bodies]
    points += [np.asarray(j.at) for j in scene.joints if isinstance(j.at, tuple)]
    return max([1.0, *(float(np.linalg.norm(p)) for p in points)])


def _place(scene: Scene, owner: str, at: Any) -> Floats | None:
    """Place where a joint or element holds on to a body, if that is known without a mesh."""
    if isinstance(at, str) or at is None:
        body = next((b for b in scene.rigid_bodies if b.name == owner), None)
        return None if body is None else np.asarray(body.place(at))
    return np.asarray(at, dtype=float) if isinstance(at, tuple) else None


def check_steady(scene: Scene, axis: Axis, loaded: bool) -> None:
    """Check that a scene can turn about an axis with nothing changing in a frame that turns along.

    Supports of edges and points turn along, fixed to a hub; the ground stays in space.

    Args:
        scene: The scene.
        axis: The axis.
        loaded: Whether its loads act.

    Raises:
        SceneError: Names what does not turn along.
    """
    size = _size(scene)
    for body in scene.meshed:
        if what := small_strains(body):
            raise SceneError(
                f"modes: {what}, which have no stiffening by rotation; its model must be 'exact'"
            )
    acting: tuple[Any, ...] = (*scene.potentials, *scene.contacts)
    for item in acting:
        where = "fixed in space and does not rotate with the system"
        if not item.in_space:
            where = "between bodies, and modes of rotating bodies have no contact"
        raise SceneError(f"modes: {said(item)} is {where}; remove it")
    for own in scene.own_bodies:
        raise SceneError(f"modes: {said(own)} has no frame that turns; leave it out")
    related: tuple[Any, ...] = (*scene.couplings, *(j for j in scene.joints if j.given))
    for item in related:
        raise SceneError(
            f"modes: {item.said} relates coordinates that do not turn alike, or depends on time; a "
            "steady rotation has no such constraints, leave it out"
        )
    for joint in scene.joints:
        if joint.rolls:
            raise SceneError(
                f"modes: {joint.said} rolls on ground or slips; a steady rotation about an axis "
                "has no such contacts, leave it out"
            )
        if joint.active is not None:
            raise SceneError(f"modes: {joint.said} acts in windows of time; it must act always")
        if _grounded(joint):
            _check_bearing(scene, joint, axis, size)
    for lock in scene.locks:
        raise SceneError(
            f"modes: the lock of joint '{lock.joint}' acts in windows of time; a joint that "
            "holds the coordinate always must take its place"
        )
    for element in scene.force_elements:
        _check_element(scene, element, axis, size)
    supports: tuple[Any, ...] = scene.supports
    for support in supports:
        if support.translation is not None:
            raise SceneError(
                f"modes: {said(support)} {show(support.at)} has a translation; where all "
                "turns steadily it must have a rotation only"
            )
        if support.rotation is not None and not (
            axis.along(support.axis) and axis.has(support.about, size)
        ):
            raise SceneError(
                f"modes: {said(support)} {show(support.at)} turns about "
                f"{show(support.axis)} through {show(support.about)}; it must turn about "
                f"{show(axis.axis)} through {show(axis.about)}, as the scene does"
            )
    for load in scene.loads if loaded else ():
        for name in ("force", "acceleration", "moment"):
            vector = getattr(load, name, None)
            if getattr(load.time, "idle", False):
                # an input of a linear system, which is zero about the state
                continue
            if vector is not None and (callable(vector) or not axis.along(vector)):
                raise SceneError(
                    f"modes: {said(load)} is {show(vector)}, fixed in space; about the axis "
                    f"{show(axis.axis)} it turns in the system that it acts on, and must be "
                    "along the axis, or be left out"
                )


# joints that may hold a system that turns: whether on a line, and at a place, that must be the axis
_HOLDING = {Revolute: (True, True), Cylindrical: (True, True), Spherical: (False, True)}
_HOLDING |= {Distance: (False, True), Planar: (True, False), InPlane: (True, False)}


def _check_bearing(scene: Scene, joint: Any, axis: Axis, size: float) -> None:
    """A joint to ground looks the same from a frame that turns."""
    bound = axis.axis, axis.about
    ends = ((joint.first, joint.at), (joint.second, joint.second_at or joint.at))
    places = [_place(scene, owner, at) for owner, at in ends]
    on = next((p for (owner, _), p in zip(ends, places, strict=True) if owner == GROUND), None)
    on = on if on is not None else next((p for p in places if p is not None), None)
    has_line, has_place = by_kind(_HOLDING, joint) or (False, False)
    along = not has_line or axis.along(joint.lines[0])
    through = not has_place or on is None or axis.has(on, size)
    if not (has_line or has_place) or not (along and through):
        raise SceneError(
            f"modes: {joint.said} holds on to ground, which does not turn along about "
            f"{show(bound[0])} through {show(bound[1])}; it must be a revolute, cylindrical or "
            "spherical joint on that axis, or a planar one across it"
        )


def _check_element(scene: Scene, element: Any, axis: Axis, size: float) -> None:
    if isinstance(element, JointElement):
        joint = scene.joint(element.joint)
        (kind,) = scene.coordinates_of(element)
        grounded = _grounded(joint)
        if grounded and kind == "rotation":
            does = {JointSpring: "winds up", JointDamper: "is turned", Motor: "drives"}
            raise SceneError(
                f"modes: {element.label} '{element.name}' {of_kind(does, element)} in "
                f"{joint.said} to ground as the system turns; it must be left out where the rate "
                "is given"
            )
    elif isinstance(element, PointElement) and GROUND in (element.first, element.second):
        at = element.at if element.first == GROUND else element.second_at
        if not isinstance(at, tuple) or not axis.has(at, size):
            raise SceneError(
                f"modes: {element.label} '{element.name}' holds on to ground at {show(at)}, which "
                f"does not turn along about {show(axis.axis)} through {show(axis.about)}; it must "
                "hold on to a point of the axis, or to a body that turns"
            )


def held(scene: Scene) -> Scene:
    """The scene in a frame that turns: drives to ground and driven edges stand still there."""

    def still(item: Any, turns: bool) -> Any:
        if not turns or item.rotation is None:
            return item
        # nothing of it but the small one that linear systems add to it
        return replace(item, rotation=getattr(item.rotation, "still", _nothing))

    drivers = tuple(still(d, _grounded(scene.joint(d.joint))) for d in scene.drivers)
    supports = tuple(still(s, True) for s in scene.supports)
    return replace(scene, drivers=drivers, supports=supports, initial=(), start="given")


def _grounded(joint: Any) -> bool:
    return GROUND in (joint.first, joint.second)


def _nothing(t: float) -> float:
    return 0.0
