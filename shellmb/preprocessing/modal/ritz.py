"""Ritz vectors of a body by itself (Craig and Bampton), and what loads and terms add to them.

Each frame moved by itself gives six static modes; with all of them fixed the lowest eigenvectors
are taken, and what forces do. Relaxation that modes lack where strains of different kinds have
different damping times is found from them, too.
"""

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any

from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Floats
from shellmb.preprocessing.modal.isolated import SHIFT, STATIC, IsolatedBody
from shellmb.preprocessing.modal.loads import TermsAtRest
from shellmb.system.eigenvalues import eigenpairs

# displacements by a force, relative to those in bending, that are round-off: a body gives way in
# its own plane by the square of its thickness over its length, some 1e-8 in the thinnest
NO_MOTION = 1e-12
# below this share of all that a body gives way by it is round-off: with one time for all strains
# that is along the modes themselves
NOTHING = 1e-6


def ritz_vectors(
    isolated: IsolatedBody,
    count: int,
    center: Floats,
    loads: list[Floats],
    springs: PETSc.Mat | None,
) -> list[PETSc.Vec]:
    """Static modes of all frames and the lowest modes with them fixed; else those of the body.

    And what the loads do with the frames fixed; without, as the body gives way to them. Where terms
    hold it, `(K + B) v = f` has `v = v_0 - (K + B)^-1 B v_0` with `K v_0 = f`: the second part is
    one more vector for each of the static ones.

    Args:
        isolated: The body.
        count: Number of modes with the frames fixed; without frames of elastic ones.
        center: Centre of mass, shape (3,), m.
        loads: Nodal forces of distributed loads.
        springs: Stiffness of the terms `B`; None: they have none.
    """

    def felt(body: Held, forces: list[PETSc.Vec]) -> list[PETSc.Vec]:
        """Displacements beyond round-off, for a body of this mass in bending."""
        given = zip(forces, body.answers(forces), strict=True)
        return [v for f, v in given if abs(f.dot(v)) * stiffness > NO_MOTION * f.dot(f)]

    shift = isolated.vector(isolated.motion(0, center))
    stiffness = isolated.scale * float(isolated.gram(isolated.M, [shift])[0, 0])
    body = Held(isolated, isolated.K, center, frames=True)
    static = [*felt(body, [isolated.force(forces) for forces in loads]), *body.moved()]
    found = [*body.lowest(count), *static]
    if springs is not None:
        forces = [springs * vector for vector in (*static, *body.motions)]
        found += felt(Held(isolated, isolated.K + springs, center, frames=True), forces)
    return found


class Held:
    """A body in its supports, whose frames are fixed, too; forces may accelerate it nevertheless.

    Args:
        isolated: The body.
        K: Stiffness matrix.
        center: Point that its rotations are about, shape (3,), m.
        frames: Whether frames are fixed.

    Attributes:
        motions: The rigid motions that it has: about the director of a single node that is fixed,
            or those that supports leave.
    """

    def __init__(self, isolated: IsolatedBody, K: PETSc.Mat, center: Floats, frames: bool) -> None:
        self._isolated, self._K = isolated, K
        numbering, rigid = isolated.system.numbering, isolated.model.rigid if frames else None
        every = np.arange(numbering.start, numbering.start + numbering.owned)
        taken = [k for k, f in enumerate(isolated.system.fields) if rigid and f.name == rigid.name]
        free = np.setdiff1d(every, [n for k in taken for n in numbering.by_field[k]])
        where = PETSc.IS().createGeneral(free.astype(PETSc.IntType), comm=isolated.comm)
        self._inner = [A.createSubMatrix(where, where) for A in (K, isolated.M)]
        self._free = (free - numbering.start).astype(np.int64)
        if rigid is None:
            moves = [isolated.vector(isolated.motion(axis, center)) for axis in range(6)]
            shares = isolated.free_motions(center)
        else:
            moves, shares = self._turns(rigid)
        self.motions = [self._combined(moves, share) for share in shares.T]

    def _turns(self, rigid: Any) -> tuple[list[PETSc.Vec], Floats]:
        """Rotations about the only frame while that is still, and which of these deform nothing."""
        isolated = self._isolated
        if len(rigid.index) > 1 or isolated.model.scene.supports:
            return [], np.zeros((0, 0))
        (name,) = rigid.index
        about, turns = rigid.bodies[rigid.index[name]].center, []
        for axis in (3, 4, 5):
            turns.append(isolated.vector(isolated.motion(axis, about)))
            turns[-1].axpy(-1.0, isolated.vector(isolated.motion(axis, about, name)))
        # resultants are unknowns, too: what deforms is told by forces and strains, not by energies
        images = [isolated.K * turn for turn in turns]
        sizes, shares = np.linalg.eigh([[a.dot(b) for a in images] for b in images])
        return turns, shares[:, sizes < NO_MOTION * sizes[-1]]

    def _combined(self, vectors: list[PETSc.Vec], shares: Floats) -> PETSc.Vec:
        total = self._K.createVecRight()
        total.set(0.0)
        total.maxpy(shares.tolist(), vectors)
        return total

    def lowest(self, count: int) -> list[PETSc.Vec]:
        """The lowest modes, and without frames the rigid ones."""
        K, M = self._inner
        count += 0 if self._isolated.model.rigid is not None else len(self.motions)
        _, inner = eigenpairs(K, M, count, -SHIFT * self._isolated.scale, symmetric=True)
        return [self._whole(vector) for vector in inner]

    @cached_property
    def _solver(self) -> PETSc.KSP:
        K, M = self._inner
        return self._isolated.solver(K, M, STATIC * self._isolated.scale)

    @cached_property
    def _inert(self) -> tuple[list[PETSc.Vec], list[PETSc.Vec]]:
        """Forces that accelerate the body along its motions, and what it does by them.

        A stiffness that holds it answers them with deformations, too.
        """
        forces = [self._isolated.M * motion for motion in self.motions]
        return forces, [self._solved(force) for force in forces]

    def answers(self, forces: list[PETSc.Vec]) -> list[PETSc.Vec]:
        """Displacements by forces, without rigid motions.

        Args:
            forces: Vectors of the system; what accelerates the body is taken out of them.
        """
        found = []
        for force in forces:
            inert, rigid = self._inert
            _take_out(force, inert, self.motions)
            found.append(self._solved(force))
            _take_out(found[-1], rigid, inert)
        return found

    def moved(self) -> list[PETSc.Vec]:
        """Displacements of the frames that move by themselves."""
        isolated, found = self._isolated, []
        rigid = isolated.model.rigid
        if rigid is None:
            return []
        for name, number in rigid.index.items():
            center = rigid.bodies[number].center
            for axis in range(6):
                moved, whole = (
                    isolated.vector(isolated.motion(axis, center, n)) for n in (name, None)
                )
                moved.axpy(-1.0, self._solved(self._K * moved))
                size, full = np.diag(isolated.gram(isolated.M, [moved, whole]))
                # a frame at a single node of a shell turns about the director without the body: as
                # large as one, the round-off of that would be a wild mode
                if size > NO_MOTION * full:
                    found.append(moved)
        return found

    def _solved(self, force: PETSc.Vec) -> PETSc.Vec:
        part, inside = self._inner[0].createVecLeft(), self._inner[0].createVecRight()
        part.array[:] = force.array[self._free]
        self._solver.solve(part, inside)
        return self._whole(inside)

    def _whole(self, part: PETSc.Vec) -> PETSc.Vec:
        """A vector of the system from one of its free unknowns."""
        out = self._K.createVecRight()
        out.array[:] = 0.0
        out.array[self._free] = part.array
        return out


def _take_out(vector: PETSc.Vec, along: list[PETSc.Vec], by: list[PETSc.Vec]) -> None:
    """Take out of a vector what it has of some others, as those tell by which these are told."""
    if along:
        gram = [[b.dot(a) for a in along] for b in by]
        vector.maxpy((-np.linalg.solve(gram, [b.dot(vector) for b in by])).tolist(), along)


def relaxing(
    held: IsolatedBody, found: list[PETSc.Vec], mixed: Floats, stiffness: Floats, center: Floats
) -> Floats | None:
    """`D K^-1 D` of the body's modes less what they have of it; None without damping.

    A body gives way to the forces of damping of a mode in shapes that perhaps no mode has: at a
    frequency `w` its stiffness is smaller by `w^2` times this.

    Args:
        held: The body in its supports.
        found: Ritz vectors.
        mixed: The modes in terms of these, rigid motions apart, shape (n, K).
        stiffness: Stiffness of the modes, shape (K,), N/m.
        center: Centre of mass, shape (3,), m.

    Returns:
        Shape (K, K), N s^2/m.
    """
    viscous = held.damping
    if viscous is None:
        return None
    body = Held(held, held.K, center, frames=False)
    moved = body.answers([viscous * vector for vector in found])
    n, products = len(found), held.gram(held.K, [*found, *moved])
    known, whole = mixed.T @ products[:n, n:] @ mixed, mixed.T @ products[n:, n:] @ mixed
    left = whole - known.T @ (known / stiffness[:, None])
    size = np.sqrt(np.outer(whole.diagonal(), whole.diagonal()))
    return np.asarray(np.where(np.abs(left) > NOTHING * size, left, 0.0))


def lacking(
    held: IsolatedBody, found: list[PETSc.Vec], terms: TermsAtRest, center: Floats
) -> Callable[[float, Mapping[str, Any], Floats], float]:
    """Measure of displacements by terms that no Ritz vector has, as of `ModalBody`.

    Frames are fixed: what these carry has static modes.

    Args:
        held: The body in its supports.
        found: Ritz vectors.
        terms: The terms.
        center: Centre of mass, shape (3,), m.
    """
    rigid, body = held.model.rigid, Held(held, held.K, center, frames=True)
    frames = slice(0) if rigid is None else held.own[rigid.name]
    moves = [float(np.max(np.abs(held.field(v)[frames]), initial=0.0)) for v in found]
    moved = held.comm.allreduce(np.array(moves))
    own = [vector for vector, size in zip(found, moved, strict=True) if size == 0]
    inverse = np.linalg.pinv(held.gram(held.K, own), rcond=NO_MOTION, hermitian=True)

    def farthest(t: float, nodes: Mapping[str, Any], d: Floats) -> float:
        force = held.force(terms.acting(t, nodes, d))
        (answer,) = body.answers([force])
        answer.maxpy((-inverse @ [force.dot(vector) for vector in own]).tolist(), own)
        return held.farthest(held.field(answer))

    return farthest
