"""A body by itself, with frames welded to it: its matrices, motions and forces."""

from collections.abc import Collection
from functools import cached_property
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx import fem

from shellmb.arrays import Floats, Ints
from shellmb.model.model import Model
from shellmb.preprocessing.constraint_analysis.mobility import SMALL, Frame, Motions
from shellmb.preprocessing.constraint_analysis.redundancy import look_through
from shellmb.preprocessing.modal.tangent import Blocks, bending_scales, tangent
from shellmb.scene import Scene
from shellmb.scene.schemes import SIMPLEST
from shellmb.system.direct.mumps import mumps_options, new_prefix, use_mumps
from shellmb.system.eigenvalues import eigenpairs

# the shift of eigenproblems, and of static modes, relative to D/(m L^4): the latter is so small
# that they are static, and not zero, because a frame may leave the body free to turn about it
SHIFT, STATIC = 10.0, 1e-6
# of a beam with both ends free over that of one with an end clamped, 22.37/3.516
CLAMPED = 6.36


class IsolatedBody:
    """A body by itself.

    Args:
        scene: The scene of it: shells and beams, massless frames welded to them, and supports.
        comm: Communicator.

    Attributes:
        model: The model.
        system: Its block system.
        bodies: Bodies that have nodes by name, which come first in the system: a field is one array
            of their local values, shape (size,); several are columns.
        own: Places of their values in such an array.
        size: Number of all these values.
    """

    def __init__(self, scene: Scene, comm: MPI.Comm) -> None:
        self.comm, self.model = comm, Model(scene, comm)
        look_through(self.model)
        self.system, self._stiffness, self._mass = tangent(self.model)
        self.bodies: dict[str, Any] = dict(self.model.meshed)
        if self.model.rigid is not None:
            self.bodies[self.model.rigid.name] = self.model.rigid
        slices = map(self.system.numbering.slice, range(len(self.bodies)))
        self.own = dict(zip(self.bodies, slices, strict=True))
        self.size = int(self.system.numbering.offsets[len(self.bodies)])
        # each on the rank that owns it
        counts = {n: b.mixed.space.dofmap.index_map.size_local for n, b in self.bodies.items()}
        self._owned = np.concatenate([self.own[n].start + np.arange(k) for n, k in counts.items()])
        self._u, self._w = (self._vectors(part) for part in ("u", "w"))

    def _vectors(self, part: str) -> Ints:
        """Places of the vectors of a part, node after node, shape (n, 3)."""
        bodies = self.bodies.items()
        return np.concatenate(
            [self.own[name].start + body.mixed.dofs[part].reshape(-1, 3) for name, body in bodies]
        )

    @cached_property
    def K(self) -> PETSc.Mat:
        """Stiffness matrix at the reference, resultants and multipliers included."""
        return self.system.symmetric_matrix(self._stiffness, 1.0)

    @cached_property
    def M(self) -> PETSc.Mat:
        """Mass matrix."""
        return self.system.symmetric_matrix(self._mass, 0.0)

    def tangent_at(self, state: PETSc.Vec) -> PETSc.Mat:
        """Stiffness matrix at a state; collective."""
        self.system.scatter(state)
        return self.system.symmetric_matrix(self._stiffness, 1.0)

    def stiffness_of(self, names: Collection[str]) -> PETSc.Mat:
        """Stiffness matrix of some bodies by themselves, with the columns of fixed unknowns."""
        own = [k for k, body in enumerate(self.model.bodies) if body.name in names]
        blocks = {place: forms for place, forms in self._stiffness.items() if place[0] in own}
        return self.system.symmetric_matrix(blocks, 0.0, columns=True)

    @property
    def damping(self) -> PETSc.Mat | None:
        """Damping matrix of the strains at the reference; None without any."""
        blocks: Blocks = {}
        for k, body in enumerate(self.model.bodies):
            if body.damping is not None:
                q, space = fem.Function(body.mixed.space), body.mixed.space
                test, trial = ufl.TestFunction(space), ufl.TrialFunction(space)
                blocks[k, k] = [body.damping.at(q, trial, test)]
        return self.system.symmetric_matrix(blocks, 0.0) if blocks else None

    @property
    def scale(self) -> float:
        """Size of the squares of the lowest frequencies, rad^2/s^2."""
        return min(bending_scales(self.model))

    def of_body(self, name: str, values: Floats) -> Floats:
        """A field from the local array of one body, zero elsewhere."""
        out = np.zeros(self.size)
        out[self.own[name]] = values
        return out

    def vector(self, field: Floats) -> PETSc.Vec:
        """A vector of the system from a field, zero where that is not a number."""
        every = [np.full(f.size_all, np.nan) for f in self.system.fields]
        for values, own in zip(every, self.own.values(), strict=False):
            values[:] = field[own]
        out = self.K.createVecRight()
        out.array[:] = self.system.global_values(every, known=True)
        return out

    def field(self, vector: PETSc.Vec) -> Floats:
        """The field of a vector of the system."""
        return self.system.local_values(vector)[: self.size]

    def farthest(self, field: Floats) -> float:
        """Largest displacement of a field, m; collective."""
        far = float(np.max(np.linalg.norm(field[self._u], axis=1), initial=0.0))
        return float(self.comm.allreduce(far, op=MPI.MAX))

    def work(self, forces: Floats, fields: Floats) -> Floats:
        """Work of nodal forces on fields, shape (size, n), of what each rank owns; collective."""
        local = forces[self._owned] @ fields[self._owned]
        return np.asarray(self.comm.allreduce(local, op=MPI.SUM))

    def motion(self, axis: int, about: Floats, name: str | None = None) -> Floats:
        """A rigid motion of all bodies, or of one frame.

        Args:
            axis: 0, 1, 2: along; 3, 4, 5: about x, y, z.
            about: Point that rotations are about, shape (3,), m.
            name: Name of the frame that moves alone; None: everything.
        """
        out, unit = np.zeros(self.size), np.eye(3)[axis % 3]
        out[self._u] = unit if axis < 3 else np.cross(unit, self._X - about)
        out[self._w] = 0.0 if axis < 3 else np.cross(unit, self._D)
        rigid = self.model.rigid
        if name is None or rigid is None:
            return out
        alone = [self.own[rigid.name].start + rigid.local(name, part) for part in ("u", "w")]
        out[np.setdiff1d(np.arange(self.size), np.concatenate(alone))] = 0.0
        return out

    @cached_property
    def _X(self) -> Floats:
        """Positions of all nodes of this rank, shape (n, 3), m."""
        return np.concatenate([body.node_positions() for body in self.bodies.values()])

    @cached_property
    def _D(self) -> Floats:
        """Directors of all nodes, one after the other, shape (n, 3)."""
        return np.concatenate([b.node_directors().reshape(-1, 3) for b in self.bodies.values()])

    def free_motions(self, about: Floats) -> Floats:
        """Rigid motions that supports leave, as combinations of `motion`, shape (6, n); collective.

        Args:
            about: Point that rotations are about, shape (3,), m.
        """
        frame, free = self._free
        shifts, turns = frame.size * free[:3], free[3:]
        return np.vstack([shifts + np.cross(turns.T, about - frame.middle).T, turns])

    @cached_property
    def _free(self) -> tuple[Frame, Floats]:
        motions, name = Motions(self.model), next(iter(self.model.meshed))
        first = 6 * motions.blocks[name]
        # a frame at a single node of a shell turns about the director by itself
        U, s, _ = np.linalg.svd(motions.free()[first : first + 6], full_matrices=False)
        return motions.frames[name], U[:, s > SMALL]

    def arm(self, a: int, about: Floats) -> Floats:
        """The scalar field `X_a` with the directors' `D_a`, along x."""
        out = np.zeros(self.size)
        out[self._u[:, 0]], out[self._w[:, 0]] = self._X[:, a] - about[a], self._D[:, a]
        return out

    def moved(self, fields: Floats, a: int, to: int = 0) -> Floats:
        """One component of vector fields as another one, of fields that have no more.

        Args:
            fields: The fields.
            a: Number of the component.
            to: That of the other one; scalar fields are along x.
        """
        out = np.zeros_like(fields)
        for vectors in (self._u, self._w):
            out[vectors[:, to]] = fields[vectors[:, a]]
        return out

    def turned(self, field: Floats, axis: int) -> Floats:
        """`e_a x phi` of a field."""
        out = np.zeros(self.size)
        for vectors in (self._u, self._w):
            out[vectors] = np.cross(np.eye(3)[axis], field[vectors])
        return out

    def force(self, forces: Floats) -> PETSc.Vec:
        """Nodal forces as a vector of the system, none on what supports hold.

        Those of nodes that are shared add up.
        """
        numbers, out = self.system.numbering.local_to_global, self.K.createVecLeft()
        out.set(0.0)
        owned = numbers[self._owned].astype(PETSc.IntType)
        out.setValues(owned, forces[self._owned], addv=PETSc.InsertMode.ADD)
        out.assemble()
        out.array[self.system.fixed] = 0.0
        return out

    def solver(self, K: PETSc.Mat, M: PETSc.Mat, omega2: float) -> PETSc.KSP:
        """A direct solver with a stiffness and the mass at a square of a rate.

        Args:
            K: Stiffness matrix of the system, or a part of it.
            M: Mass matrix likewise.
            omega2: The square [rad^2/s^2].
        """
        solver, A = PETSc.KSP().create(self.comm), K.copy()
        A.axpy(omega2, M)
        solver.setOperators(A)
        solver.setType(PETSc.KSP.Type.PREONLY)
        options = mumps_options(A.getSize()[0], reduced=False)
        use_mumps(solver.getPC(), "lu", new_prefix(self), options)
        return solver

    def gram(self, A: PETSc.Mat, vectors: list[PETSc.Vec]) -> Floats:
        """`v_i . A v_j` of vectors; collective."""
        image, found = A.createVecLeft(), np.zeros((len(vectors), len(vectors)))
        for j, vector in enumerate(vectors):
            A.mult(vector, image)
            found[:, j] = [other.dot(image) for other in vectors]
        return np.asarray((found + found.T) / 2)


def lowest_frequency(model: Model, name: str) -> float:
    """Lowest angular frequency of a body with its supports, rad/s; collective.

    Without supports that of the free body, and where it has joints, which may hold it as a clamp
    does, 1/6.36 of that: so much less it is of a beam.

    Args:
        model: A model with it.
        name: Its name in the scene.
    """
    scene = model.scene
    body: Any = scene.body(name)
    if body.along is not None:
        # it swings with the shell that it runs along
        return lowest_frequency(model, body.along)
    supports = tuple(s for s in scene.supports if scene.bodies_of(s)[0].name == name)
    parts: dict[str, Any] = {body.home: body}
    parts |= {"supports": supports, "scheme": SIMPLEST, "dt": 1.0, "t_end": 1.0}
    isolated = IsolatedBody(Scene(f"{name} alone", **parts), model.comm)
    shift = -SHIFT * isolated.scale
    found, _ = eigenpairs(isolated.K, isolated.M, 7, shift, symmetric=True)
    elastic = [value for value in found.real if value > 1e-3 * isolated.scale]
    held = not supports and any(name in (j.first, j.second) for j in scene.joints)
    return float(np.sqrt(elastic[0])) / (CLAMPED if held else 1.0)
