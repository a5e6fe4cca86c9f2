"""Shells and beams declared rigid, which are replaced by rigid bodies before all else is built.

Mass, centre of mass and inertia are those of the flexible model: its own mass forms are evaluated
for the velocities `a` and `(b . X) a` of its nodes, with `(b . D) a` of its directors, of which all
rigid motions consist. So kinetic energies agree to round-off, whatever quadrature the forms use.
"""

import itertools
from collections.abc import Collection, Container
from dataclasses import dataclass, replace
from typing import Any

from mpi4py import MPI

import numpy as np
from dolfinx import fem

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.meshes.mesh import build_surface
from shellmb.model.frames.beam import BeamModel, build_beam
from shellmb.model.joints.edge_hinges import edges_together, hinge_line
from shellmb.model.locations.nodes import shared_nodes
from shellmb.model.shells.joins import line_along
from shellmb.model.shells.shell import ShellModel
from shellmb.native.kernels import compiled
from shellmb.scene import Gravity, RigidBody, Scene
from shellmb.scene.loads.loads import FollowerForce, FollowerMoment, Load, PointForce, PointMoment
from shellmb.scene.lookup import said
from shellmb.scene.multibody.joints import FramedHinge, Joint, Revolute, Weld
from shellmb.scene.multibody.offsets import Offset, node_of

RigidMeshes = dict[str, ShellModel | BeamModel]
Triple = tuple[float, float, float]
# the ends of a joint or force element
BOTH = (("first", "at"), ("second", "second_at"))


class SceneMeshes:
    """Shells and beams of a scene on their meshes, without loads, made when they are asked for.

    Args:
        scene: The scene.
        comm: Communicator; calls are collective.
        dynamic: Whether they have inertia.
    """

    def __init__(self, scene: Scene, comm: MPI.Comm, dynamic: bool) -> None:
        self._scene, self._comm, self._dynamic = scene, comm, dynamic
        self._made: RigidMeshes = {}

    def __call__(self, name: str) -> Any:
        """One of them by its name."""
        if name not in self._made:
            body: Any = self._scene.body(name)
            if body.directors == 1:
                surface = build_surface(body, self._comm)
                self._made[name] = ShellModel(body, surface, [], self._dynamic)
            else:
                along = body.along
                line = None if along is None else line_along(body, self(along)).line
                self._made[name] = build_beam(body, self._comm, [], self._dynamic, line)
        return self._made[name]

    def shell(self, name: str) -> ShellModel | None:
        """A shell by its name; None: no shell has it."""
        return self(name) if any(s.name == name for s in self._scene.shells) else None


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
    return replace(item, at=place_of(point, meshes[target.name], said(item)))


def ended(item: Any, meshes: RigidMeshes) -> Any:
    """A joint or force element with its ends on rigid bodies; of a weld along a region one node.

    Args:
        item: It.
        meshes: Meshes of the bodies that are rigid, by name.
    """
    changed: dict[str, Any] = {}
    for body, at in BOTH if hasattr(item, "second") else ():
        mesh, where = meshes.get(getattr(item, body)), getattr(item, at)
        region = at == "second_at" and item.of_regions and isinstance(where, str)
        if mesh is not None and region and mesh.described.directors == 1:
            # two rigid bodies: any point of both will do
            changed |= {"at": place_of(where, mesh, said(item)), "second_at": None}
        elif mesh is not None and isinstance(where, Offset):
            changed[at] = place_of(where, mesh, said(item))
    return replace(item, **changed) if changed else item


def place_of(where: Any, mesh: Any, who: str) -> Triple:
    """Coordinates of a place on a shell or beam, or of an offset from one; collective.

    Args:
        where: The place.
        mesh: The shell or beam.
        who: Who asks, for the error.
    """
    return triple(shared_nodes(mesh, node_of(where), who).off(where, who, mesh.name))


# a rigid body turns about every axis with some inertia, relative to the largest
NO_INERTIA = 1e-12

# loads that act on a rigid body as on a mesh
ON_RIGID = (Gravity, PointForce, PointMoment, FollowerForce, FollowerMoment)


@dataclass(frozen=True)
class Inertia:
    """Mass of bodies and how it is distributed.

    Args:
        mass: Mass, kg.
        center: Centre of mass, shape (3,), m.
        euler: Euler's tensor `int rho y y` about the centre in the scene's axes, (3, 3), kg m^2.
    """

    mass: float
    center: Floats
    euler: Floats

    @property
    def tensor(self) -> Floats:
        """Inertia about the centre in the scene's axes, shape (3, 3), kg m^2."""
        found = np.trace(self.euler) * np.eye(3) - self.euler
        return (found + found.T) / 2

    @property
    def lacking(self) -> bool:
        """Decide whether there is none about some axis."""
        principal = np.linalg.eigvalsh(self.tensor)
        return bool(principal[0] < NO_INERTIA * principal[2])


def inertia_of(bodies: Collection[ShellModel | BeamModel]) -> Inertia:
    """Mass and inertia of shells and beams together by their own mass forms; collective.

    Args:
        bodies: Bodies that have inertia.
    """
    comm: MPI.Comm = next(iter(bodies)).mixed.space.mesh.comm
    # about a point nearby: far away from the origin nothing must cancel
    every = np.concatenate([body.mixed.nodes("u") for body in bodies])
    middle = comm.allreduce(every.sum(axis=0), op=MPI.SUM) / comm.allreduce(len(every), op=MPI.SUM)
    gram = np.zeros((4, 4))
    for body in bodies:
        ends = [fem.Function(body.mixed.space) for _ in range(2)]
        form = body.inertia(*ends)
        if form is None:
            continue
        kernel, X, D = compiled(form), body.mixed.nodes("u"), body.node_directors()
        u = body.mixed.dofs["u"].reshape(-1, 3)[:, 0]
        w = body.mixed.dofs["w"].reshape(D.shape)[:, :, 0]
        for pair in itertools.combinations_with_replacement(range(4), 2):
            for function, k in zip(ends, pair, strict=True):
                # a velocity along x, growing with the coordinate k; uniform for k = 3
                function.x.array[u] = 1.0 if k == 3 else X[:, k] - middle[k]
                function.x.array[w] = 0.0 if k == 3 else D[:, :, k]
            gram[pair] += fem.assemble_scalar(kernel)
    gram = comm.allreduce(np.triu(gram) + np.triu(gram, 1).T, op=MPI.SUM)
    mass = float(gram[3, 3])
    away = gram[3, :3] / mass if mass > 0 else np.zeros(3)
    return Inertia(mass, middle + away, gram[:3, :3] - mass * np.outer(away, away))


def rigid_body(body: ShellModel | BeamModel, dynamic: bool) -> RigidBody:
    """The rigid body that a shell or beam becomes; collective.

    Its reference point is its centre of mass, its axes are those of the scene, or the directors at
    the start of a beam.

    Args:
        body: The body.
        dynamic: Whether it needs inertia.

    Raises:
        SceneError: If it has no inertia about some axis and needs it.
    """
    found = inertia_of([body])
    axes = body.rigid_axes
    if dynamic and found.lacking:
        raise SceneError(
            f"{said(body.described)} is rigid and has no inertia about one of its axes; it must "
            "have rotary_inertia=True"
        )
    return RigidBody(
        body.name,
        found.mass,
        _rows(axes.T @ found.tensor @ axes),
        triple(found.center),
        _rows(axes),
        points={
            name: triple(axes.T @ (x - found.center)) for name, x in body.domain.points.items()
        },
    )


def triple(vector: Any) -> Triple:
    """A vector as a description has it."""
    x, y, z = map(float, vector)
    return x, y, z


def _rows(matrix: Floats) -> Any:
    return tuple(triple(row) for row in matrix)


def rigidified(scene: Scene, comm: MPI.Comm) -> tuple[Scene, RigidMeshes]:
    """The scene with rigid bodies in place of the shells and beams that are declared rigid.

    Joints, point loads, gravity, initial velocities and probes stay as they are. A shell revolute
    joint becomes a revolute one about the shell's director. What a rigid shell is joined or glued
    to must be rigid too, and is welded; a beam glued to a rigid shell always is.

    Args:
        scene: The scene.
        comm: Communicator; the call is collective.

    Returns:
        The scene and, for pictures, the bodies that were replaced, by name.

    Raises:
        SceneError: If a rigid body is supported or loaded as only a flexible one can be.
    """
    names = {b.name for b in scene.meshed if b.rigid}
    names |= {glue.beam for glue in scene.glues if glue.shell in names}
    if not names:
        return scene, {}
    _check(scene, names)
    dynamic, made = not scene.static, SceneMeshes(scene, comm, True)
    meshes: RigidMeshes = {b.name: made(b.name) for b in scene.meshed if b.name in names}
    bodies = {name: rigid_body(mesh, dynamic) for name, mesh in meshes.items()}
    changed = replace(
        scene,
        shells=tuple(s for s in scene.shells if s.name not in names),
        beams=tuple(b for b in scene.beams if b.name not in names),
        rigid_bodies=(*scene.rigid_bodies, *bodies.values()),
        loads=tuple(
            pointed(_load(load, scene, meshes, bodies), scene, meshes) for load in scene.loads
        ),
        joints=(
            *(
                ended(hinged(about_director(j, scene, names, made), names, made), meshes)
                for j in scene.joints
            ),
            *_welds(scene, meshes),
        ),
        force_elements=tuple(ended(element, meshes) for element in scene.force_elements),
        probes=tuple(pointed(probe, scene, meshes) for probe in scene.probes),
        joins=tuple(j for j in scene.joins if j.first not in names),
        glues=tuple(g for g in scene.glues if g.beam not in names),
        # on the meshes of what is rigid: bound from the scene as it was given
        potentials=(),
        contacts=(),
        # stresses are those of the scene as it was given
        reserves=(),
    )
    return changed, meshes


def _check(scene: Scene, names: set[str]) -> None:
    for body in scene.meshed:
        if body.name in names and body.terms:
            raise SceneError(f"{said(body)} is rigid and has terms; a rigid body must not have any")
    for support in scene.supports:
        for target in scene.bodies_of(support):
            if target.name in names:
                raise SceneError(
                    f"{support.label}: {said(target)} is rigid; fix it by joints to the ground, "
                    "a Weld for example"
                )
    for load in scene.loads:
        for target in scene.bodies_of(load):
            if target.name in names and not isinstance(load, ON_RIGID):
                raise SceneError(
                    f"{load.label}: {said(target)} is rigid; its loads must be gravity, or forces "
                    "and moments at points"
                )
    for join in scene.joins:
        if (join.first in names) != (join.second in names):
            raise SceneError(
                f"join of '{join.first}' and '{join.second}': one of them is rigid and the other "
                "is not; both must be, or they must be connected by joints at nodes"
            )
    for glue in scene.glues:
        if glue.beam in names and glue.shell not in names:
            raise SceneError(
                f"glue: beam '{glue.beam}' is rigid and shell '{glue.shell}' is not; the beam must "
                "be flexible, or the shell rigid too"
            )


def _load(load: Any, scene: Scene, meshes: RigidMeshes, bodies: dict[str, RigidBody]) -> Load:
    """A load along the directors of a beam's node, along the axes of the rigid body."""
    if not (load.at_point and hasattr(load, "components")):
        return load
    (target,) = scene.bodies_of(load)
    if target.name not in meshes:
        return load
    nodes = shared_nodes(meshes[target.name], node_of(load.at), load.label)
    vector = np.asarray(load.components) @ nodes.directors[0]
    return replace(load, components=triple(bodies[target.name].axes.T @ vector))


def about_director(
    joint: Joint, scene: Scene, framed: Container[str], meshes: SceneMeshes
) -> Joint:
    """A shell revolute joint on a shell with a frame turns about the director that was its own.

    Args:
        joint: The joint.
        scene: The scene.
        framed: Names of what frames move.
        meshes: Meshes of the scene.
    """
    if not joint.about_director or joint.second not in framed:
        return joint
    where = joint.second_at if joint.second_at is not None else _first_place(joint, scene)
    nodes = shared_nodes(meshes(joint.second), node_of(where), joint.said)
    shared = ("name", "first", "second", "at", "second_at", "mass", "active")
    return Revolute(
        **{name: getattr(joint, name) for name in shared}, axis=triple(nodes.director[0])
    )


def hinged(joint: Any, framed: Container[str], meshes: SceneMeshes) -> Joint:
    """A hinge of edges of shells that frames move: on these, or a revolute joint without others.

    Args:
        joint: The joint.
        framed: Names of shells whose edges move as frames.
        meshes: Meshes of the scene.

    Raises:
        SceneError: If the edges of two shells do not lie on each other.
    """
    ends = {joint.first: joint.at, joint.second: joint.second_at}
    moved = [name for name in ends if name in framed]
    if not joint.along_edges or not moved:
        return joint
    both = [meshes.shell(name) for name in ends]
    first, second = both
    if first is not None and second is not None:
        edges_together(joint, first, second)
    if len(moved) < len([shell for shell in both if shell is not None]):
        gone: dict[str, Any] = {"at" if n == joint.first else "second_at": None for n in moved}
        return replace(joint, **gone)
    name = moved[-1]
    x = shared_nodes(meshes(name), str(ends[name]), joint.said).x
    axis = hinge_line(joint, x, meshes(name).surface_mesh.length, f"shell '{name}'")
    middle = triple((x[0] + x[-1]) / 2)
    return FramedHinge(joint.name, joint.first, joint.second, at=middle, axis=triple(axis))


def _first_place(joint: Joint, scene: Scene) -> Any:
    """Coordinates of the first end of a joint."""
    if joint.at is not None and not isinstance(joint.at, str):
        return joint.at
    first: Any = scene.body(joint.first)
    if first.single:
        return tuple(first.place(joint.at))
    known = first.curve.points if first.directors == 3 else {}
    if joint.at not in known:
        raise SceneError(f"{joint.said}: second_at is missing; give coordinates on the rigid shell")
    return known[joint.at]


def _welds(scene: Scene, meshes: RigidMeshes) -> list[Joint]:
    """Rigid bodies that share an edge or a line are welded at a node of it."""
    welds: list[Joint] = []
    for join in scene.joins:
        if join.first in meshes:
            who = f"join of {join.first} and {join.second}"
            x = shared_nodes(meshes[join.first], join.at, who).x[0]
            welds.append(Weld(who, join.first, join.second, at=triple(x)))
    for glue in scene.glues:
        if glue.shell in meshes:
            who = f"glue of {glue.beam} and {glue.shell}"
            start = meshes[glue.beam].domain.points["start"]
            welds.append(Weld(who, glue.beam, glue.shell, at=triple(start)))
    return welds
