"""Modes of a body about a floating frame, from its Ritz vectors.

What these span is made orthogonal to rigid motions and to itself: the modes are those of the free
body in that space. Masses follow from the body's own mass matrix for the scalar fields `1`, `X_a`,
`phi_ka`, along x, of which all velocities of the reduced body consist (`model.reduced.data`).

An edge that is clamped stays a rigid frame, as the hinged end of a beam does: with the frame of its
own it has a joint to the ground. What other supports hold does not move as a frame, and where edges
meet they have nodes in common. The modes are then those of the body in its supports, and one frame
stands for all of these: none of the displacements that they leave moves it. So it is fixed by a
weld or, where hinged edges are in one straight line, by a revolute joint about that.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.model.frames.rigid_from_mesh import inertia_of
from shellmb.model.reduced.data import InterfaceModes, Member, ModalBody
from shellmb.preprocessing.constraint_analysis.mobility import SMALL, Frame, describe
from shellmb.preprocessing.modal.isolated import IsolatedBody
from shellmb.preprocessing.modal.loads import SpreadLoads, TermsAtRest
from shellmb.preprocessing.modal.ritz import lacking, relaxing, ritz_vectors
from shellmb.scene import GROUND, Clamped, Joint, Revolute, Scene, Support, Weld
from shellmb.scene.lookup import said
from shellmb.scene.multibody.rigid import FloatingFrame, Interface, RigidBody
from shellmb.scene.schemes import SIMPLEST

type Touched = Mapping[str, tuple[str, Any, str]]

# shares below which a combination of Ritz vectors is none, and a point has no mass that counts (as
# motions in the plane that come with bending: with every point a step takes longer)
NO_MODE, NO_MASS = 1e-10, 1e-6
# a square of a frequency below this share of the lowest free one is that of a rigid motion
FREE = 1e-6


# frames that move with shells and beams, by the name of the body and the place on it: an edge, an
# area, the name of a point or coordinates
type Attached = Mapping[tuple[str, Any], Interface]


def scene_of(scene: Scene, names: Sequence[str], attached: Attached, loads: Sequence[Any]) -> Scene:
    """A body alone, with its loads, and frames where something is attached.

    Args:
        scene: The scene.
        names: Names of the shells and beams that it consists of.
        attached: Frames where something is attached to them.
        loads: Distributed loads on them, each with the name of its body.
    """
    welds = []
    for k, ((body, where), frame) in enumerate(attached.items()):
        place: dict[str, Any] = {"second_at" if isinstance(where, str) else "at": where}
        welds.append(Weld(f"weld {k}", frame.name, body, **place))
    return Scene(
        f"{names[0]} alone",
        shells=tuple(replace(s, model="exact") for s in scene.shells if s.name in names),
        beams=tuple(replace(b, model="exact") for b in scene.beams if b.name in names),
        joins=tuple(j for j in scene.joins if j.first in names),
        glues=tuple(g for g in scene.glues if g.beam in names),
        rigid_bodies=tuple(attached.values()),
        joints=tuple(welds),
        # when they act, and what commands them, is a matter of the run
        loads=tuple(replace(load, time=None) for load in loads),
        scheme=SIMPLEST,
        dt=1.0,
        t_end=1.0,
        redundant="drop",
    )


def stays_rigid(support: Any, target: Any) -> bool:
    """Decide whether each edge of a support moves as a rigid frame."""
    if support.hinges:
        return target.directors == 3 and not np.any(support.offset)
    return isinstance(support, Clamped)


def support_joint(
    held: IsolatedBody, name: str, who: str, supports: Sequence[Support]
) -> tuple[Interface, Joint]:
    """The frame of all supports of a body, and its joint to the ground; collective.

    Args:
        held: The body in its supports.
        name: Name of the body.
        who: What messages call it.
        supports: The supports.

    Raises:
        SceneError: If supports leave it motions that no joint has.
    """
    places = np.vstack([body.node_positions() for body in held.model.meshed.values()])
    X = np.concatenate(held.comm.allgather(places))
    middle = (X.min(axis=0) + X.max(axis=0)) / 2
    free = held.free_motions(middle)

    def frame(at: Any) -> Interface:
        x, y, z = map(float, at)
        return Interface(f"{name} (supports)", 0.0, (0.0, 0.0, 0.0), (x, y, z), of=name)

    joint = f"{name}.supports"
    if not free.shape[1]:
        # moments of what supports carry are about the origin
        return frame(middle), Weld(joint, GROUND, frame(middle).name, at=(0.0, 0.0, 0.0))
    size = float(np.linalg.norm(np.ptp(X, axis=0)))
    shift, turn = free[:3, 0], free[3:, 0]
    about = free.shape[1] == 1 and np.linalg.norm(turn) * size > SMALL * np.linalg.norm(shift)
    if about and all(s.hinges for s in supports):
        at = middle + np.cross(turn, shift) / (turn @ turn)
        x, y, z = map(float, turn / np.linalg.norm(turn))
        place = frame(at)
        return place, Revolute(joint, GROUND, place.name, at=place.position, axis=(x, y, z))
    motions = np.vstack([free[:3] / size, free[3:]])
    raise SceneError(
        f"{who} is reduced to modes, and its supports leave it free to "
        f"{describe(Frame(middle, size), motions)}; they must hold it, or be Hinged edges in one "
        "straight line, or the model must be 'exact'"
    )


class ReducedBody:
    """Shells and beams that are joined, reduced to modes; collective.

    The modes are fields of `IsolatedBody`, as columns.

    Args:
        scene: The scene.
        comm: Communicator.
        names: Names of the shells and beams.
        attached: Frames where something is attached to them.
        loads: Distributed loads on them, each with the name of its body.
        supports: What holds nodes of them, each with the name of its body.

    Attributes:
        joints: What holds one of its frames to the ground, if there are supports.

    Raises:
        SceneError: If the body has no mass, or no inertia about some axis, or supports leave it
            motions that no joint has.
    """

    def __init__(
        self,
        scene: Scene,
        comm: MPI.Comm,
        names: Sequence[str],
        attached: Attached,
        loads: Sequence[Any],
        supports: Sequence[Any],
    ) -> None:
        bodies = [b for b in scene.meshed if b.name in names]
        words = [b.modes for b in bodies if b.modes]
        who, self._name, self.joints = said(bodies[0]), names[0], list[Joint]()
        isolated = held = IsolatedBody(scene_of(scene, names, attached, loads), comm)
        self._welded = list(attached.values())
        if supports:
            held = IsolatedBody(replace(isolated.model.scene, supports=tuple(supports)), comm)
            frame, joint = support_joint(held, names[0], who, supports)
            self._welded.append(frame)
            self.joints.append(joint)
        self._isolated, self._supported = isolated, held
        self._slowing = float(bodies[0].section.mass_damping)
        terms = TermsAtRest(held, scene.t_end, scene.static)
        self._length = max(body.domain.length for body in isolated.model.meshed.values())
        whole = inertia_of(isolated.model.meshed.values())
        self.mass, self.center, self.inertia = whole.mass, whole.center, whole.tensor
        if not self.mass > 0:
            raise SceneError(f"{who} has no mass; reduced to modes it must have")
        if whole.lacking:
            raise SceneError(
                f"{who} is reduced to modes and has no inertia about one of its axes; it must have "
                "rotary_inertia=True"
            )
        self._loads = SpreadLoads(isolated, loads)
        forces = [*self._loads.vectors(), *terms.forces()]
        found = ritz_vectors(held, words[0], self.center, forces, terms.stiffness())
        self._find([isolated.vector(held.field(vector)) for vector in found])
        termed = any(b.terms for b in bodies)
        self._lacking = lacking(held, found, terms, self.center) if termed else None
        self.relaxing = relaxing(held, found, self._mixed, self.stiffness, self.center)

    def _find(self, vectors: list[Any]) -> None:
        """Modes, their stiffness and frequencies."""
        isolated = self._isolated
        rigid = [isolated.vector(isolated.motion(k, self.center)) for k in range(6)]
        both = isolated.gram(isolated.M, [*rigid, *vectors])
        shares = np.linalg.solve(both[:6, :6], both[:6, 6:])
        lengths = np.sqrt(np.maximum(np.diag(both)[6:], 1e-300))
        for column, vector in enumerate(vectors):
            for k in range(6):
                vector.axpy(-float(shares[k, column]), rigid[k])
            vector.scale(1 / float(lengths[column]))
        M, K = isolated.gram(isolated.M, vectors), isolated.gram(isolated.K, vectors)
        size, U = np.linalg.eigh(M)
        keep = size > NO_MODE * size[-1]
        T = U[:, keep] / np.sqrt(size[keep])
        values, V = np.linalg.eigh(T.T @ K @ T)
        T = T @ V
        self.modes = np.stack([isolated.field(vector) for vector in vectors], axis=1) @ T
        # amplitudes are displacements: the largest one of each mode, or turn times length, is one
        sizes = self._largest()
        self.modes /= sizes
        T /= sizes
        self.omega2, self.stiffness = values, values / sizes**2
        self._mixed = T / lengths[:, None]
        # of what supports hold the rigid motions that the modes were made orthogonal to
        self._carried = shares @ self._mixed
        self.damping, viscous = None, isolated.damping
        if viscous is not None:
            self.damping = T.T @ isolated.gram(viscous, vectors) @ T

    def _largest(self) -> Floats:
        """Largest vector of each mode."""
        K = self.modes.shape[1]
        # in torsion a straight line does not move: directors times the length count, too
        parts = [
            size * np.linalg.norm(part.reshape(-1, 3, K), axis=1)
            for name in self._isolated.model.meshed
            for part, size in zip(self._shapes(name), (1.0, self._length), strict=True)
        ]
        found = np.max(np.concatenate(parts), axis=0, initial=0.0)
        self._isolated.comm.Allreduce(MPI.IN_PLACE, found, MPI.MAX)
        return np.asarray(found)

    @cached_property
    def _points(self) -> tuple[Floats, Floats, Floats]:
        """Masses of the points (R,), where they are (R, 3, K), and their coupling (R, 3)."""
        isolated, K = self._isolated, self.modes.shape[1]
        # in the order of the axes, then of the modes
        shapes = np.hstack([isolated.moved(self.modes, a) for a in range(3)]).T
        arms = [isolated.arm(a, self.center) for a in range(3)]
        gram = isolated.gram(isolated.M, [isolated.vector(field) for field in (*arms, *shapes)])
        # of each mode nearly all of its own mass is kept, however small that is
        own = np.tile(np.sqrt(np.diag(gram)[3:].reshape(3, K).sum(axis=0) / self.mass), 3)
        masses, Q = np.linalg.eigh(gram[3:, 3:] / np.outer(own, own))
        keep = masses > NO_MASS * self.mass
        Q = Q[:, keep].T
        return masses[keep], (Q * own).reshape(-1, 3, K), (Q / own) @ gram[3:, :3]

    @property
    def frames(self) -> tuple[RigidBody, ...]:
        """The floating frame, with mass and inertia of the body at rest, and all others."""
        rows: Any = tuple(tuple(map(float, row)) for row in self.inertia)
        x, y, z = map(float, self.center)
        scene = self._isolated.model.scene
        terms = tuple(term for body in scene.meshed for term in body.terms)
        how: dict[str, Any] = {"mass_damping": self._slowing, "terms": terms}
        return (FloatingFrame(self._name, self.mass, rows, (x, y, z), **how), *self._welded)

    def modal(self, touched: Touched) -> ModalBody:
        """All that is kept.

        Args:
            touched: As of `ModalBody`.
        """
        isolated, model = self._isolated, self._isolated.model
        mass, points, coupling = self._points
        interfaces = tuple(map(self._interface, self._welded))
        members = {
            name: Member(body, *self._shapes(name), self.modes[isolated.own[name]])
            for name, body in model.meshed.items()
        }
        return ModalBody(
            self._name,
            members,
            interfaces,
            self.stiffness,
            self.omega2,
            self.damping,
            self.relaxing,
            self._slowing,
            mass,
            points,
            coupling,
            self._loads.points(self.modes, self.center, self._length),
            self._loads.forces(self.modes, self.center),
            touched,
            self._length,
            float(np.sqrt(self._held(interfaces))),
            self._lacking,
        )

    def _held(self, interfaces: Sequence[InterfaceModes]) -> float:
        """Square of the lowest angular frequency with one of the frames fixed; of the free body."""
        K = len(self.omega2)
        stiffness = np.diag(np.concatenate([np.zeros(6), self.stiffness]))
        mass = np.diag(np.concatenate([np.full(6, self.mass), self.stiffness / self.omega2]))
        mass[3:6, 3:6] = self.inertia
        lowest = [float(self.omega2[0])]
        for frame, item in zip(self._welded, interfaces, strict=True):
            arm = frame.center - self.center
            moves = np.zeros((6, 6 + K))
            moves[:3, :3] = moves[3:, 3:6] = np.eye(3)
            moves[:3, 3:6] = np.cross(np.eye(3), arm).T
            moves[:3, 6:], moves[3:, 6:] = item.shift, item.turn
            _, s, V = np.linalg.svd(moves)
            Z = V[int(np.sum(s > NO_MODE * s[0])) :].T
            root = np.linalg.cholesky(Z.T @ mass @ Z)
            half = np.linalg.solve(root, Z.T @ stiffness @ Z)
            values = np.linalg.eigvalsh(np.linalg.solve(root, half.T))
            # about the director of a single node it is free to turn
            lowest += [v for v in values if v > FREE * self.omega2[0]][:1]
        return min(lowest)

    def _shapes(self, name: str) -> tuple[Floats, Floats]:
        """Displacements and changes of directors of a body's nodes by the modes."""
        body = self._isolated.bodies[name]
        dofs, D = body.mixed.dofs, body.node_directors()
        own, K = self.modes[self._isolated.own[name]], self.modes.shape[1]
        return own[dofs["u"]].reshape(-1, 3, K), own[dofs["w"]].reshape(*D.shape, K)

    def _interface(self, described: Interface) -> InterfaceModes:
        """Find how a frame moves with the modes; the same on all ranks."""
        rigid, comm, frame = self._isolated.model.rigid, self._isolated.comm, described.name
        if rigid is None or frame not in rigid.index:
            # that of the supports is where it is in all that these hold; about a hinge, which they
            # leave free, it does not turn relative to the floating frame
            free = self._supported.free_motions(self.center)
            carried = self._carried - free @ np.linalg.pinv(free[3:]) @ self._carried[3:]
            arm = np.cross(carried[3:].T, described.center - self.center).T
            return InterfaceModes(frame, -carried[:3] - arm, -carried[3:])
        u, w = self._shapes(rigid.name)
        # owned or not: values are the same
        here = np.flatnonzero(rigid.node_mesh.item == rigid.index[frame])
        D = rigid.bodies[rigid.index[frame]].axes.T
        # w_k = t x D_k, so that the sum of D_k x w_k is 2 t
        turns = [np.cross(D[:, :, None], w[n], axis=1).sum(axis=0) / 2 for n in here]
        found = comm.allgather([(u[n], turn) for n, turn in zip(here, turns, strict=True)])
        shift, turn = next(pair for part in found for pair in part)
        return InterfaceModes(frame, shift, turn)
