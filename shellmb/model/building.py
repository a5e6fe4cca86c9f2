"""Stages in which a model is made, each of which returns what it made."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.meshes.mesh import build_surface
from shellmb.meshes.surfaces.shell_lines import ShellLine
from shellmb.model.frames.beam import BeamModel, build_beam
from shellmb.model.frames.rigid import RigidBodies, ground_node, rigid_node
from shellmb.model.frames.rigid_from_mesh import RigidMeshes
from shellmb.model.joints.mechanism import Mechanism
from shellmb.model.locations.nodes import RigidPlaces
from shellmb.model.massless import Scale
from shellmb.model.reduced.data import ModalBody
from shellmb.model.sanity_checks import doubt_slits, doubt_thickness, doubt_units
from shellmb.model.sections.natural import Distributed, doubt_natural
from shellmb.model.shells.joins import join_shells, line_along
from shellmb.model.shells.shell import ShellModel, build_shell
from shellmb.model.supports.prescribed import NodalConstraint, Prescribed
from shellmb.model.supports.supports import SupportRows
from shellmb.model.unknowns import aliases
from shellmb.model.user_bodies.placed import PlacedBody
from shellmb.scene import Beam, Scene, Shell
from shellmb.scene.loads.loads import Gravity, PointLoad
from shellmb.scene.multibody.elements import PointElement
from shellmb.scene.multibody.joints import GROUND


class Meshed(NamedTuple):
    """Bodies with meshes of their own.

    Args:
        shells: The shells by name.
        beams: The beams by name.
        kinks: Constraints of shells that are joined at an angle.
        lines: Lines of beams along edges of shells, by the name of the beam.
    """

    shells: dict[str, ShellModel]
    beams: dict[str, BeamModel]
    kinks: list[NodalConstraint]
    lines: dict[str, ShellLine]

    @property
    def all(self) -> dict[str, ShellModel | BeamModel]:
        """Shells and beams by name."""
        return {**self.shells, **self.beams}


def build_meshed(scene: Scene, comm: MPI.Comm) -> Meshed:
    """Mesh shells and beams, and join them.

    Args:
        scene: The scene.
        comm: Communicator of all meshes.

    Raises:
        SceneError: If something the scene names does not exist on the meshes.
    """
    dynamic = not scene.static
    shells = {
        shell.name: build_shell(shell, build_surface(shell, comm), _loads_of(scene, shell), dynamic)
        for shell in scene.shells
    }
    kinks = _join(scene, shells)
    # joins change directors: lines of shells come after them
    lines = {
        beam.name: line_along(beam, shells[beam.curve.shell])
        for beam in scene.beams
        if beam.curve.shell is not None
    }
    beams = {}
    for beam in scene.beams:
        line = lines[beam.name].line if beam.name in lines else None
        beams[beam.name] = build_beam(beam, comm, _loads_of(scene, beam), dynamic, line)
    found = Meshed(shells, beams, kinks, lines)
    doubt_thickness(comm, found.all.values())
    doubt_slits(comm, shells)
    doubt_units(comm, scene, found.all.values())
    doubt_natural(comm, scene.t_end or 1.0, found.all)
    return found


def _join(scene: Scene, shells: dict[str, ShellModel]) -> list[NodalConstraint]:
    """Join shells along edges; returns the constraints of kinks."""
    kinks = []
    for join in scene.joins:
        first, second = shells[join.first], shells[join.second]
        links, constraint = join_shells(join, first, second)
        second.links += tuple(links)
        if constraint is not None:
            constraint.inertialess = first.inertialess and second.inertialess
            kinks.append(constraint)
    return kinks


def _loads_of(scene: Scene, body: Shell | Beam) -> list[Distributed]:
    """Distributed loads of a body, and its natural strain, whose stress is one.

    Loads at points are bodies of the system themselves.
    """
    found: list[Distributed] = [
        load
        for load in scene.loads
        if not isinstance(load, PointLoad) and body in scene.bodies_of(load)
    ]
    return found if body.natural is None else [*found, body.natural]


def build_rigid(scene: Scene, scale: Scale) -> RigidBodies | None:
    """Rigid bodies and ground; None without any.

    Args:
        scene: The scene.
        scale: Communicator and sizes.
    """
    nodes = [rigid_node(body, scale.length) for body in scene.rigid_bodies]
    if _uses_ground(scene):
        nodes.append(ground_node())
    if not nodes:
        return None
    gravity = [
        (load, frozenset(body.name for body in scene.bodies_of(load)))
        for load in scene.loads
        if isinstance(load, Gravity)
    ]
    return RigidBodies(scale, nodes, not scene.static, gravity)


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
