"""Unknowns of a linearised scene reduced to coordinates that no constraint ties."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from shellmb.api.responding.system import Matrices, Orders
from shellmb.arrays import Floats, Ints
from shellmb.errors import SceneError

if TYPE_CHECKING:
    from petsc4py import PETSc

    from shellmb.running.rotating.linearised import Linearised

# singular values of constraints below this part of the largest are zero
DEPENDENT = 1e-9
# parts of states that are forces of constraints, and those that are resultants
MULTIPLIERS, RESULTANTS = ("lam", "mu", "hold"), ("N", "S")
# of the least squares that forces of constraints follow by, where some are redundant
SMALL = 1e-14


@dataclass(frozen=True, eq=False)
class Coordinates:
    """Matrices in coordinates, what drives them, and what follows from them.

    Args:
        A: Stiffness, damping and mass matrix, and stiffness of what relaxes, of each branch.
        F: Forces by inputs, by their derivatives, and by what each branch sees of them.
        Y: Outputs by coordinates, likewise.
        D: Outputs by inputs, likewise.
        basis: What each coordinate does to the unknowns of the system, shape (unknowns, n).
    """

    A: Matrices
    F: Orders
    Y: Orders
    D: Orders
    basis: sp.csr_array

    def projected(self, T: sp.csr_array) -> Coordinates:
        """Matrices in other coordinates, of which there are as many as columns of `T`.

        Args:
            T: These coordinates by the others, shape (n, m).
        """
        A = tuple(sp.csr_array(T.T @ a @ T) for a in self.A)
        F, Y = tuple(T.T @ f for f in self.F), tuple(y @ T for y in self.Y)
        return Coordinates(A, F, Y, self.D, sp.csr_array(self.basis @ T))


class Unknowns:
    """Matrices of all unknowns of a state, with columns of those that have given values.

    Args:
        state: The state.
        matrices: Stiffness, damping, mass, and stiffness of each branch.
        forces: By inputs, shape (unknowns, inputs); None: without inputs.
        motions: Given values by inputs, shape (unknowns, inputs).
        rows: Outputs by unknowns, by their rates, by their accelerations (none), and by what
            each branch sees of them, each of shape (outputs, unknowns); None: without outputs.
    """

    def __init__(
        self,
        state: Linearised,
        matrices: Sequence[PETSc.Mat],
        forces: Floats | None = None,
        motions: Floats | None = None,
        rows: Orders | None = None,
    ) -> None:
        from shellmb.preprocessing.bodyfields import dofs_of

        def those(parts: Sequence[str]) -> Ints:
            bodies, every = state.model.bodies, state.system.numbering.by_field
            found = [own[dofs_of(body, parts)] for body, own in zip(bodies, every, strict=True)]
            return np.unique(np.concatenate(found)).astype(np.int64)

        nothing = np.zeros((state.system.size, 0))
        self.A = tuple(map(scipy_matrix, matrices))
        self.forces = nothing if forces is None else forces
        self.motions = nothing if motions is None else motions
        self.rows = (nothing.T,) * len(matrices) if rows is None else rows
        self.fixed = np.asarray(state.system.fixed, dtype=np.int64)
        self.resultants, self.multipliers = those(RESULTANTS), those(MULTIPLIERS)

    def kept(self) -> Coordinates:
        """All unknowns without given values, with their constraints."""
        size = self.A[0].shape[0]
        free = np.setdiff1d(np.arange(size), self.fixed)
        rows = [a[free] for a in self.A]
        F = [-(a @ self.motions) for a in rows]
        F[0] = self.forces[free] + F[0]
        basis = _places(free, size)
        Y, D = (tuple(row @ to for row in self.rows) for to in (basis, self.motions))
        return Coordinates(tuple(sp.csr_array(a[:, free]) for a in rows), tuple(F), Y, D, basis)

    def free(self) -> Coordinates:
        """Coordinates that no constraint ties: resultants and multipliers follow from them."""
        (K, C, M, *branches), seen = self.A, self.rows
        every = np.arange(K.shape[0])
        rest = np.setdiff1d(every, self.fixed)
        N, tied = (np.intersect1d(some, rest) for some in (self.resultants, self.multipliers))
        q = np.setdiff1d(rest, np.concatenate([N, tied]))
        if len(N):
            # each cell has its own; strains that branches see are those of motions, of any modulus
            inner = spla.splu(K[N][:, N].tocsc())
            others = np.setdiff1d(every, N)
            column = sp.csr_array(K[N][:, others])
            to, where = _places(N, len(every)), _places(others, len(every))
            P = sp.csr_array((where - to @ _solved(inner, column)) @ where.T)
            K, seen = sp.csr_array(K @ P), tuple(row @ P for row in seen)
            branches = [sp.csr_array(P.T @ A @ P) for A in branches]
        value, rows, acting = seen[0], K[tied], [A[q] for A in (K, C, M, *branches)]
        G = sp.csr_array(rows[:, q])
        T = null_space(G)
        # unknowns by given values: those of constraints, and what closes the latter
        lift = self.motions.copy()
        lift[q] -= _least(G, rows @ self.motions)
        # forces of constraints by `forces - M a - C v - K x`
        held = _least(G, value[:, tied].T).T
        F = [-(A @ lift) for A in acting]
        F[0] = F[0] + self.forces[q]
        D = [row @ lift + held @ f for row, f in zip(seen, F, strict=True)]
        Y = [row[:, q] - held @ A[:, q] for row, A in zip(seen, acting, strict=True)]
        own = tuple(A[:, q] for A in acting)
        found = Coordinates(own, tuple(F), tuple(Y), tuple(D), _places(q, len(every)))
        return _with_mass(found.projected(T))


def _places(numbers: Ints, size: int) -> sp.csr_array:
    """Matrix that puts entries at some places of a vector, shape (size, numbers)."""
    ones = np.ones(len(numbers))
    return sp.csr_array((ones, (numbers, np.arange(len(numbers)))), (size, len(numbers)))


def _least(A: sp.csr_array, b: Floats) -> Floats:
    """Least vectors `x` that satisfy `A x = b`, in columns; rows of `A` may be redundant."""
    if not b.any() or 0 in A.shape:
        return np.zeros((A.shape[1], b.shape[1]))
    size = float(abs(A).max()) ** 2
    inner = sp.csc_array(A @ A.T + SMALL * size * sp.eye_array(A.shape[0]))
    return np.asarray(A.T @ spla.splu(inner).solve(np.ascontiguousarray(b)))


def _solved(inner: Any, column: sp.csr_array) -> sp.csc_array:
    """Solutions for sparse right-hand sides, a few at a time."""
    column, found = column.tocsc(), []
    for first in range(0, column.shape[1], 200):
        found.append(sp.csc_array(inner.solve(column[:, first : first + 200].toarray())))
    return sp.csc_array(sp.hstack(found, format="csc"))


def _with_mass(found: Coordinates) -> Coordinates:
    """Coordinates without inertia follow the others as in statics."""
    K, C, M, *branches = found.A
    sizes = abs(M).sum(axis=1)
    light = np.flatnonzero(sizes <= DEPENDENT**2 * sizes.max(initial=0.0))
    if not len(light):
        return found
    heavy = np.setdiff1d(np.arange(len(sizes)), light)
    if any(abs(A[light]).sum() > 0 for A in (C, *branches)):
        raise SceneError(
            "matrices: dampers, or what relaxes, act on directors or coordinates without inertia; "
            "give them inertia (rotary_inertia=True, or a mass)"
        )
    inner = spla.splu(K[light][:, light].tocsc())
    T = sp.lil_array((len(sizes), len(heavy)))
    T[heavy, np.arange(len(heavy))] = 1.0
    T[light] = -inner.solve(K[light][:, heavy].toarray())
    direct = list(found.D)
    for order, force in enumerate(found.F[:3]):
        moved = inner.solve(np.ascontiguousarray(force[light]))
        for more, y in enumerate(found.Y[: 3 - order]):
            direct[order + more] = direct[order + more] + y[:, light] @ moved
    return replace(found.projected(sp.csr_array(T)), D=tuple(direct))


def null_space(rows: sp.csr_array) -> sp.csr_array:
    """An orthonormal basis of what violates no constraint, as columns.

    Args:
        rows: The constraints, shape (m, n). Those that share no unknown are looked at apart.
    """
    from scipy.sparse.csgraph import connected_components

    m, n = rows.shape
    # entries that are zero tie nothing
    rows = rows.copy()
    rows.eliminate_zeros()
    tied = np.isin(np.arange(n), rows.indices)
    free = np.flatnonzero(~tied)
    parts: list[tuple[Ints, Any]] = [(free, sp.eye_array(len(free)))]
    if tied.any():
        graph = sp.block_array([[None, rows], [rows.T, None]], format="csr")
        _, labels = connected_components(graph, directed=False)
        unknowns = _by_label(labels[m:])
        for label, group in _by_label(labels[:m]).items():
            columns = unknowns.get(label, free[:0])
            if tied[columns].any():
                _, sizes, V = np.linalg.svd(rows[group][:, columns].toarray())
                rank = int(np.sum(sizes > DEPENDENT * sizes[0]))
                parts.append((columns, V[rank:].T))
    order, blocks = zip(*parts, strict=True)
    return sp.csr_array(_places(np.concatenate(order), n) @ sp.block_diag(blocks, format="csr"))


def _by_label(labels: Ints) -> dict[int, Ints]:
    """Places of each label, in their order."""
    order = np.argsort(labels, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(labels[order])) + 1)
    return {int(labels[group[0]]): group for group in groups}


def scipy_matrix(A: PETSc.Mat) -> sp.csr_array:
    """A matrix of one process as one of SciPy."""
    ends, columns, entries = A.getValuesCSR()
    return sp.csr_array((entries, columns, ends), shape=A.getSize())
