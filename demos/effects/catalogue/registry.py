"""All effects, by name."""

from __future__ import annotations

from collections.abc import Sequence

from shellmb.demos.effects.catalogue import (
    analyses,
    connections,
    control,
    deformation,
    inertia,
    loads,
    watching,
)
from shellmb.demos.effects.effect import Effect
from shellmb.errors import SceneError
from shellmb.scene import Scene
from shellmb.scene.lookup import listed

EFFECTS: dict[str, Effect] = {
    effect.name: effect
    for module in (inertia, deformation, loads, connections, control, watching, analyses)
    for effect in module.EFFECTS
}


def find_effect(name: str) -> Effect:
    """The effect of that name.

    Raises:
        SceneError: If there is none.
    """
    if name not in EFFECTS:
        raise SceneError(f"there is no effect '{name}'; it must be one of {listed(EFFECTS)}")
    return EFFECTS[name]


def changed(scene: Scene, without: Sequence[str], with_: Sequence[str]) -> Scene:
    """A scene with effects taken in, then others left out.

    Args:
        scene: The scene.
        without: Effects that are left out, each `NAME`, or `NAME:PART` of one body or joint.
        with_: Effects that are taken in.

    Raises:
        SceneError: If there is no such effect, or the scene needs it or cannot have it.
    """
    for said in with_:
        name, _, part = said.partition(":")
        scene = find_effect(name).with_(scene, part or None)
    for said in without:
        name, _, part = said.partition(":")
        scene = find_effect(name).without(scene, part or None)
    return scene
