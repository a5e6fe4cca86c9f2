"""Places on bodies by name: what joints, springs and loads are attached to."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.model.frames.rigid import GROUND
from shellmb.model.locations.ends import End
from shellmb.model.locations.nodes import Meshed, shared_nodes
from shellmb.scene.multibody.offsets import Offset, arm_components

Where = str | tuple[float, float, float] | Offset | None


@dataclass(frozen=True)
class RigidPlaces:
    """Places of the points of a rigid body.

    Args:
        end: Its centre of mass as a place.
        points: Named points in the reference configuration.
        reference: Its reference point.
    """

    end: End
    points: Mapping[str, Floats]
    reference: Floats


class Finder:
    """Finds places on bodies.

    Args:
        meshed: Shells and beams by name.
        rigid: Rigid bodies, and ground if there is any, by name.
    """

    def __init__(self, meshed: Mapping[str, Meshed], rigid: Mapping[str, RigidPlaces]) -> None:
        self._meshed, self._rigid = meshed, rigid

    def __call__(self, body: str, where: Where, who: str) -> End:
        """The place; collective.

        Args:
            body: Name of a body, or "ground".
            where: Name of a point, reference coordinates, an offset from one of these, or None for
                a rigid body's own point.
            who: Who asks, for the error.

        Raises:
            SceneError: If there is no such point, or no single node there.
        """
        if body in self._rigid:
            return self._on_rigid(body, where, who)
        return self._on_mesh(self._meshed[body], where, who)

    def _on_rigid(self, body: str, where: Where, who: str) -> End:
        places = self._rigid[body]
        if where is None:
            return replace(places.end, point=places.reference)
        if isinstance(where, Offset):
            raise AssertionError("the scene has refused it")
        if not isinstance(where, str):
            return replace(places.end, point=np.asarray(where, dtype=float))
        if where not in places.points:
            known = ", ".join(f"'{name}'" for name in places.points) or "none"
            what = "ground" if body == GROUND else f"rigid body '{body}'"
            raise SceneError(
                f"{who}: {what} has no point '{where}'; its points are {known}, or give coordinates"
            )
        return replace(places.end, point=places.points[where])

    def _on_mesh(self, body: Meshed, where: Where, who: str) -> End:
        if where is None:
            raise SceneError(f"{who}: at is missing; body '{body.name}' needs one of its nodes")
        node = where.at if isinstance(where, Offset) else where
        nodes = shared_nodes(body, node, who)
        if len(nodes.x) != 1:
            raise SceneError(
                f"{who}: there are {len(nodes.x)} nodes of '{body.name}' at '{node}'; give a "
                "single point"
            )
        dofs = {part: nodes.dofs[part][0] for part in ("u", "w")}
        point = nodes.x[0]
        if isinstance(where, Offset):
            arm = arm_components(where.by, nodes.directors[0], who, f"'{body.name}'")
            point = point + arm @ nodes.directors[0]
        return End(body.name, body.name, dofs, nodes.x[0], nodes.directors[0], point)
