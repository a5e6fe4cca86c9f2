"""The model: all bodies of a scene, bound to meshes, joined, supported and loaded."""

import math
from collections.abc import Sequence
from functools import cached_property, partial
from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.errors import SceneError
from shellmb.meshes.lifetime import make_room
from shellmb.meshes.mesh import build_surface
from shellmb.model import sanity_checks
from shellmb.model.body import Body
from shellmb.model.frames.beam import BeamModel, build_beam
from shellmb.model.frames.rigid import GROUND_FRAME, RigidBodies
from shellmb.model.frames.rigid_from_mesh import rigidified
from shellmb.model.joints.constraints import ConstraintGroup
from shellmb.model.joints.mechanism import Mechanism
from shellmb.model.locations.nodes import place_on
from shellmb.model.massless import Scale
from shellmb.model.potentials.contact import PotentialGroup, potential_groups
from shellmb.model.potentials.points import ActingPoints
from shellmb.model.potentials.volume import Filling, enclosed_volumes
from shellmb.model.reduced.data import ModalBody
from shellmb.model.reduced.modal import modal_bodies, modal_points
from shellmb.model.sections.natural import Distributed, doubt_natural
from shellmb.model.shell_contact.faces import faces_contacts
from shellmb.model.shells.joins import glue_beams, hold_glued, join_shells, line_along
from shellmb.model.shells.shell import ShellModel, build_shell
from shellmb.model.signals import Signals
from shellmb.model.supports.pointloads import point_loads
from shellmb.model.supports.prescribed import NodalConstraint, Prescribed
from shellmb.model.supports.supports import SupportRows, refuse_idle_loads
from shellmb.model.unknowns import aliases, resolve_links
from shellmb.model.user_bodies.placed import build_own_bodies
from shellmb.scene import Beam, Scene, Shell
from shellmb.scene.multibody.joints import GROUND

# times, in parts of the run, at which what supports prescribe is compared: its ends, and times
# that no period falls on
COMPARED = (0.0, 0.137, 0.371, 0.618, 0.863, 1.0)


class Model:
    """Everything that has unknowns: bodies on their meshes, with what holds, ties and loads them.

    Args:
        described: A validated scene.
        comm: Communicator of all meshes; collective.
        modal: Bodies that are reduced to modes, with rigid bodies of the scene for their frames.
        force: Unit of the multipliers of constraints, N; None: what forces are alike to. A model
            that is to take the multipliers of another one has to have its unit.
        length: Characteristic length, m, of which the same is true; None: that of the scene.

    Attributes:
        scene: The scene, with rigid bodies for shells and beams that are rigid.
        signals: What controllers command and events switch.
        bodies: All bodies of the system.
        shells: The shells by name.
        beams: The beams by name.
        meshed: Both.
        own: Bodies of the user's own with places, by name.
        places: What has a mesh: these all, by name.
        rigid: The rigid bodies, and ground; None without any.
        mechanism: Joints, and what drives and resists them.
        length: Characteristic length of the scene, m.
        force: Unit of the multipliers of constraints, N.
        rigid_meshes: Meshes of the shells and beams that are rigid, by name: they have no unknowns.
        planes: Planes that are not axis-parallel and hold nodes; among `bodies`, too.
        potentials: Potentials and contacts; among `bodies`, too.
        contacts: The contacts with obstacles among them.
        volumes: Enclosed volumes; their bodies are among `bodies`, too.
        faces: Contacts with faces of shells, which are no bodies.
        modal: What is reduced to modes; its frames are among `rigid`.

    Raises:
        SceneError: If something the scene names does not exist on the meshes.
    """

    def __init__(
        self,
        described: Scene,
        comm: MPI.Comm,
        modal: Sequence[ModalBody] = (),
        force: float | None = None,
        length: float | None = None,
    ) -> None:
        make_room(comm, len(described.shells) + len(described.beams))
        scene, self.rigid_meshes = rigidified(described, comm)
        self.scene, self.comm, self.modal = scene, comm, tuple(modal)
        self.signals = Signals(scene)

        dynamic = not scene.static
        self.shells = {
            s.name: build_shell(s, build_surface(s, comm), self._loads_of(s), dynamic)
            for s in scene.shells
        }
        kinks = self._join()
        # joins change directors: lines of shells come after them
        lines = {
            beam.name: line_along(beam, self.shells[beam.along])
            for beam in scene.beams
            if beam.along is not None
        }
        own_lines = {name: along.line for name, along in lines.items()}
        self.beams = {
            b.name: build_beam(b, comm, self._loads_of(b), dynamic, own_lines.get(b.name))
            for b in scene.beams
        }
        self.meshed: dict[str, ShellModel | BeamModel] = {**self.shells, **self.beams}
        sanity_checks.doubt_thickness(comm, self.meshed.values())
        sanity_checks.doubt_slits(comm, self.shells)
        sanity_checks.doubt_units(comm, scene, self.meshed.values())
        doubt_natural(comm, scene.t_end, self.meshed)

        own, self.own = build_own_bodies(scene, comm)
        self.places: dict[str, Any] = {**self.meshed, **self.own}
        self.length = self._length() if length is None else length
        self.force = self._force() if force is None else force
        scale = Scale(comm, self.force, self.length)

        self.rigid = self._rigid(scale)
        self.bodies: list[Body] = [*self.shells.values(), *self.beams.values(), *own]
        self.bodies += [] if self.rigid is None else [self.rigid]
        self.bodies += kinks
        if self.rigid is not None:
            self.bodies += modal_bodies(scale, modal, self.rigid, dynamic)

        times = [part * scene.given_until for part in COMPARED]
        glued = glue_beams(scene, self.beams, self.shells, lines)
        prescribed = Prescribed(aliases([*self.meshed.values()], comm), times, scene.linear)
        for support in scene.supports:
            for body in scene.bodies_of(support):
                SupportRows(support, self.places[body.name], body, prescribed, dynamic)
        prescribed.settle()
        self.planes = prescribed.planes
        refuse_idle_loads(scene, self.meshed, prescribed)
        frames = {} if self.rigid is None else self.rigid.ends()
        find = partial(place_on, scene, self.places, frames)
        self.bodies += [*self.planes, *hold_glued(scene, glued, prescribed)]
        hinged: dict[str, Any] = {**self.shells, **self.own}
        self.mechanism = Mechanism(scene, scale, find, hinged, self.signals)
        self._check_turnable()
        self.bodies += self.mechanism.bodies

        self.bodies += point_loads(scene, comm, find)
        meshes = self.meshed, self.rigid_meshes
        points_of = ActingPoints(described, find, *meshes, modal_points(self.bodies))
        users, self.contacts = potential_groups(points_of, scale)
        self.potentials: list[PotentialGroup] = [*users, *self.contacts]
        self.bodies += self.potentials

        self.volumes = enclosed_volumes(scene, scale, self.shells, prescribed)
        self.bodies += [body for volume in self.volumes for body in (volume, *volume.surfaces)]

        resolve_links(self.bodies, comm)
        sanity_checks.check_probes(scene, self.places)
        sanity_checks.doubt_unjoined(described, comm, {**self.rigid_meshes, **self.meshed})
        self.faces = faces_contacts(points_of, self.shells, self.length)

    @property
    def stores(self) -> list[PotentialGroup | Filling]:
        """Potentials, contacts and gases: what has an energy of its own in the balance."""
        return [*self.potentials, *(v for v in self.volumes if v.item.gas is not None)]

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
        meshes = [body.domain.mesh.geometry.x for body in self.places.values()]
        here = max(float(np.abs(x).max(initial=0.0)) for x in (self._points, *meshes))
        return float(self.comm.allreduce(here, op=MPI.MAX))

    def nodes_of(self, name: str) -> tuple[Body, Ints, Floats, Floats]:
        """Nodes of a body with places on this rank.

        Args:
            name: Name of the body in the scene.

        Returns:
            The body of the system, the nodes' numbers among its nodes (owned and ghost), reference
            positions (n, 3) and directors (n, m, 3).
        """
        body: Any = self.places.get(name, self.rigid)
        X, D = body.node_positions(), body.node_directors()
        here = np.arange(len(X))
        if name not in self.places:
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
        return bool(body.kinematic) or body in self.constraint_groups

    @cached_property
    def constraint_groups(self) -> list[ConstraintGroup]:
        """Bodies that hold others."""
        return [body for body in self.bodies if isinstance(body, ConstraintGroup)]

    @property
    def slides(self) -> bool:
        """Decide whether bodies roll or slide: constraints hold velocities at the end of a step."""
        return bool(self.mechanism.contacts)

    @property
    def elements(self) -> int:
        """Number of elements."""
        return sum(
            m.domain.mesh.topology.index_map(m.domain.mesh.topology.dim).size_global
            for m in self.places.values()
        )

    @property
    def supported(self) -> bool:
        """Decide whether anything is supported or driven."""
        return bool(self.scene.supports) or (self.rigid is not None and GROUND in self.rigid.index)

    def _loads_of(self, body: Shell | Beam) -> list[Distributed]:
        """Distributed loads of a body, and its natural strain, whose stress is one.

        Loads at points are bodies of the system themselves.
        """
        found: list[Distributed] = [
            load
            for load in self.scene.loads
            if not load.at_point and body in self.scene.bodies_of(load)
        ]
        return found if body.natural is None else [*found, body.natural]

    def _join(self) -> list[NodalConstraint]:
        """Join shells along edges; returns the constraints of kinks."""
        kinks = []
        for join in self.scene.joins:
            first, second = self.shells[join.first], self.shells[join.second]
            links, constraint = join_shells(join, first, second)
            second.links += tuple(links)
            if constraint is not None:
                constraint.inertialess = first.inertialess and second.inertialess
                kinks.append(constraint)
        return kinks

    def _rigid(self, scale: Scale) -> RigidBodies | None:
        """Rigid bodies and ground; None without any."""
        scene = self.scene
        ends = [(j.first, j.second) for j in scene.joints]
        ends += [(e.first, e.second) for e in scene.point_elements]
        grounded = any(GROUND in pair for pair in ends)
        bodies = [*scene.rigid_bodies, *([GROUND_FRAME] if grounded else [])]
        return RigidBodies(scene, scale, bodies) if bodies else None

    @property
    def _points(self) -> Floats:
        """Reference points of rigid bodies and of joints, shape (n, 3), m."""
        bodies, joints = self.scene.rigid_bodies, self.scene.joints
        points = [body.center for body in bodies]
        points += [body.place(name) for body in bodies for name in body.point_names]
        points += [np.asarray(j.at) for j in joints if isinstance(j.at, tuple)]
        return np.array(points).reshape(-1, 3)

    def _length(self) -> float:
        """Diagonal of the box around all reference points of rigid bodies, or the largest mesh.

        Where all are at one point, the largest radius of gyration.
        """
        box = float(np.linalg.norm(np.ptp(self._points, axis=0))) if len(self._points) else 0.0
        meshes = (*self.places.values(), *self.rigid_meshes.values())
        sizes = [*(m.domain.length for m in meshes), *(data.length for data in self.modal)]
        # of bodies that are all at one point, their radii of gyration
        turns = [
            math.sqrt(float(np.trace(body.inertia_tensor)) / 2 / body.mass)
            for body in self.scene.rigid_bodies
            if body.mass > 0
        ]
        return max([box, *sizes]) or max(turns, default=0.0) or 1.0

    def _force(self) -> float:
        """Size of forces between bodies: what moves the scene's mass by its length in a step."""
        if self.scene.static:
            return max((body.force_size for body in self.meshed.values()), default=1.0)
        return self.mass * self.length / self.scene.dt**2

    @property
    def mass(self) -> float:
        """Mass of all bodies, kg; one where nothing has any."""
        mass = sum(body.mass for body in self.scene.rigid_bodies)
        mass += sum(s.section.mass * s.domain.length**2 for s in self.shells.values())
        mass += sum(body.total_mass for body in self.own.values())
        mass += sum(b.beam.section.mass[0] * b.domain.length for b in self.beams.values())
        return mass or 1.0

    def _check_turnable(self) -> None:
        """Check that directors with joints on them have inertia in motion, or velocities are open.

        Raises:
            SceneError: Names joint and body.
        """
        for joint in () if self.scene.static else self.mechanism.joints.values():
            for end, directors in zip(joint.ends, joint.key[1:], strict=True):
                body = self.meshed.get(end.owner)
                if body is not None and directors and "lam" not in body.jump_parts:
                    raise SceneError(
                        f"{joint.joint.said}: the directors of '{end.owner}' have no inertia; it "
                        "must have rotary_inertia=True and a section with second moments, or the "
                        "joint must hold positions only"
                    )
