"""Third stage: what holds and moves bodies."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from mpi4py import MPI

from shellmb.errors import SceneError
from shellmb.model.building.links import aliases
from shellmb.model.building.meshed import Meshed
from shellmb.model.frames.beam import BeamModel
from shellmb.model.joints.mechanism import Mechanism
from shellmb.model.shells.shell import ShellModel
from shellmb.model.supports.nodal import NodalConstraint
from shellmb.model.supports.prescribed import Prescribed
from shellmb.model.supports.supports import SupportRows
from shellmb.scene import Scene

# times, in parts of the run, at which what supports prescribe is compared: its ends, and times
# that no period falls on
COMPARED = (0.0, 0.137, 0.371, 0.618, 0.863, 1.0)


class Held(NamedTuple):
    """Dofs that supports hold.

    Args:
        planes: Planes that are not axis-parallel and hold nodes.
        prescribed: What all supports prescribe.
    """

    planes: list[NodalConstraint]
    prescribed: Prescribed


def hold(scene: Scene, comm: MPI.Comm, meshed: Meshed, places: Mapping[str, Any]) -> Held:
    """Hold and move bodies; what all supports prescribe is looked through at once.

    Args:
        scene: The scene.
        comm: Communicator.
        meshed: Its shells and beams.
        places: All bodies with meshes, by name.

    Raises:
        SceneError: If supports contradict one another.
    """
    times = [part * scene.given_until for part in COMPARED]
    prescribed = Prescribed(aliases([*meshed.shells.values()], comm), times, scene.linear)
    planes: list[NodalConstraint] = []
    for support in scene.supports:
        for body in scene.bodies_of(support):
            held, dynamic = places[body.name], not scene.static
            rows = SupportRows(support, held, body, prescribed, dynamic)
            rows.collect()
            planes += rows.arms
    return Held([*planes, *prescribed.settle()], prescribed)


def check_turnable(
    scene: Scene, mechanism: Mechanism, meshed: Mapping[str, ShellModel | BeamModel]
) -> None:
    """Check that directors with joints on them have inertia in motion, or velocities are open.

    Args:
        scene: The scene.
        mechanism: Its joints.
        meshed: Its shells and beams by name.

    Raises:
        SceneError: Names joint and body.
    """
    if scene.static:
        return
    for joint in mechanism.joints.values():
        for end, directors in zip(joint.ends, joint.key[1:], strict=True):
            body = meshed.get(end.owner)
            if body is not None and directors and "lam" not in body.jump_parts:
                raise SceneError(
                    f"{joint.joint.said}: the directors of '{end.owner}' have no inertia; it must "
                    "have rotary_inertia=True and a section with second moments, or the joint "
                    "must hold positions only"
                )
