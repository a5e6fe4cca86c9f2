"""Edges and areas of shells welded to a frame: eq. (35) at each of their nodes; and regions.

Each node stays where it is in the frame of a rigid body, of the ground or of a beam's node, and so
does its director. What all of them carry adds up to one force and moment of the joint.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.model.joints.joints import BoundJoint, FindEnd, bind_joint
from shellmb.model.locations.ends import End, frame_about
from shellmb.model.locations.nodes import Meshed, shared_nodes
from shellmb.scene.multibody.joints import Joint, Weld

__all__ = ["BoundNode", "bind"]


@dataclass(frozen=True)
class BoundNode(BoundJoint):
    """One node of a region that is welded.

    Args:
        center: Reference position of the point on the first body that moments are about, (3,), m.
    """

    center: Floats | None = None

    @property
    def about(self) -> Floats | None:
        """One point for all nodes."""
        return self.center

    @property
    def shown(self) -> Floats:
        """Axes of all nodes: those of the scene as they turn with the first body."""
        return np.eye(3)


def bind(joint: Joint, find: FindEnd, shells: Mapping[str, Meshed]) -> list[BoundJoint]:
    """Find the places of a joint: one item, of a weld along a region one for each of its nodes.

    Args:
        joint: Description.
        find: Gives the place on a body: its name, where on it, and who asks.
        shells: Shells and bodies of the user's own by name.

    Raises:
        SceneError: If there is no such place, or a joint along a region has a mass.
    """
    where = joint.second_at
    if isinstance(joint, Weld) and isinstance(where, str) and joint.second in shells:
        body = shells[joint.second]
        if where in body.domain.regions:
            return _bind_region(joint, where, body, find)
    return [bind_joint(joint, find)]


def _bind_region(joint: Weld, region: str, body: Meshed, find: FindEnd) -> list[BoundJoint]:
    if joint.mass:
        raise SceneError(
            f"{joint.said}: mass is {joint.mass:g}; it must be 0 along an edge or an area, where "
            "the masses of bolts are part of a rigid body or of the shell"
        )
    frame = find(joint.first, joint.at, joint.said)
    nodes = shared_nodes(body, region, joint.said)
    found: list[BoundJoint] = []
    for k, (x, director) in enumerate(zip(nodes.x, nodes.directors, strict=True)):
        dofs = {part: nodes.dofs[part][k] for part in ("u", "w")}
        ends = (replace(frame, point=x), End(body.name, body.name, dofs, x, director, x))
        axes = np.array([frame_about(director[0]) if len(director) else np.eye(3)] * 2)
        kind = "shell revolute" if len(director) else "fixed point"
        found.append(BoundNode(joint, kind, ends, axes, center=frame.point))
    return found
