"""Data of a body that is reduced to modes, and the same in the basis of another body.

A material point is at `x = x0 + d_a (X_a + phi_ka eta_k)`, with a floating frame `x0, d_a` that is
unknown as that of a rigid body and modes `phi_k` of amplitudes `eta_k`, in components along the
frame; its directors alike. All of it is linear in the vectors `x0`, `d_a` and `y_ka = eta_k d_a`,
with constant coefficients. So the kinetic energy is a quadratic form of their rates with a
*constant* matrix. In principal axes of its part of `y` it is that of point masses `m_r` at

    z_r = sum_k eta_k sum_a Q_rka d_a

which hold as constraints `d_a . z_r = sum_k Q_rka eta_k`, quadratic and unchanged by rotations as
those of joints. So energies and momenta are exact in every scheme, by what it does with quadratic
constraints and constant masses anyway.

The modes have no linear and no angular momentum in the frame at rest (they are orthogonal to rigid
motions in the metric of the mass): it is a mean of the body, and the representation is unique.

References: R. R. Craig, M. C. C. Bampton, AIAA J. 6 (1968) 1313-1319; B. Fraeijs de Veubeke, Int.
J. Eng. Sci. 14 (1976) 895-913 (mean axes).

Of a body that is little different from another one, signs of modes and directions within multiple
frequencies are arbitrary, and a body next to another one has others. Motions depend on the space of
the modes only. So amplitudes are exchanged for combinations in which the stiffness is that of the
other body, and the points that carry the inertia for combinations with the masses of the other
body's points. Both leave one rotation free, which is the one that brings shapes nearest to the
other body's: that depends smoothly on the body.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from mpi4py import MPI

import numpy as np
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.forms.state import Layout
from shellmb.model.body import TimeFunction
from shellmb.model.frames.beam import BeamModel
from shellmb.model.shells.shell import ShellModel


@dataclass(frozen=True)
class InterfaceModes:
    """Motion of an attached frame with the modes.

    Args:
        name: Name of the frame in the scene.
        shift: Displacement along the floating frame per amplitude, shape (3, K).
        turn: Rotation about the floating frame's axes per amplitude, shape (3, K), rad/m.
    """

    name: str
    shift: Floats
    turn: Floats


@dataclass(frozen=True)
class Member:
    """A shell or beam of a reduced body, for pictures and probes.

    Args:
        body: The shell or beam with its mesh: it has no unknowns.
        u: Displacements of the nodes on this rank per amplitude, shape (n, 3, K).
        w: Changes of their directors, shape (n, m, 3, K), 1/m.
        states: Local arrays of the body's states in the modes, resultants included, (dofs, K).
    """

    body: ShellModel | BeamModel
    u: Floats
    w: Floats
    states: Floats


@dataclass(frozen=True)
class ModalPoint:
    """A force that keeps its direction, and acts on a mean of the body's points.

    Args:
        time: Function of time that multiplies it; None: without.
        force: Its components in space, shape (3,), N.
        share: Share of it that acts on the frame.
        arm: Where the rest acts, along the frame's directors, shape (3,), m.
        shape: The same per amplitude, shape (3, K).
    """

    time: TimeFunction | None
    force: Floats
    share: float
    arm: Floats
    shape: Floats


@dataclass(frozen=True)
class ModalForces:
    """Forces on the frame, along its directors, and on the amplitudes.

    Args:
        time: Function of time that multiplies them; None: without.
        along: Of a moment that keeps its direction the products of its components with those of
            the directors that the forces are multiplied by, shape (9,), N m; None: of what turns
            with the body.
        table: Force, moment about the frame, and forces on the amplitudes: at rest, and per
            amplitude, shape (6 + K, 1 + K).
    """

    time: TimeFunction | None
    along: Floats | None
    table: Floats


@dataclass(frozen=True)
class ModalBody:
    """A body in modes, the largest displacement of each, or turn times length, being one.

    So amplitudes are in m.

    Args:
        name: Name of its floating frame in the scene.
        members: The shells and beams that it consists of, by name.
        interfaces: The frames at which something is attached to it.
        stiffness: Stiffness of each mode, shape (K,), N/m.
        omega2: Square of its angular frequency, where the body is free, shape (K,), rad^2/s^2.
        damping: Damping of the modes, shape (K, K), N s/m; None without any.
        relaxing: Stiffness, over squares of rates, that the modes have because they do not give way
            to damping as the body does, shape (K, K), N s^2/m; None without damping.
        slowing: Rate of the damping in proportion to the mass, 1/s.
        mass: Masses of the points that carry the inertia of the modes, shape (R,), kg.
        points: Where they are per amplitude, `Q` above, shape (R, 3, K).
        coupling: Products of inertia of the points and the directors, shape (R, 3), kg m.
        points_loaded: Distributed loads that keep their directions.
        follower_loads: Those that turn with the body, and moments.
        touched: Member, and place on it, that potentials and contacts act on, by their names;
            and what messages call these.
        length: Size of the body, m.
        clamped: Lowest angular frequency with one of the frames held, rad/s; of the free body
            without any.
        lacking: Gives the largest displacement by added terms that no mode has, m, at a time, with
            values at nodes, and directors of the frame; None without terms; collective.
    """

    name: str
    members: dict[str, Member]
    interfaces: tuple[InterfaceModes, ...]
    stiffness: Floats
    omega2: Floats
    damping: Floats | None
    relaxing: Floats | None
    slowing: float
    mass: Floats
    points: Floats
    coupling: Floats
    points_loaded: tuple[ModalPoint, ...]
    follower_loads: tuple[ModalForces, ...]
    touched: Mapping[str, tuple[str, Any, str]]
    length: float
    clamped: float
    lacking: Callable[[float, Mapping[str, Any], Floats], float] | None = None

    @property
    def count(self) -> int:
        """Number of modes."""
        return len(self.stiffness)

    @cached_property
    def slopes(self) -> Floats:
        """Changes of all directors on this rank per amplitude, shape (n, 3, K), 1/m."""
        return np.concatenate([m.w.reshape(-1, 3, self.count) for m in self.members.values()])


def amplitudes(layout: Layout, q: Expr) -> list[Expr]:
    """The amplitudes in a state, m."""
    first, size = layout.parts["eta"]
    return [q[first + k] for k in range(size)]


def aligned(
    bodies: Sequence[ModalBody], others: Sequence[ModalBody], comm: MPI.Comm
) -> tuple[ModalBody, ...]:
    """Bodies in modes in the bases of others, which are of the same scene nearby; collective.

    Args:
        bodies: The bodies.
        others: The other ones, in their order.
        comm: Communicator.

    Raises:
        SceneError: If the spaces have different dimensions.
    """
    return tuple(_aligned(*pair, comm) for pair in zip(bodies, others, strict=True))


def _aligned(body: ModalBody, other: ModalBody, comm: MPI.Comm) -> ModalBody:
    ours, its = (len(b.stiffness) + len(b.mass) for b in (body, other))
    if ours != its or len(body.mass) != len(other.mass):
        raise SceneError(
            f"body '{body.name}' in modes: {body.count} modes with {len(body.mass)} points of mass "
            f"next to {other.count} with {len(other.mass)}; both must have as many: choose another "
            "number of modes"
        )
    B = _amplitudes(body, other, comm)
    A = _points(body, other, B)
    members = {
        name: Member(member.body, member.u @ B, member.w @ B, member.states @ B)
        for name, member in body.members.items()
    }
    interfaces = (replace(i, shift=i.shift @ B, turn=i.turn @ B) for i in body.interfaces)
    six, one = np.eye(6), np.eye(1)
    left = np.block([[six, np.zeros((6, len(B)))], [np.zeros((len(B), 6)), B.T]])
    right = np.block([[one, np.zeros((1, len(B)))], [np.zeros((len(B), 1)), B]])
    return replace(
        body,
        members=members,
        interfaces=tuple(interfaces),
        stiffness=other.stiffness,
        damping=_product(body.damping, B),
        relaxing=_product(body.relaxing, B),
        mass=other.mass,
        points=np.einsum("sr,rak,kl->sal", A, body.points, B),
        coupling=np.linalg.solve(A.T, body.coupling),
        points_loaded=tuple(replace(p, shape=p.shape @ B) for p in body.points_loaded),
        follower_loads=tuple(replace(f, table=left @ f.table @ right) for f in body.follower_loads),
    )


def _amplitudes(body: ModalBody, other: ModalBody, comm: MPI.Comm) -> Floats:
    """The amplitudes by those of the basis that is looked for, shape (K, K)."""

    def shapes_of(b: ModalBody) -> Floats:
        parts = (part for m in b.members.values() for part in (m.u, b.length * m.w))
        return np.concatenate([part.reshape(-1, b.count) for part in parts])

    ours, its = shapes_of(body), shapes_of(other)
    gram, mixed = (comm.allreduce(ours.T @ shapes, op=MPI.SUM) for shapes in (ours, its))
    near = np.linalg.solve(gram, mixed)
    root, its_root = np.sqrt(body.stiffness), np.sqrt(other.stiffness)
    turn = _nearest_rotation(root[:, None] * near / its_root)
    return np.asarray(turn * its_root / root[:, None])


def _points(body: ModalBody, other: ModalBody, B: Floats) -> Floats:
    """The points that are looked for by those of the body, shape (R, R)."""
    root, its_root = np.sqrt(body.mass), np.sqrt(other.mass)
    ours = (root[:, None, None] * body.points @ B).reshape(len(root), -1)
    its = (its_root[:, None, None] * other.points).reshape(len(root), -1)
    return np.asarray(_nearest_rotation(its @ ours.T) * root / its_root[:, None])


def _product(matrix: Floats | None, B: Floats) -> Floats | None:
    return None if matrix is None else B.T @ matrix @ B


def _nearest_rotation(matrix: Floats) -> Floats:
    """The orthogonal matrix that is nearest to a regular one."""
    U, _, V = np.linalg.svd(matrix)
    return np.asarray(U @ V)
