"""Unknowns of a linearised scene reduced to coordinates that no constraint ties, and to modes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from shellmb.arrays import Floats, Ints
from shellmb.errors import SceneError, warn

if TYPE_CHECKING:
    from petsc4py import PETSc

    from shellmb.running.rotating.linearised import Linearised
    from shellmb.running.rotating.quadratic import Pair

# of a quantity, of its first and of its second derivative, and of what each branch sees of it
type Orders = tuple[Floats, ...]
type Matrices = tuple[sp.csr_array, ...]

# singular values of constraints below this part of the largest are zero
DEPENDENT = 1e-9
# squares of frequencies that differ by less than this part are one, of symmetric bodies
SAME = 1e-6
# parts of states that are forces of constraints, and those that are resultants
MULTIPLIERS, RESULTANTS = ("lam", "mu", "hold"), ("N", "S")


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
        self.sizes = np.ones(state.system.size)
        for body, own in zip(state.model.bodies, state.system.numbering.by_field, strict=True):
            for part in body.parts:
                self.sizes[own[dofs_of(body, [part.name])]] = part.scale

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
        """Coordinates that no constraint ties: resultants and multipliers follow from them.

        Unknowns are counted in their sizes, so that what ties them is no question of units.
        """
        S = sp.diags_array(self.sizes)
        K, C, M, *branches = (sp.csr_array(S @ A @ S) for A in self.A)
        forces, motions = S @ self.forces, self.motions / self.sizes[:, None]
        seen = tuple(row @ S for row in self.rows)
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
        T, least = split(G)
        # unknowns by given values: those of constraints, and what closes the latter
        lift = motions.copy()
        lift[q] -= least @ (rows @ motions)
        # forces of constraints by `forces - M a - C v - K x`
        held = value[:, tied] @ least.T
        F = [-(A @ lift) for A in acting]
        F[0] = F[0] + forces[q]
        D = [row @ lift + held @ f for row, f in zip(seen, F, strict=True)]
        Y = [row[:, q] - held @ A[:, q] for row, A in zip(seen, acting, strict=True)]
        own = tuple(A[:, q] for A in acting)
        found = Coordinates(own, tuple(F), tuple(Y), tuple(D), S @ _places(q, len(every)))
        return _with_mass(found.projected(T))


def _places(numbers: Ints, size: int) -> sp.csr_array:
    """Matrix that puts entries at some places of a vector, shape (size, numbers)."""
    ones = np.ones(len(numbers))
    return sp.csr_array((ones, (numbers, np.arange(len(numbers)))), (size, len(numbers)))


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


def split(rows: sp.csr_array) -> tuple[sp.csr_array, sp.csr_array]:
    """An orthonormal basis of what violates no constraint, and least vectors that violate each.

    Args:
        rows: The constraints, shape (m, n), which may be redundant. Those that share no unknown
            are looked at apart.

    Returns:
        The basis as columns, and the pseudo-inverse, shape (n, m).
    """
    from scipy.ndimage import value_indices
    from scipy.sparse.csgraph import connected_components

    m, n = rows.shape
    # entries that are zero tie nothing
    rows = rows.copy()
    rows.eliminate_zeros()
    free = np.setdiff1d(np.arange(n), rows.indices)
    if not rows.nnz:
        return sp.csr_array(sp.eye_array(n)), sp.csr_array((n, m))
    graph = sp.block_array([[None, rows], [rows.T, None]], format="csr")
    _, labels = connected_components(graph, directed=False)
    unknowns, groups = value_indices(labels[m:]), value_indices(labels[:m])
    parts: list[tuple[Ints, Ints, Any, Any]] = []
    for label in unknowns.keys() & groups.keys():
        (group,), (columns,) = groups[label], unknowns[label]
        own = rows[group][:, columns].toarray()
        lengths = np.linalg.norm(own, axis=1)
        U, sizes, V = np.linalg.svd(own / lengths[:, None])
        rank = int(np.sum(sizes > DEPENDENT * sizes[0]))
        least = V[:rank].T / sizes[:rank] @ U[:, :rank].T / lengths
        parts.append((group, columns, *map(sp.csr_array, (V[rank:].T, least))))
    group, columns = (np.concatenate(of) for of in list(zip(*parts, strict=True))[:2])
    tied, least = (sp.block_diag([part[k] for part in parts], format="csr") for k in (2, 3))
    to = _places(columns, n)
    basis = sp.hstack([_places(free, n), to @ tied], format="csr")
    return sp.csr_array(basis), sp.csr_array(to @ least @ _places(group, m).T)


def scipy_matrix(A: PETSc.Mat) -> sp.csr_array:
    """A matrix of one process as one of SciPy."""
    ends, columns, entries = A.getValuesCSR()
    return sp.csr_array((entries, columns, ends), shape=A.getSize())


def refined(pair: Pair, matrices: Sequence[sp.csr_array]) -> complex:
    """The eigenvalue to the square of the error of its vectors, from the right and the left one."""
    from shellmb.running.rotating.quadratic import nearest_root

    v = pair.real.array + 1j * pair.imaginary.array
    whole = sum(pair.value**power * A for A, power in zip(matrices, (2, 1, 0), strict=True))
    try:
        inner = spla.splu(sp.csc_array(whole, dtype=np.complex128))
    except RuntimeError:
        # it is an eigenvalue to the last digit
        return pair.value
    left, v = inner.solve(v, "T"), inner.solve(v)
    return nearest_root([left @ (A @ v) for A in matrices], pair.value)


def lowest_modes(
    K: sp.csr_array, M: sp.csr_array, count: int, within: float = 0.0
) -> tuple[Floats, Floats]:
    """The lowest undamped modes, normalised to a mass of one.

    Args:
        K: Stiffness, of which the symmetric part counts.
        M: Mass.
        count: How many, at most as coordinates.
        within: Frequency below which they have to be complete [Hz].

    Returns:
        Squares of the angular frequencies, shape (count,) [rad^2/s^2], and the modes as
        columns, shape (n, count).

    Raises:
        SceneError: If there are not so many.
    """
    size = K.shape[0]
    most = size if M.diagonal().min() > 0 else size - 1
    if not 0 < count <= most:
        raise SceneError(f"linearise: modes is {count}; it must be from 1 to {most} (coordinates)")
    scale = abs(K.diagonal()).max() / abs(M.diagonal()).max()
    shift = -1e-9 * float(scale)
    even = (0.5 * (K + K.T)).tocsc()
    wanted = min(count + 1, most)
    if wanted < size:
        values, vectors = spla.eigsh(even, wanted, M.tocsc(), sigma=shift)
    else:
        values, vectors = la.eigh(even.toarray(), M.toarray())
    order = np.argsort(values)
    last, *beyond = values[order[count - 1 :]]
    hertz = math.sqrt(max(last, 0.0)) / (2 * math.pi)
    if beyond and beyond[0] - last < SAME * last and hertz < within:
        warn(
            f"linearise: modes is {count}, and mode {count + 1} has the frequency of the last one, "
            f"{hertz:.6g} Hz; which part of both is left out depends on round-off: take one more"
        )
    return values[order[:count]], vectors[:, order[:count]]
