"""Loads that only press on supports: they would have no effect and are refused."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.model.locations.nodes import Meshed, shared_nodes
from shellmb.model.supports.prescribed import Prescribed
from shellmb.scene import Scene
from shellmb.scene.loads.body_loads import FollowerForce, FollowerMoment, PointMoment
from shellmb.scene.loads.loads import EdgeForce, EdgeMoment, FollowerEdgeForce, PointForce
from shellmb.scene.lookup import said
from shellmb.scene.multibody.offsets import Offset, node_of
from shellmb.scene.values.validate import show

# part of a unit vector below which a direction counts as held
NOTHING = 1e-9

# loads at edges and points: the part that they work on, and the name of their components where
# their direction stays; those of the others turns with what they act on
WORKS_ON: dict[type, tuple[str, str | None]] = {
    EdgeForce: ("u", "force"),
    PointForce: ("u", "force"),
    FollowerEdgeForce: ("u", None),
    FollowerForce: ("u", None),
    EdgeMoment: ("w", None),
    PointMoment: ("w", None),
    FollowerMoment: ("w", None),
}


def refuse_idle_loads(scene: Scene, bodies: Mapping[str, Meshed], prescribed: Prescribed) -> None:
    """Refuse loads at edges and points that supports hold against them.

    Args:
        scene: The scene.
        bodies: Shells and beams by name.
        prescribed: What the supports hold.

    Raises:
        SceneError: Names the load and the supports.
    """
    for load in scene.loads:
        if type(load) not in WORKS_ON:
            continue
        (described,) = scene.bodies_of(load)
        if described.name not in bodies:
            continue
        supports = _holding(load, bodies[described.name], prescribed)
        if supports:
            where = getattr(load, "at", None)
            raise SceneError(
                f"{said(load)}: it has no effect at {show(where)} of {said(described)}, where "
                f"{' and '.join(supports)} holds it; it must act elsewhere, or be left out"
            )


def _holding(load: Any, body: Meshed, prescribed: Prescribed) -> list[str]:
    """The supports that hold everything that a load works on; none if something is free."""
    part, components = WORKS_ON[type(load)]
    given = None if components is None else getattr(load, components)
    force = None if given is None or callable(given) else np.array(given)
    if force is not None and not force.any():
        return []
    # at the end of an arm a force turns the node, too
    works = {part: force} | ({"w": None} if isinstance(load.at, Offset) else {})
    nodes = shared_nodes(body, node_of(load.at), said(load))
    found: dict[str, None] = {}
    for part, along in works.items():
        for dofs in nodes.dofs[part]:
            basis, supports = prescribed.held(body.name, dofs)
            if not _held(basis, along):
                return []
            found |= dict.fromkeys(supports)
    return list(found)


def _held(basis: Floats, force: Floats | None) -> bool:
    """Decide whether a direction, or all of them, is in the span of a basis."""
    if force is None:
        return len(basis) == basis.shape[1]
    free = force - basis.T @ (basis @ force)
    return bool(np.linalg.norm(free) < NOTHING * np.linalg.norm(force))
