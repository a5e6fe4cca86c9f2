"""Effects of what connects bodies: supports, joints of each kind, and what acts on them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from shellmb.demos.effects.catalogue.parts import chosen, drop, use_of_parts
from shellmb.demos.effects.effect import Change, Effect, Use, names, refuse
from shellmb.scene import (
    Contact,
    Cylindrical,
    Damper,
    Distance,
    Driver,
    EdgeHinge,
    EnclosedVolume,
    Glue,
    InPlane,
    Join,
    Joint,
    JointDamper,
    JointSpring,
    JointStop,
    KnifeEdge,
    Lock,
    Motor,
    Planar,
    Potential,
    Prismatic,
    Revolute,
    Rolling,
    Scene,
    Screw,
    ShellRevolute,
    Spherical,
    Spring,
    Support,
    Universal,
    Weld,
)

_JOINTS: tuple[tuple[type[Joint], str], ...] = (
    (Spherical, "two points together"),
    (Revolute, "rotation about an axis"),
    (Universal, "two perpendicular axes"),
    (Cylindrical, "rotation about and sliding along an axis"),
    (Prismatic, "sliding along an axis"),
    (Planar, "sliding in a plane"),
    (Screw, "sliding in proportion to rotation"),
    (Weld, "no relative motion"),
    (Distance, "constant distance of two points"),
    (InPlane, "a point in a plane"),
    (ShellRevolute, "a frame on the director of a shell, eq. 35"),
    (EdgeHinge, "rotation of shells about a common edge"),
    (Rolling, "a wheel or a sphere on a plane, without slip"),
    (KnifeEdge, "a point on a plane, along a blade"),
)
_ELEMENTS: tuple[tuple[type, str, str], ...] = (
    (JointSpring, "spring on a coordinate of a joint", "springs"),
    (JointDamper, "damper on a coordinate of a joint", "dampers"),
    (JointStop, "limits of a coordinate of a joint", "stops"),
    (Motor, "torque or force by a law", "motors"),
    (Spring, "spring between two points", "springs"),
    (Damper, "damper between two points", "dampers"),
)


def _listed(where: str, kind: type, name: str, title: str, **more: Any) -> Effect:
    """An effect that a scene has where it lists such a part."""
    what = kind.__name__
    return Effect(
        name,
        more.pop("group"),
        title,
        use_of_parts(where, (kind,), what),
        more.pop("leave_out", None) or drop(where, (kind,), what),
        refuse(f"what it connects must be given: add {what}(...) to the scene's {where}"),
        **more,
    )


def _joint(kind: type[Joint], title: str) -> Effect:
    label = kind.label.removesuffix(" joint")
    special = {Screw.label: "screw pitches", EdgeHinge.label: "edge hinges"}
    own = (special.get(kind.label, f"{label} joints"),)
    name = label.replace(" ", "_").replace("-", "_")
    return _listed("joints", kind, f"{name}_joint", title, group="joints", bodies=own)


def _massive(scene: Scene) -> list[Joint]:
    return [joint for joint in scene.joints if joint.mass]


def _mass(scene: Scene) -> Use:
    found = _massive(scene)
    return Use(bool(found), f"mass of {names(found)}" if found else "mass=0 of all joints")


def _without_mass(scene: Scene, part: str | None) -> Scene:
    return _changed(scene, chosen(_massive(scene), part, "joint with a mass"), mass=0.0)


def _at_times(scene: Scene) -> list[Joint]:
    return [joint for joint in scene.joints if joint.active is not None]


def _windows(scene: Scene) -> Use:
    found = _at_times(scene)
    return Use(bool(found), f"active of {names(found)}" if found else "active=None of all joints")


def _always(scene: Scene, part: str | None) -> Scene:
    return _changed(
        scene, chosen(_at_times(scene), part, "joint with windows of time"), active=None
    )


def _changed(scene: Scene, joints: Iterable[Joint], **values: Any) -> Scene:
    """The scene with other values of some joints."""
    some = {joint.name for joint in joints}
    changed = (replace(j, **values) if j.name in some else j for j in scene.joints)
    return replace(scene, joints=tuple(changed))


_HOLDS: Change = drop("supports", (Support,), "support")

EFFECTS = (
    _listed(
        "supports",
        Support,
        "supports",
        "fixed edges and points",
        group="constraints",
        leave_out=_HOLDS,
        bodies=("displacement plane", "director plane"),
    ),
    _listed("joins", Join, "joins", "shells joined along edges", group="constraints"),
    _listed(
        "glues",
        Glue,
        "glues",
        "beams glued to shells",
        group="constraints",
        bodies=("glue", "glued"),
    ),
    *(_joint(kind, title) for kind, title in _JOINTS),
    Effect(
        "joint_mass",
        "joints",
        "masses of joints",
        _mass,
        _without_mass,
        refuse("the mass must be given: mass of a joint"),
        ("joint masses",),
    ),
    Effect(
        "joint_windows",
        "joints",
        "joints that act at times only",
        _windows,
        _always,
        refuse("the times must be given: active of a joint"),
    ),
    _listed("drivers", Driver, "driver", "prescribed coordinates of joints", group="joints"),
    _listed(
        "locks",
        Lock,
        "lock",
        "coordinates locked for some time",
        group="joints",
        bodies=("rotation locks", "translation locks"),
    ),
    *(
        _listed(
            "force_elements",
            kind,
            str(kind.label).replace(" ", "_"),  # type: ignore[attr-defined]
            title,
            group="force elements",
            bodies=(bodies,),
        )
        for kind, title, bodies in _ELEMENTS
    ),
    _listed(
        "potentials",
        Potential,
        "potential",
        "energies of the position of bodies, exact in the energy balance",
        group="force elements",
        bodies=("potential",),
    ),
    _listed(
        "volumes",
        EnclosedVolume,
        "enclosed_volume",
        "gas or fluid in closed shells, exact in the energy balance",
        group="force elements",
        bodies=("enclosed volume",),
    ),
    _listed(
        "contacts",
        Contact,
        "contact",
        "contact with rigid obstacles, with friction and damping, and with faces of shells",
        group="force elements",
        bodies=("contact",),
    ),
)
