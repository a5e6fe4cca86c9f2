"""Whether a path of equilibria can be followed in a scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

from shellmb.errors import SceneError
from shellmb.scene.loads.supports import moves
from shellmb.scene.values.validate import show

if TYPE_CHECKING:
    from shellmb.scene.description import Description

__all__ = ["check_path"]


def check_path(scene: Description) -> None:
    """Check that a scene is one whose path can be followed.

    Raises:
        SceneError: Says what stands against it.
    """
    if scene.path is None:
        return
    who = f"scene '{scene.name}': path following"
    if scene.scheme_name != "static":
        raise SceneError(
            f"{who} has scheme {show(scene.scheme_name)}; it must be 'static', or path must be "
            "left out"
        )
    if not scene.loads:
        raise SceneError(f"{who} has no load to follow; it must have one at least")
    for load in scene.loads:
        if load.time is not None:
            raise SceneError(
                f"{who}: a {load.label} has a function of time; it must be left out, because the "
                "load factor multiplies all loads"
            )
    moved = [s.label for s in scene.supports if moves(s)]
    moved += [f"driver '{d.name}'" for d in scene.drivers]
    moved += [f"lock of joint '{lock.joint}'" for lock in scene.locks]
    moved += [f"windows of joint '{j.name}'" for j in scene.joints if j.active is not None]
    if moved:
        raise SceneError(
            f"{who}: something is prescribed over time ({moved[0]}); it must be left out, because "
            "loads are followed and there is no time"
        )
