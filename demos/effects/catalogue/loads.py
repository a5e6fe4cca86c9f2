"""Effects of loads and prescribed motions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from shellmb.demos.effects.catalogue.parts import (
    Flexible,
    chosen,
    drop,
    flexible,
    replaced,
    use_of_parts,
)
from shellmb.demos.effects.effect import Change, Effect, Use, names, refuse, whole
from shellmb.scene import (
    FollowerEdgeForce,
    FollowerForce,
    FollowerLineForce,
    FollowerMoment,
    FollowerSurfaceForce,
    Gravity,
    Load,
    Pressure,
    Scene,
    Support,
)
from shellmb.scene.loads.supports import moves
from shellmb.scene.values.validate import show

_GROUP = "loads"

FOLLOWERS = (
    FollowerEdgeForce,
    FollowerForce,
    FollowerLineForce,
    FollowerMoment,
    FollowerSurfaceForce,
    Pressure,
)


def _dead(scene: Scene) -> list[Load]:
    return [load for load in scene.loads if not isinstance(load, (*FOLLOWERS, Gravity))]


def _dead_use(scene: Scene) -> Use:
    return _told("loads", _dead(scene), "loads has no dead load")


def _without_dead(scene: Scene) -> Scene:
    gone = _dead(scene)
    kept = tuple(load for load in scene.loads if not any(load is g for g in gone))
    return replace(scene, loads=kept)


def _prescribed(scene: Scene) -> Use:
    found = [s for s in scene.supports if moves(s)]
    return _told("supports", found, "no support has a function of time")


def _told(where: str, found: Sequence[Load | Support], lacking: str) -> Use:
    """Use of loads or supports: whether there are any, and of which kinds."""
    if not found:
        return Use(False, lacking)
    return Use(True, f"{where}: " + ", ".join(dict.fromkeys(item.label for item in found)))


def _terms(scene: Scene) -> Use:
    found = [body for body in flexible(scene) if body.terms]
    return Use(bool(found), f"terms of {names(found)}" if found else "terms is empty everywhere")


def _without_terms(scene: Scene, part: str | None) -> Scene:
    able = [body for body in flexible(scene) if body.terms]
    return replaced(scene, chosen(able, part, "shell or beam with terms"), terms=())


def _load(name: str, title: str, kinds: tuple[type, ...], lacking: str, add: Change) -> Effect:
    use: Callable[[Scene], Use] = use_of_parts("loads", kinds, lacking)
    return Effect(name, _GROUP, title, use, drop("loads", kinds, lacking), add)


# name, title, and field of the section
_DAMPING = (
    ("material_damping", "Kelvin and Voigt's damping of strains", "stiffness_damping"),
    ("mass_damping", "damping in proportion to the mass", "mass_damping"),
)


def _damping(name: str, title: str, field: str) -> Effect:
    """A damping that sections say."""

    def damped(scene: Scene) -> list[Flexible]:
        def on(body: Flexible) -> bool:
            given = getattr(body.section, field)
            return any(body.section.damping_times) if field == "stiffness_damping" else bool(given)

        return [body for body in flexible(scene) if on(body)]

    def use(scene: Scene) -> Use:
        found = damped(scene)
        if scene.static:
            return Use(False, f"scheme={show(scene.scheme_name)}: nothing moves")
        return Use(
            bool(found), f"{field} of {names(found)}" if found else f"no section has a {field}"
        )

    def without(scene: Scene, part: str | None) -> Scene:
        for body in chosen(damped(scene), part, f"shell or beam whose section has a {field}"):
            section: Any = body.section
            section = replace(section, **{field: 0.0})
            scene = replaced(scene, [body], section=section)
        return scene

    given = refuse(f"how much must be given: {field} of a section of a shell or beam")
    return Effect(name, _GROUP, title, use, without, given)


EFFECTS = (
    _load(
        "gravity",
        "weight of all bodies",
        (Gravity,),
        "Gravity",
        whole(lambda scene: replace(scene, loads=(*scene.loads, Gravity()))),
    ),
    Effect(
        "dead_load",
        _GROUP,
        "forces and moments of fixed direction",
        _dead_use,
        whole(_without_dead),
        refuse("its size and place must be given: add it to the scene's loads"),
        ("point forces", "point moments"),
    ),
    replace(
        _load(
            "follower_load",
            "forces that turn with the body; their stiffness is not symmetric",
            FOLLOWERS,
            "follower load or pressure",
            refuse("its size and place must be given: add it to the scene's loads"),
        ),
        bodies=("follower forces", "follower moments"),
    ),
    Effect(
        "prescribed_motion",
        _GROUP,
        "supports that move",
        _prescribed,
        refuse("a support that moves holds, too; it must be replaced by one that does not"),
        refuse("the motion must be given: Driven, or Fixed with functions of time"),
    ),
    Effect(
        "added_terms",
        _GROUP,
        "terms of the user's in the weak form (drag, damping, foundations)",
        _terms,
        _without_terms,
        refuse("the term must be given: terms of a Shell or Beam"),
    ),
    *(_damping(*given) for given in _DAMPING),
)
