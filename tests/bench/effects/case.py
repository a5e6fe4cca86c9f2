"""A pair of scenes, one with an effect and one without it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from shellmb.demos.effects.catalogue.registry import find_effect
from shellmb.scene import Scene

Mesh = tuple[int, int]


@dataclass(frozen=True)
class Case:
    """An effect, and a scene that can have it and do without it.

    Args:
        effect: Name of the effect in the registry.
        make: The scene that has it, of a time scheme and a mesh.
        part: Name of the joint that is left out; None: all that the effect is about.
        scheme: The only scheme with which it can be measured; None: any that moves.
        meshed: Whether the mesh changes anything.
        instead: The scene without it, where the registry says that something else must take its
            place; None: as the registry leaves it out.
    """

    effect: str
    make: Callable[[str, Mesh], Scene]
    part: str | None = None
    scheme: str | None = None
    meshed: bool = True
    instead: Callable[[Scene], Scene] | None = None

    def pair(self, scheme: str, mesh: Mesh) -> tuple[Scene, Scene]:
        """The scene with the effect, and the one without it.

        For observers both are one scene: they are no part of it, but of its run.

        Args:
            scheme: Time scheme, where the case leaves the choice.
            mesh: Elements of a shell along its sides.
        """
        scene = self.make(self.scheme or scheme, mesh)
        effect = find_effect(self.effect)
        if effect.observer is not None:
            return scene, scene
        if self.instead is not None:
            return scene, self.instead(scene)
        return scene, effect.without(scene, self.part)

    def size(self, mesh: Mesh) -> str:
        """Size of the mesh as a record has it."""
        return f"{mesh[0]}x{mesh[1]}" if self.meshed else "-"
