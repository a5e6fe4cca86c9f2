"""Ends of arms on shells and beams that are declared rigid: points of the rigid bodies."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from shellmb.model.frames.beam import BeamModel
from shellmb.model.locations.nodes import shared_nodes
from shellmb.model.shells.shell import ShellModel
from shellmb.scene import Scene
from shellmb.scene.lookup import said
from shellmb.scene.multibody.joints import Weld
from shellmb.scene.multibody.offsets import Offset, arm_components

__all__ = ["RigidMeshes", "ended", "pointed"]

RigidMeshes = dict[str, ShellModel | BeamModel]


def pointed(item: Any, scene: Scene, meshes: RigidMeshes) -> Any:
    """A load or probe with the point that it is at on a rigid body; collective.

    Args:
        item: The load or probe.
        scene: The scene.
        meshes: Meshes of the bodies that are rigid, by name.
    """
    point = getattr(item, "at", None)
    if not isinstance(point, Offset):
        return item
    (target,) = scene.bodies_of(item)
    if target.name not in meshes:
        return item
    return replace(item, at=_end(point, meshes[target.name], said(item)))


def ended(item: Any, meshes: RigidMeshes) -> Any:
    """A joint or force element with its ends on rigid bodies; of a weld along a region one node.

    Args:
        item: It.
        meshes: Meshes of the bodies that are rigid, by name.
    """
    ends = {
        at: (getattr(item, at), meshes[getattr(item, body)])
        for at, body in (("at", "first"), ("second_at", "second"))
        if isinstance(getattr(item, at, None), Offset) and getattr(item, body) in meshes
    }
    changed: dict[str, Any] = {
        at: _end(offset, mesh, said(item)) for at, (offset, mesh) in ends.items()
    }
    mesh = meshes.get(getattr(item, "second", ""))
    if isinstance(item, Weld) and isinstance(mesh, ShellModel) and isinstance(item.second_at, str):
        # two rigid bodies: any point of both will do
        x = shared_nodes(mesh, item.second_at, said(item)).x[0]
        changed |= {"at": tuple(map(float, x)), "second_at": None}
    return replace(item, **changed) if changed else item


def _end(offset: Offset, mesh: ShellModel | BeamModel, who: str) -> tuple[float, ...]:
    nodes = shared_nodes(mesh, offset.at, who)
    arm = arm_components(offset.by, nodes.directors[0], who, f"'{mesh.name}'")
    return tuple(float(c) for c in nodes.x[0] + arm @ nodes.directors[0])
