"""Second stage: rigid bodies and ground as nodes, and the units of length and force."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats
from shellmb.model.building.meshed import Meshed
from shellmb.model.frames.rigid import GROUND, RigidBodies, ground_node, rigid_node
from shellmb.model.frames.rigid_from_mesh import RigidMeshes
from shellmb.model.locations.finder import RigidPlaces
from shellmb.model.reduced.data import ModalBody
from shellmb.model.user_bodies.placed import PlacedBody
from shellmb.scene import Scene
from shellmb.scene.loads.loads import Gravity
from shellmb.scene.multibody.elements import PointElement


def build_rigid(scene: Scene, comm: MPI.Comm, force: float, length: float) -> RigidBodies | None:
    """Rigid bodies and ground; None without any.

    Args:
        scene: The scene.
        comm: Communicator.
        force: Unit of the multipliers of constraints, N.
        length: Characteristic length of the scene, m.
    """
    nodes = [rigid_node(body, length) for body in scene.rigid_bodies]
    if _uses_ground(scene):
        nodes.append(ground_node())
    if not nodes:
        return None
    gravity = [
        (load, frozenset(body.name for body in scene.bodies_of(load)))
        for load in scene.loads
        if isinstance(load, Gravity)
    ]
    return RigidBodies(comm, nodes, not scene.static, gravity, force, length)


def _uses_ground(scene: Scene) -> bool:
    ends = [(j.first, j.second) for j in scene.joints]
    ends += [(e.first, e.second) for e in scene.force_elements if isinstance(e, PointElement)]
    return any(GROUND in pair for pair in ends)


def scene_length(
    scene: Scene, meshed: Mapping[str, Any], rigid_meshes: RigidMeshes, modal: Sequence[ModalBody]
) -> float:
    """Diagonal of the box around all reference points of rigid bodies, or the largest mesh.

    Where all are at one point, the largest radius of gyration.

    Args:
        scene: The scene.
        meshed: Its bodies with meshes, by name.
        rigid_meshes: Meshes of shells and beams that are rigid.
        modal: Bodies that are reduced to modes.
    """
    points = scene_points(scene)
    box = float(np.linalg.norm(np.ptp(points, axis=0))) if len(points) else 0.0
    meshes = (*meshed.values(), *rigid_meshes.values())
    sizes = [*(m.domain.length for m in meshes), *(data.length for data in modal)]
    # of bodies that are all at one point, their radii of gyration
    turns = [
        math.sqrt(float(np.trace(body.inertia_tensor)) / 2 / body.mass)
        for body in scene.rigid_bodies
        if body.mass > 0
    ]
    return max([box, *sizes]) or max(turns, default=0.0) or 1.0


def scene_points(scene: Scene) -> Floats:
    """Reference points of rigid bodies and of joints, shape (n, 3), m.

    Args:
        scene: The scene.
    """
    points = [body.center for body in scene.rigid_bodies]
    points += [body.place(name) for body in scene.rigid_bodies for name in body.point_names]
    points += [np.asarray(j.at) for j in scene.joints if isinstance(j.at, tuple)]
    return np.array(points).reshape(-1, 3)


def force_unit(scene: Scene, meshed: Meshed, own: Mapping[str, PlacedBody], length: float) -> float:
    """Size of the forces between bodies: what moves the scene's mass by its length in a step.

    Args:
        scene: The scene.
        meshed: Its shells and beams.
        own: Its bodies of the user's own.
        length: Characteristic length of the scene, m.
    """
    if scene.static:
        return max((body.force_size for body in meshed.all.values()), default=1.0)
    mass = sum(body.mass for body in scene.rigid_bodies)
    mass += sum(s.section.sizes.mass * s.domain.length**2 for s in meshed.shells.values())
    mass += sum(body.total_mass for body in own.values())
    mass += sum(b.beam.section.mass[0] * b.domain.length for b in meshed.beams.values())
    assert scene.dt is not None
    return (mass or 1.0) * length / scene.dt**2


def rigid_places(scene: Scene, rigid: RigidBodies | None) -> dict[str, RigidPlaces]:
    """Places on rigid bodies and ground, by the name of the body.

    Args:
        scene: The scene.
        rigid: Its rigid bodies.
    """
    if rigid is None:
        return {}
    ends = rigid.ends()
    places = {
        body.name: RigidPlaces(
            ends[body.name],
            {name: body.place(name) for name in body.point_names},
            body.place(None),
        )
        for body in scene.rigid_bodies
    }
    if GROUND in ends:
        places[GROUND] = RigidPlaces(ends[GROUND], {}, np.zeros(3))
    return places
