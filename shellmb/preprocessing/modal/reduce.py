"""Scenes with frames and modes in place of the shells and beams that are reduced."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.errors import SceneError
from shellmb.model.frames import rigid_from_mesh as rigid_meshes
from shellmb.model.locations.nodes import ON_NODE, shared_nodes
from shellmb.model.reduced.data import ModalBody
from shellmb.preprocessing.modal.basis import Attached, ReducedBody, stays_rigid
from shellmb.scene import RigidBody, Scene
from shellmb.scene.checks.names import has_field
from shellmb.scene.checks.whole import groups_of
from shellmb.scene.loads.supports import Fixed
from shellmb.scene.lookup import said
from shellmb.scene.multibody.joints import GROUND, Joint, Spherical, Weld
from shellmb.scene.multibody.offsets import node_of
from shellmb.scene.multibody.rigid import Interface
from shellmb.scene.probes import MOTIONS
from shellmb.scene.values.validate import as_names, show


def reduce_bodies(scene: Scene, comm: MPI.Comm) -> tuple[Scene, tuple[ModalBody, ...]]:
    """Reduce what the scene says is in modes; collective.

    Args:
        scene: The scene.
        comm: Communicator.

    Returns:
        The scene with a rigid body for the floating frame of each reduced body, and a massless
        frame for each place at which something is attached; and the modes.

    Raises:
        SceneError: If a place does not exist.
    """
    groups = list(groups_of(scene))
    if not groups:
        return scene, ()
    made = _Reduction(scene, comm, groups)
    joints = tuple(made.joint(joint) for joint in scene.joints)
    supports = [joint for support in scene.supports for joint in made.support(support)]
    elements = tuple(
        made.ends(e, said(e)) if hasattr(e, "second") else e for e in scene.force_elements
    )
    loads = tuple(made.load(load) for load in scene.loads if not made.spread(load))
    initial = tuple(made.on_frame(given) for given in scene.initial)
    probes = tuple(made.probe(probe) for probe in scene.probes)
    fields = tuple(f for f in scene.output.fields if has_field(f, {"rigid", "joint"}))
    bodies: list[ModalBody] = []
    frames: list[RigidBody] = []
    for group in groups:
        spread = [load for load in map(made.spread, scene.loads) if load and load.body in group]
        where = made.attached(group), spread, made.holding[group[0]]
        body = ReducedBody(scene, comm, group, *where)
        bodies.append(body.modal(made.touched(group)))
        frames += body.frames
        supports += body.joints
        # before the next one is reduced
        del body
    gone = set(made.group)
    changed = replace(
        scene,
        shells=tuple(s for s in scene.shells if s.name not in gone),
        beams=tuple(b for b in scene.beams if b.name not in gone),
        joins=tuple(j for j in scene.joins if j.first not in gone),
        glues=tuple(g for g in scene.glues if g.beam not in gone),
        rigid_bodies=(*scene.rigid_bodies, *frames),
        joints=(*joints, *supports),
        supports=tuple(s for s in scene.supports if not made.held(s)),
        force_elements=elements,
        loads=loads,
        initial=initial,
        probes=probes,
        output=replace(scene.output, fields=fields),
        potentials=tuple(map(made.acting, scene.potentials)),
        contacts=tuple(map(made.acting, scene.contacts)),
        # stresses are those of the scene as it was given
        reserves=(),
    )
    return changed, tuple(bodies)


class _Reduction:
    """Finds the places at which something is attached, and gives each of them a frame.

    Args:
        scene: The scene.
        comm: Communicator.
        groups: Names of what is reduced together.

    Attributes:
        group: By name of a shell or beam the name of its group, that of its first body.
        holding: By name of a group the supports that no joint stands for.
    """

    def __init__(self, scene: Scene, comm: MPI.Comm, groups: list[tuple[str, ...]]) -> None:
        self._scene = scene
        self.group = {name: names[0] for names in groups for name in names}
        self.mesh = rigid_meshes.SceneMeshes(scene, comm, not scene.static)
        self._found: dict[tuple[str, Any], Interface] = {}
        # the nodes that move with each, or are held
        self._taken: dict[tuple[str, Any], frozenset[int]] = {}
        self.holding = {names[0]: self._holding(names) for names in groups}

    def attached(self, group: tuple[str, ...]) -> Attached:
        """The frames of a reduced body."""
        return {at: frame for at, frame in self._found.items() if at[0] in group}

    def _frame(self, name: str, where: Any, who: str, label: str) -> Interface:
        """The frame at a place, the same for all that is attached there.

        Raises:
            SceneError: If there is no such place, or some of its nodes, and not all, move with
                another frame.
        """
        node = node_of(where)
        if (name, node) not in self._found:
            nodes = shared_nodes(self.mesh(name), node, who)
            mine = frozenset(nodes.dofs["u"][:, 0].tolist())
            for (body, place), taken in self._taken.items():
                if body != name or not mine & taken:
                    continue
                if mine <= taken and (body, place) in self._found:
                    return self._found[body, place]
                why = "which supports hold: attach elsewhere"
                if (body, place) in self._found:
                    why = "where something is attached, too; both move as one rigid frame"
                    why += ": attach to one of them"
                raise SceneError(
                    f"{who}: {said(self._scene.body(name))} is reduced to modes, and {show(node)} "
                    f"shares nodes with {show(place)}, {why}, or the model must be 'exact'"
                )
            self._taken[name, node] = mine
            # of a beam's node its own directors: what follows it has components along these
            framed = nodes.directors.shape[1] == 3
            axes = nodes.directors[0].T if framed else np.eye(3)
            rows: Any = tuple(map(rigid_meshes.triple, axes))
            # of loads, which have no names of their own, there may be several
            names = {frame.name for frame in self._found.values()}
            title, number = f"{name} ({label})", 2
            while title in names:
                title, number = f"{name} ({label} {number})", number + 1
            at = rigid_meshes.triple(nodes.x.mean(axis=0))
            still = (0.0, 0.0, 0.0)
            found = Interface(title, 0.0, still, at, rows, of=self.group[name])
            self._found[name, node] = found
        return self._found[name, node]

    def point(self, name: str, where: Any, who: str) -> rigid_meshes.Triple:
        """Coordinates of a place on any body."""
        if isinstance(where, tuple) and not isinstance(where[0], str):
            return where
        body: Any = self._scene.end(name, who)
        if hasattr(body, "place"):
            return rigid_meshes.triple(body.place(where))
        return rigid_meshes.place_of(where, self.mesh(name), who)

    def ends(self, item: Any, who: str) -> Any:
        """A joint or force element with its ends at frames."""
        if not {item.first, item.second} & self.group.keys():
            return item
        changes: dict[str, Any] = {}
        first = None if item.at is None else self.point(item.first, item.at, who)
        for body, at in rigid_meshes.BOTH:
            name, where = getattr(item, body), getattr(item, at)
            if name not in self.group:
                continue
            label = getattr(item, "name", who)
            if where is None:
                where = first if first is not None else self.point(item.first, None, who)
            region = item.of_regions and at == "second_at" and self._region(name, where)
            changes[body] = self._frame(name, where, who, label).name
            # a region follows the frame as a whole, at the place of the first body
            changes[at] = first if region else self.point(name, where, who)
        if item.first in self.group or changes.get("second_at") is None:
            changes["at"] = first
        return replace(item, **changes)

    def _region(self, name: str, where: Any) -> bool:
        mesh = self.mesh(name)
        named = mesh.described.directors == 1 and isinstance(where, str)
        return named and (where in mesh.domain.edges or where in mesh.domain.areas)

    def joint(self, joint: Joint) -> Joint:
        """A joint with its ends at frames."""
        if joint.along_edges:
            return self._edge_hinge(joint)
        turned = rigid_meshes.about_director(joint, self._scene, self.group, self.mesh)
        moved: Joint = self.ends(turned, joint.said)
        return moved

    def _edge_hinge(self, joint: Joint) -> Joint:
        """A hinge of edges on the frames that these move with."""
        frames: dict[str, Any] = {}
        for body, at in rigid_meshes.BOTH:
            name, edge = getattr(joint, body), getattr(joint, at)
            if name in self.group:
                frames[body] = self._frame(name, edge, joint.said, joint.name).name
        return replace(rigid_meshes.hinged(joint, self.group, self.mesh), **frames)

    def held(self, support: Any) -> bool:
        """Decide whether a support holds a reduced body."""
        return any(target.name in self.group for target in self._scene.bodies_of(support))

    def _holding(self, group: tuple[str, ...]) -> tuple[Any, ...]:
        """The supports of a reduced body, unless edges that stay rigid are apart; collective."""
        found, places, rigid = [], [], True
        given: tuple[Any, ...] = self._scene.supports
        for support in given:
            (target,) = self._scene.bodies_of(support)
            if target.name in group:
                found.append(replace(support, body=target.name))
                rigid = rigid and stays_rigid(support, target)
                fixed = isinstance(support, Fixed)
                wheres = (support.at,) if fixed else as_names(support.at)
                places += [(target.name, where, support.label) for where in wheres]
        nodes = [shared_nodes(self.mesh(name), where, who) for name, where, who in places]
        # edges with a node in common, perhaps on shells that are joined, are no frames of their own
        close = ON_NODE * max(self.mesh(name).domain.length for name in group)
        X = np.concatenate([np.zeros((0, 3)), *(np.round(n.x / close) for n in nodes)])
        if rigid and len(np.unique(X, axis=0)) == len(X):
            return ()
        for (name, where, _), held in zip(places, nodes, strict=True):
            self._taken[name, where] = frozenset(held.dofs["u"][:, 0].tolist())
        return tuple(found)

    def support(self, support: Any) -> Iterator[Joint]:
        """Joints to the ground instead of clamped edges, or of hinged ends of a beam."""
        (target,) = self._scene.bodies_of(support)
        if target.name not in self.group or self.holding[self.group[target.name]]:
            return
        for edge in as_names(support.at):
            name = f"{target.name}.{edge}"
            frame = self._frame(target.name, edge, support.label, name)
            if support.hinges:
                yield Spherical(name, GROUND, frame.name, at=frame.position)
            else:
                # moments of what supports carry are about the origin
                yield Weld(name, GROUND, frame.name, at=(0.0, 0.0, 0.0))

    def load(self, load: Any) -> Any:
        """A load at a point acts on the frame there, gravity on the floating frame."""
        if load.weighs:
            return self.on_frame(load)
        (target,) = self._scene.bodies_of(load)
        if target.name not in self.group:
            return load
        frame = self._frame(target.name, load.at, load.label, load.label)
        at = self.point(target.name, load.at, load.label)
        return replace(load, body=frame.name, at=at)

    def spread(self, load: Any) -> Any:
        """A load that is distributed over a shell or beam, with its name; None: another one."""
        if load.at_point or (load.weighs and load.body is None):
            return None
        (target,) = self._scene.bodies_of(load)
        if target.name not in self.group:
            return None
        isolated = list(self.group.values()).count(self.group[target.name]) == 1
        # the weight of all of the body acts on its frame
        return None if load.weighs and isolated else replace(load, body=target.name)

    def touched(self, group: tuple[str, ...]) -> dict[str, tuple[str, Any, str]]:
        """Points on which potentials and contacts act, as in `ModalBody`."""
        found: dict[str, tuple[str, Any, str]] = {}
        items: tuple[Any, ...] = (*self._scene.potentials, *self._scene.contacts)
        for item in items:
            (target,) = self._scene.bodies_of(item)
            if target.name in group:
                found[item.name] = target.name, item.at, said(item)
        return found

    def acting(self, item: Any) -> Any:
        """A potential or contact, where it acts on a reduced body on its frame."""
        (target,) = self._scene.bodies_of(item)
        if target.name not in self.group:
            return item
        return replace(item, body=self.group[target.name], at=None)

    def on_frame(self, item: Any) -> Any:
        """Move to its frame what is of a reduced body, as its velocity."""
        return replace(item, body=self.group.get(item.body, item.body))

    def probe(self, probe: Any) -> Any:
        """A probe with coordinates, which a frame has, too; what it reads is found on the mesh."""
        (target,) = self._scene.bodies_of(probe)
        changes: dict[str, Any] = {}
        if target.name in self.group:
            at = self.point(target.name, probe.at, said(probe))
            changes = {"at": at, "body": self.group[target.name]}
            if probe.quantity not in MOTIONS:
                # sensors know it by its name; a frame has no resultants
                changes["quantity"] = "displacement"
        if probe.frame in self.group:
            where = probe.frame_at
            changes["frame"] = self.group[probe.frame]
            if where is not None:
                changes["frame_at"] = self.point(probe.frame, where, said(probe))
        return replace(probe, **changes) if changes else probe
