"""The model: all bodies of a scene, bound to meshes, joined, supported and loaded."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.meshes.lifetime import make_room
from shellmb.model.body import Body
from shellmb.model.building import (
    build_meshed,
    build_rigid,
    check_turnable,
    force_unit,
    hold,
    rigid_places,
    scene_length,
    scene_points,
)
from shellmb.model.frames.beam import BeamModel
from shellmb.model.frames.rigid import RigidBodies
from shellmb.model.frames.rigid_from_mesh import RigidMeshes, rigidified
from shellmb.model.joints.constraints import ConstraintGroup
from shellmb.model.joints.mechanism import Mechanism, build_mechanism
from shellmb.model.locations.nodes import Finder
from shellmb.model.massless import Scale
from shellmb.model.potentials.contact import PotentialGroup, potential_groups
from shellmb.model.potentials.volume import Filling, Volume, enclosed_volumes
from shellmb.model.reduced.data import ModalBody
from shellmb.model.reduced.modal import modal_bodies, modal_points
from shellmb.model.sanity_checks import check_probes, doubt_unjoined
from shellmb.model.shell_contact.faces import FacesContact, faces_contacts
from shellmb.model.shells.joins import glue_beams
from shellmb.model.shells.shell import ShellModel
from shellmb.model.signals import Signals
from shellmb.model.supports.pointloads import point_loads
from shellmb.model.supports.prescribed import NodalConstraint
from shellmb.model.supports.supports import refuse_idle_loads
from shellmb.model.unknowns import resolve_links
from shellmb.model.user_bodies.placed import PlacedBody, build_own_bodies
from shellmb.scene import Scene
from shellmb.scene.multibody.joints import GROUND
from shellmb.scene.multibody.rolling import Contact


@dataclass(frozen=True, eq=False)
class Model:
    """Everything that has unknowns.

    Args:
        scene: The scene it was made from, with rigid bodies for shells and beams that are rigid.
        comm: Communicator.
        signals: What controllers command and events switch.
        bodies: All bodies of the system.
        shells: The shells by name.
        beams: The beams by name.
        own: Bodies of the user's own with places, by name.
        rigid: The rigid bodies, and ground; None without any.
        mechanism: Joints, and what drives and resists them.
        length: Characteristic length of the scene, m.
        force: Unit of the multipliers of constraints, N.
        rigid_meshes: Meshes of the shells and beams that are rigid, by name: they have no unknowns.
        planes: Planes that are not axis-parallel and hold nodes; among `bodies`, too.
        potentials: Potentials and contacts; among `bodies`, too.
        volumes: Enclosed volumes; their bodies are among `bodies`, too.
        faces: Contacts with faces of shells, which are no bodies.
        modal: What is reduced to modes; its frames are among `rigid`.
    """

    scene: Scene
    comm: MPI.Comm
    signals: Signals
    bodies: list[Body]
    shells: dict[str, ShellModel]
    beams: dict[str, BeamModel]
    own: dict[str, PlacedBody]
    rigid: RigidBodies | None
    mechanism: Mechanism
    length: float
    force: float
    rigid_meshes: RigidMeshes
    planes: list[NodalConstraint]
    potentials: list[PotentialGroup]
    volumes: list[Volume]
    faces: list[FacesContact]
    modal: tuple[ModalBody, ...]

    @property
    def meshed(self) -> dict[str, ShellModel | BeamModel]:
        """Shells and beams by name."""
        return {**self.shells, **self.beams}

    @property
    def stores(self) -> list[PotentialGroup | Filling]:
        """Potentials, contacts and gases: what has an energy of its own in the balance."""
        return [*self.potentials, *(v.filling for v in self.volumes if v.item.gas is not None)]

    @property
    def outside(self) -> list[Body]:
        """Bodies whose forces come from outside.

        Equations of a user may hold a direction in space: moments of such joints do not cancel.
        """
        own = [group for group in self.mechanism.groups if group.kind == "own"]
        return [*self.potentials, *(part for v in self.volumes for part in v.surfaces), *own]

    @cached_property
    def farthest(self) -> float:
        """Largest coordinate of reference points, m, of which all places have the round-off."""
        every = (*self.meshed.values(), *self.own.values())
        meshes = [body.domain.mesh.geometry.x for body in every]
        here = max(float(np.abs(x).max(initial=0.0)) for x in (scene_points(self.scene), *meshes))
        return float(self.comm.allreduce(here, op=MPI.MAX))

    def nodes_of(self, name: str) -> tuple[Body, Ints, Floats, Floats]:
        """Nodes of a body with places on this rank.

        Args:
            name: Name of the body in the scene.

        Returns:
            The body of the system, the nodes' numbers among its nodes (owned and ghost), reference
            positions (n, 3) and directors (n, m, 3).
        """
        meshed: dict[str, Any] = {**self.meshed, **self.own}
        body: Any = meshed.get(name, self.rigid)
        X, D = body.node_positions(), body.node_directors()
        here = np.arange(len(X))
        if name not in meshed:
            here = np.flatnonzero(body.node_mesh.item == body.index[name])
        return body, here, X[here], D[here]

    def coupled(self, body: Body) -> bool:
        """Decide whether constraints tie a body's velocity jump to others: it is unknown then.

        Args:
            body: A body of the system.
        """
        scene = self.scene
        tied = scene.joints or scene.force_elements or scene.volumes or scene.own_bodies
        if not (self.beams or self.rigid is not None or tied):
            return False
        return bool(body.kinematic) or isinstance(body, ConstraintGroup)

    @property
    def slides(self) -> bool:
        """Decide whether bodies roll or slide: constraints hold velocities at the end of a step."""
        return any(isinstance(joint, Contact) for joint in self.scene.joints)

    @property
    def elements(self) -> int:
        """Number of elements."""
        return sum(
            m.domain.mesh.topology.index_map(m.domain.mesh.topology.dim).size_global
            for m in (*self.meshed.values(), *self.own.values())
        )

    @property
    def supported(self) -> bool:
        """Decide whether anything is supported or driven."""
        return bool(self.scene.supports) or (self.rigid is not None and GROUND in self.rigid.index)


def build_model(
    scene: Scene,
    comm: MPI.Comm,
    modal: Sequence[ModalBody] = (),
    force: float | None = None,
    length: float | None = None,
) -> Model:
    """Mesh the bodies and bind supports, loads and joints to them.

    Args:
        scene: A validated scene.
        comm: Communicator of all meshes.
        modal: Bodies that are reduced to modes, with rigid bodies of the scene for their frames.
        force: Unit of the multipliers of constraints, N; None: what forces are alike to. A model
            that is to take the multipliers of another one has to have its unit.
        length: Characteristic length, m, of which the same is true; None: that of the scene.

    Raises:
        SceneError: If something the scene names does not exist on the meshes.
    """
    make_room(comm, len(scene.shells) + len(scene.beams))
    described, (scene, rigid_meshes) = scene, rigidified(scene, comm)
    signals, dynamic = Signals(scene), not scene.static

    meshed = build_meshed(scene, comm)
    shells, beams, kinks, lines = meshed
    own = build_own_bodies(scene, comm)
    placed = {name: body for name, body in own.items() if isinstance(body, PlacedBody)}
    places: dict[str, Any] = {**meshed.all, **placed}
    if length is None:
        length = scene_length(scene, places, rigid_meshes, modal)
    if force is None:
        force = force_unit(scene, meshed, placed, length)
    scale = Scale(comm, force, length)

    rigid = build_rigid(scene, scale)
    bodies: list[Body] = [*shells.values(), *beams.values(), *own.values()]
    bodies += [] if rigid is None else [rigid]
    bodies += kinks
    bodies += [] if rigid is None else modal_bodies(scale, modal, rigid, dynamic)

    planes, prescribed = hold(scene, comm, meshed, places)
    refuse_idle_loads(scene, meshed.all, prescribed)
    find = Finder(places, rigid_places(scene, rigid))
    bodies += [*planes, *glue_beams(scene, beams, shells, lines)]
    hinged: dict[str, Any] = {**shells, **placed}
    mechanism = build_mechanism(scene, scale, find, hinged, signals)
    check_turnable(scene, mechanism, meshed.all)
    bodies += mechanism.bodies

    bodies += point_loads(scene, comm, find)
    touched, meshes = modal_points(bodies, rigid), (meshed.all, rigid_meshes)
    potentials = potential_groups(described, comm, find, *meshes, touched, length)
    bodies += potentials

    volumes = enclosed_volumes(scene, scale, shells, prescribed)
    bodies += [body for volume in volumes for body in volume.bodies]

    resolve_links(bodies, comm)
    check_probes(scene, places)
    doubt_unjoined(described, comm, {**rigid_meshes, **meshed.all})
    return Model(
        scene=scene,
        comm=comm,
        signals=signals,
        bodies=bodies,
        shells=shells,
        beams=beams,
        own=placed,
        rigid=rigid,
        mechanism=mechanism,
        length=length,
        force=force,
        rigid_meshes=rigid_meshes,
        planes=planes,
        potentials=potentials,
        volumes=volumes,
        faces=faces_contacts(described, find, *meshes, shells, length),
        modal=tuple(modal),
    )
