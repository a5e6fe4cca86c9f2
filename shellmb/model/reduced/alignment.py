"""Modes of a body that is little different from another one, in the other one's basis.

Signs of modes and directions within multiple frequencies are arbitrary, and a body next to another
one has others. Motions depend on the space of the modes only. So amplitudes are exchanged for
combinations in which the stiffness is that of the other body, and the points that carry the inertia
for combinations with the masses of the other body's points. Both leave one rotation free, which is
the one that brings shapes nearest to the other body's: that depends smoothly on the body.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.model.reduced.data import Member, ModalBody


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
    ours, its = (
        np.concatenate(
            [
                np.concatenate([m.u.reshape(-1, b.count), b.length * m.w.reshape(-1, b.count)])
                for m in b.members.values()
            ]
        )
        for b in (body, other)
    )
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
