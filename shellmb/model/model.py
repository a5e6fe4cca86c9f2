"""The model: all bodies of a scene, bound to meshes, joined, supported and loaded."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import cast

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.errors import SceneError
from shellmb.meshes.lifetime import make_room
from shellmb.meshes.mesh import build_surface
from shellmb.model.body import Body, NodeLink
from shellmb.model.frames.beam import BeamModel
from shellmb.model.frames.glue import glue_beams, line_along
from shellmb.model.frames.linear import build_beam
from shellmb.model.frames.rigid import GROUND, RigidBodies, ground_node, rigid_node
from shellmb.model.frames.rigidify import RigidMeshes, rigidified
from shellmb.model.joints.constraints import ConstraintGroup
from shellmb.model.joints.mechanism import Mechanism, build_mechanism
from shellmb.model.locations.finder import Finder, RigidPlaces
from shellmb.model.plausible import check_probes, doubt_slits, doubt_thickness
from shellmb.model.potentials.build import potential_groups
from shellmb.model.potentials.group import PotentialGroup
from shellmb.model.reduced.data import ModalBody
from shellmb.model.reduced.modal import modal_bodies, modal_points
from shellmb.model.shells.joins import join_shells
from shellmb.model.shells.linear import build_shell
from shellmb.model.shells.middles import hold_middles
from shellmb.model.shells.shell import ShellModel
from shellmb.model.signals import Signals
from shellmb.model.supports.idle import refuse_idle_loads
from shellmb.model.supports.nodal import NodalConstraint
from shellmb.model.supports.pointloads import point_loads
from shellmb.model.supports.prescribed import Prescribed
from shellmb.model.supports.supports import SupportRows
from shellmb.scene import Beam, Scene, Shell
from shellmb.scene.loads.loads import Gravity, Load, PointLoad
from shellmb.scene.multibody.elements import PointElement
from shellmb.scene.multibody.rolling import Contact

# times, in parts of the run, at which what supports prescribe is compared: its ends, and times
# that no period falls on
COMPARED = (0.0, 0.137, 0.371, 0.618, 0.863, 1.0)


@dataclass
class Model:
    """Everything that has unknowns.

    Args:
        scene: The scene it was made from, with rigid bodies for shells and beams that are rigid.
        comm: Communicator.
        signals: What controllers command and events switch.
        bodies: All bodies of the system.
        shells: The shells by name.
        beams: The beams by name.
        rigid: The rigid bodies, and ground; None without any.
        mechanism: Joints, and what drives and resists them.
        length: Characteristic length of the scene, m.
        force: Unit of the multipliers of constraints, N.
        rigid_meshes: Meshes of the shells and beams that are rigid, by name: they have no unknowns.
        planes: Planes that are not axis-parallel and hold nodes; among `bodies`, too.
        potentials: Potentials and contacts; among `bodies`, too.
        modal: What is reduced to modes; its frames are among `rigid`.
    """

    scene: Scene
    comm: MPI.Comm
    signals: Signals
    bodies: list[Body] = field(default_factory=list)
    shells: dict[str, ShellModel] = field(default_factory=dict)
    beams: dict[str, BeamModel] = field(default_factory=dict)
    rigid: RigidBodies | None = None
    mechanism: Mechanism = field(default_factory=Mechanism)
    length: float = 1.0
    force: float = 1.0
    rigid_meshes: RigidMeshes = field(default_factory=dict)
    planes: list[NodalConstraint] = field(default_factory=list)
    potentials: list[PotentialGroup] = field(default_factory=list)
    modal: tuple[ModalBody, ...] = ()

    @property
    def meshed(self) -> dict[str, ShellModel | BeamModel]:
        """Shells and beams by name."""
        return {**self.shells, **self.beams}

    def nodes_of(self, name: str) -> tuple[Body, Ints, Floats, Floats]:
        """Nodes of a shell, beam or rigid body on this rank.

        Args:
            name: Name of the body in the scene.

        Returns:
            The body of the system, the nodes' numbers among its nodes (owned and ghost), reference
            positions (n, 3) and directors (n, m, 3).
        """
        if name in self.meshed:
            body = self.meshed[name]
            X = body.mixed.nodes("u")
            return cast(Body, body), np.arange(len(X)), X, body.node_directors()
        assert self.rigid is not None
        item = self.rigid.index[name]
        node, here = self.rigid.bodies[item], np.flatnonzero(self.rigid.node_mesh.item == item)
        X, D = np.tile(node.center, (len(here), 1)), np.tile(node.directors, (len(here), 1, 1))
        return self.rigid, here, X, D

    @property
    def elements(self) -> int:
        """Number of elements of shells and beams."""
        return sum(
            m.domain.mesh.topology.index_map(m.domain.mesh.topology.dim).size_global
            for m in self.meshed.values()
        )

    @property
    def supported(self) -> bool:
        """Whether anything is held or driven."""
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
    make_room(comm)
    given, (scene, rigid_meshes) = scene, rigidified(scene, comm)
    signals = Signals(scene)
    model = Model(scene, comm, signals, rigid_meshes=rigid_meshes, modal=tuple(modal))
    dynamic = not scene.static
    for shell in scene.shells:
        mesh = build_surface(shell, comm)
        model.shells[shell.name] = build_shell(shell, mesh, _loads_of(scene, shell), dynamic)
    kinks = _join(scene, model)
    # joins change directors: lines of shells come after them
    lines = {
        beam.name: line_along(beam, model.shells[beam.curve.shell])
        for beam in scene.beams
        if beam.curve.shell is not None
    }
    for beam in scene.beams:
        line = lines[beam.name].line if beam.name in lines else None
        model.beams[beam.name] = build_beam(beam, comm, _loads_of(scene, beam), dynamic, line)
    doubt_thickness(comm, model.shells, model.beams)
    doubt_slits(comm, model.shells)
    model.length = _length(scene, model) if length is None else length
    model.force = force = _force(scene, model) if force is None else force
    nodes = [rigid_node(body, model.length) for body in scene.rigid_bodies]
    if _uses_ground(scene):
        nodes.append(ground_node())
    if nodes:
        gravity = [
            (load, frozenset(body.name for body in scene.bodies_of(load)))
            for load in scene.loads
            if isinstance(load, Gravity)
        ]
        model.rigid = RigidBodies(comm, nodes, dynamic, gravity, force, model.length)
    meshed: list[Body] = [*model.shells.values(), *model.beams.values()]
    model.bodies += meshed
    if model.rigid is not None:
        model.bodies.append(model.rigid)
    model.bodies += kinks
    if model.rigid is not None:
        model.bodies += modal_bodies(comm, modal, model.rigid, dynamic, force, model.length)
    prescribed = _support(scene, model)
    refuse_idle_loads(scene, model.meshed, prescribed)
    model.bodies += glue_beams(scene, comm, model.beams, model.shells, lines)
    find = Finder(model.meshed, _rigid_places(scene, model))
    model.mechanism = build_mechanism(
        scene, comm, find, model.shells, force, model.length, model.signals
    )
    _turnable(model)
    model.bodies += model.mechanism.bodies
    model.bodies += point_loads(scene, comm, find)
    meshes = model.meshed, rigid_meshes
    touched = modal_points(model.bodies, model.rigid)
    model.potentials = potential_groups(given, comm, find, *meshes, touched, model.length)
    model.bodies += model.potentials
    if model.beams or model.rigid is not None or scene.joints or scene.elements:
        # constraints tie velocities together: see `Body.coupled`
        leaps = any(isinstance(joint, Contact) for joint in scene.joints)
        for body in model.bodies:
            body.coupled = bool(body.kinematic) or isinstance(body, ConstraintGroup)
            body.leaps = leaps
    for shell_model in model.shells.values():
        hold_middles(shell_model)
    _resolve_links(model.bodies, comm)
    check_probes(scene, model.meshed)
    return model


def _join(scene: Scene, model: Model) -> list[NodalConstraint]:
    """Join shells along edges; returns the constraints of kinks."""
    kinks = []
    for join in scene.joins:
        first, second = model.shells[join.first], model.shells[join.second]
        links, constraint = join_shells(join, first, second)
        second.links += tuple(links)
        if constraint is not None:
            constraint.inertialess = first.inertialess and second.inertialess
            kinks.append(constraint)
    return kinks


def _turnable(model: Model) -> None:
    """In motion, a joint on directors needs inertia of their rotation, or velocities are open.

    Raises:
        SceneError: Names joint and body.
    """
    if model.scene.static:
        return
    for joint in model.mechanism.joints.values():
        for end, directors in zip(joint.ends, joint.key[1:], strict=True):
            body = model.meshed.get(end.owner)
            if body is not None and directors and "lam" not in body.jump_parts:
                raise SceneError(
                    f"{joint.joint.said}: the directors of '{end.owner}' have no inertia; it must "
                    "have rotary_inertia=True and a section with second moments, or the joint "
                    "must hold positions only"
                )


def _loads_of(scene: Scene, body: Shell | Beam) -> list[Load]:
    """Distributed loads of a body; those at points are bodies of the system themselves."""
    return [
        load
        for load in scene.loads
        if not isinstance(load, PointLoad) and body in scene.bodies_of(load)
    ]


def _uses_ground(scene: Scene) -> bool:
    ends = [(j.first, j.second) for j in scene.joints]
    ends += [(e.first, e.second) for e in scene.elements if isinstance(e, PointElement)]
    return any(GROUND in pair for pair in ends)


def _length(scene: Scene, model: Model) -> float:
    """Diagonal of the box around all reference points of rigid bodies, or the largest mesh."""
    points = [body.center for body in scene.rigid_bodies]
    points += [body.place(name) for body in scene.rigid_bodies for name in body.point_names]
    points += [np.asarray(j.at) for j in scene.joints if isinstance(j.at, tuple)]
    box = float(np.linalg.norm(np.ptp(np.array(points), axis=0))) if points else 0.0
    meshes = (*model.meshed.values(), *model.rigid_meshes.values())
    sizes = [*(m.domain.length for m in meshes), *(data.length for data in model.modal)]
    return max([box, *sizes]) or 1.0


def _force(scene: Scene, model: Model) -> float:
    """Size of the forces between bodies: what moves the scene's mass by its length in a step."""
    if scene.static:
        return max((body.force_size for body in model.meshed.values()), default=1.0)
    mass = sum(body.mass for body in scene.rigid_bodies)
    mass += sum(s.section.sizes.mass * s.domain.length**2 for s in model.shells.values())
    mass += sum(b.beam.section.mass[0] * b.domain.length for b in model.beams.values())
    assert scene.dt is not None
    return (mass or 1.0) * model.length / scene.dt**2


def _rigid_places(scene: Scene, model: Model) -> dict[str, RigidPlaces]:
    if model.rigid is None:
        return {}
    ends = model.rigid.ends()
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


def _support(scene: Scene, model: Model) -> Prescribed:
    """Hold and move bodies; what all supports prescribe is looked through at once."""
    assert scene.t_end is not None
    shells: list[Body] = list(model.shells.values())
    times = [part * scene.t_end for part in COMPARED]
    prescribed = Prescribed(_aliases(shells, model.comm), times, scene.linear)
    for support in scene.supports:
        for body in scene.bodies_of(support):
            meshed, dynamic = model.meshed[body.name], not scene.static
            rows = SupportRows(support, meshed, body, prescribed, dynamic)
            rows.collect()
            model.planes += rows.arms
    model.planes += prescribed.settle()
    model.bodies += model.planes
    return prescribed


def _aliases(bodies: list[Body], comm: MPI.Comm) -> dict[tuple[str, int], tuple[str, int]]:
    """Body and global dof of all linked dofs, with those that they are linked to; collective.

    Links may say the same twice, as where each of three shells is joined to both others.
    """
    alias: dict[tuple[str, int], tuple[str, int]] = {}
    for body in bodies:
        index_map = body.mixed.space.dofmap.index_map
        local = [
            ((body.name, int(g)), (link.body, int(target)))
            for link in body.links
            for g, target in zip(index_map.local_to_global(link.dofs), link.targets, strict=True)
        ]
        for pair in itertools.chain(*comm.allgather(local)):
            here, there = (_end(alias, dof) for dof in pair)
            if here != there:
                alias[here] = there
    return alias


def _end(alias: dict[tuple[str, int], tuple[str, int]], dof: tuple[str, int]) -> tuple[str, int]:
    """The dof that a dof is linked to in the end."""
    while dof in alias:
        dof = alias[dof]
    return dof


def _resolve_links(bodies: list[Body], comm: MPI.Comm) -> None:
    """Let every link point to a dof that is not linked itself (three shells at one edge, say)."""
    alias = _aliases(bodies, comm)
    linked: dict[str, list[int]] = {}
    for name, number in alias:
        linked.setdefault(name, []).append(number)
    for body in bodies:
        resolved: dict[str, tuple[list[int], list[int]]] = {}
        index_map = body.mixed.space.dofmap.index_map
        count = index_map.size_local + index_map.num_ghosts
        numbers = index_map.local_to_global(np.arange(count, dtype=np.int32))
        for dof in np.flatnonzero(np.isin(numbers, linked.get(body.name, []))):
            name, target = _end(alias, (body.name, int(numbers[dof])))
            dofs, targets = resolved.setdefault(name, ([], []))
            dofs.append(int(dof))
            targets.append(target)
        # numbering links is collective: every rank has a link to the same bodies, if an empty one
        names = sorted(set().union(*comm.allgather(set(resolved))))
        body.links = tuple(_as_link(name, *resolved.get(name, ([], []))) for name in names)


def _as_link(name: str, dofs: list[int], targets: list[int]) -> NodeLink:
    return NodeLink(np.array(dofs, dtype=np.int32), name, np.array(targets, dtype=np.int64))
