"""Rigid motions of free bodies among modes about a steady rotation: known exactly, told by shape.

A body that nothing holds goes on moving uniformly, wherever it was and with whatever velocity. Seen
from a frame that turns with `Omega` both are `exp(i Omega t)`: a double eigenvalue with one
vector, which round-off splits by its own square root, so that one half of it seems to grow. The
same eigenvalue belongs to a rotation that is tilted. Where a mode has the shape of rigid motions,
body by body, and these motions satisfy the equations with `i Omega`, that is its eigenvalue.
"""

from __future__ import annotations

from collections.abc import Sequence

from petsc4py import PETSc

import numpy as np
import numpy.typing as npt

from shellmb.model.frames.rigid import RigidBodies
from shellmb.moving.linearised import Linearised
from shellmb.moving.quadratic import Pair, product
from shellmb.observers.fields.nodal import NodalBody, nodal_bodies, reference_nodes

Floats = npt.NDArray[np.float64]

# Eigenvalues nearer to `i Omega` than this part of it are looked at. Of a rigid shape all but
# this part of the mass moves so, and its equation is satisfied to this part of its inertia forces:
# equilibria are as exact. A spring as soft as that changes the frequency by 1.6e-5 at most
NEAR, SHAPE, FREE = 1e-2, 1e-6, 1e-9


class FreeMotions:
    """Tells rigid motions of free bodies by their shapes.

    Args:
        turning: The system, in the frame as it turns.
        matrices: Its stiffness, damping with Coriolis' forces, and mass.
    """

    def __init__(self, turning: Linearised, matrices: Sequence[PETSc.Mat]) -> None:
        self._turning, self._system, self._matrices = turning, turning.system, matrices

    def exact(self, pair: Pair) -> Pair:
        """A mode with its exact eigenvalue, if it is a rigid motion of free bodies."""
        own = 1j * abs(self._turning.rate)
        if own == 0 or abs(pair.value - own) > NEAR * abs(own):
            return pair
        parts = []
        for vector in (pair.real, pair.imaginary):
            rigid = vector.duplicate()
            rigid.array[:] = self._rigid(self._system.local_values(vector))
            parts.append(rigid)
        rigid_pair = Pair(own, *parts)
        rest = Pair(own, pair.real - parts[0], pair.imaginary - parts[1])
        K, C, M = self._matrices
        whole = product(M, pair, pair).real
        if product(M, rest, rest).real > SHAPE * whole:
            return pair
        terms = [own**n * product(A, rigid_pair, rigid_pair) for n, A in enumerate((K, C, M))]
        return pair._replace(value=own) if abs(sum(terms)) <= FREE * abs(terms[2]) else pair

    def _rigid(self, values: Floats) -> Floats:
        """The rigid motion of each body that is nearest to some values of all local unknowns."""
        system, model = self._system, self._turning.model
        found = []
        bodies = nodal_bodies(model)
        for k, (body, field) in enumerate(zip(model.bodies, system.fields, strict=True)):
            own = np.full(field.size_all, np.nan)
            if body.name in bodies:
                self._fit(bodies[body.name], values[system.numbering.slice(k)], own)
            found.append(own[: field.size_local])
        return system.global_values(found, known=True)

    def _fit(self, body: NodalBody, part: Floats, own: Floats) -> None:
        """Put the rigid motion of a body that is nearest to a part of a mode in its place."""
        q = self._turning.levels[body.name].q.x.array
        X, D = reference_nodes(body)
        u, w = body.mixed.dofs["u"].reshape(-1, 3), body.mixed.dofs["w"].reshape(D.shape)
        x, d = X + q[u], D + q[w]
        # displacements by a translation and a rotation, and directors by the rotation, as lengths
        length = self._turning.model.length
        rows = np.concatenate([_turned(x[:, None]), length * _turned(d)], axis=1)
        rows[:, 0, :, :3] = np.eye(3)
        given = np.concatenate([part[u][:, None], length * part[w]], axis=1)
        normal = np.einsum("nmik,nmil->nkl", rows, rows)
        right = np.einsum("nmik,nmi->nk", rows, given)
        if not isinstance(body, RigidBodies):
            comm = self._turning.model.comm
            normal, right = (
                np.broadcast_to(comm.allreduce(a.sum(axis=0)), a.shape) for a in (normal, right)
            )
        motion = np.einsum("nkl,nl->nk", np.linalg.pinv(normal, hermitian=True), right)
        moved = np.einsum("nmik,nk->nmi", rows, motion)
        own[u], own[w] = moved[:, 0], moved[:, 1:] / length
        if "bubble" in body.mixed.dofs and len(motion):
            bubble = body.mixed.dofs["bubble"].reshape(-1, 3)
            own[bubble] = np.cross(motion[0, 3:], q[bubble])


def _turned(vectors: Floats) -> Floats:
    """What rotations about the axes make of vectors, shape (n, m, 3, 6), the last three of six."""
    found = np.zeros((*vectors.shape, 6))
    for axis in range(3):
        found[..., 3 + axis] = np.cross(np.eye(3)[axis], vectors)
    return found
