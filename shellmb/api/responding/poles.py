"""Poles of linear systems, and their undamped modes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from shellmb.arrays import Floats
from shellmb.errors import SceneError

type Complex = npt.NDArray[np.complex128]
# more poles than wanted, of which both of a pair are found; and those that are infinite
SPARE, INFINITE = 6, 1e-12
# matrices are symmetric to round-off
EVEN = 1e-13


def poles(M: sp.csr_array, C: sp.csr_array, K: sp.csr_array, count: int, shift: float) -> Complex:
    """Eigenvalues of `s^2 M + s C + K`, the smallest ones, of pairs one [1/s].

    Args:
        M: Mass.
        C: Damping.
        K: Stiffness.
        count: How many.
        shift: A number of the size of the lowest ones [1/s].
    """
    n = K.shape[0]
    M, C, K = (a.tocsc() for a in (M, C, K))
    factor = spla.splu((K + shift * C + shift**2 * M).tocsc())

    def inverse(b: Any) -> Any:
        """Of `A - shift E`, times `E`."""
        first, second = b[:n], M @ b[n:]
        x = factor.solve(-second - C @ first - shift * (M @ first))
        return np.concatenate([x, first + shift * x])

    if 2 * count + SPARE < 2 * n - 1:
        whole = spla.LinearOperator((2 * n, 2 * n), matvec=inverse, dtype=float)
        start = np.random.default_rng(0).standard_normal(2 * n)
        found, vectors = spla.eigs(whole, 2 * count + SPARE, v0=start)
    else:
        found, vectors = la.eig(inverse(np.eye(2 * n)))
    # those of constraints are infinite
    good = np.abs(found) > INFINITE * np.abs(found).max()
    values, vectors = shift + 1 / found[good], vectors[:n, good]
    upper = np.flatnonzero(values.imag >= 0)
    upper = upper[np.lexsort((values.imag[upper], np.abs(values[upper])))][:count]
    even = all(abs(A - A.T).max() <= EVEN * abs(A).max() for A in (C, K))
    return np.array([_quotient(values[k], vectors[:, k], (M, C, K), even) for k in upper])


def relaxing_poles(
    M: sp.csr_array,
    C: sp.csr_array,
    K: sp.csr_array,
    branches: Mapping[float, sp.csr_array],
    count: int,
    shift: float,
) -> Complex:
    """Poles of what relaxes, but for those that creep and decay.

    Args:
        M: Mass.
        C: Damping.
        K: Long-term stiffness.
        branches: Stiffness of Maxwell branches, by time [s].
        count: How many.
        shift: As of `poles`.
    """
    from mpi4py import MPI
    from petsc4py import PETSc

    from shellmb.running.rotating.quadratic import Relaxing

    def petsc(A: sp.csr_array) -> PETSc.Mat:
        csr = A.indptr.astype(PETSc.IntType), A.indices.astype(PETSc.IntType), A.data
        return PETSc.Mat().createAIJ(A.shape, csr=csr, comm=MPI.COMM_SELF)

    springs = {time: petsc(A) for time, A in branches.items()}
    found = Relaxing(petsc(K), petsc(C), petsc(M), springs).solve(count, shift)
    return np.array([pair.value for pair in found[:count]])


def _quotient(value: complex, v: Complex, matrices: Sequence[sp.csc_array], even: bool) -> complex:
    """The eigenvalue to the square of the error of its vectors, from the right and the left one."""
    left = v
    if not even:
        M, C, K = matrices
        try:
            inner = spla.splu(sp.csc_array(K + value * C + value**2 * M, dtype=np.complex128))
            left, v = inner.solve(v.astype(np.complex128), "T"), inner.solve(v.astype(complex))
        except RuntimeError:
            # it is an eigenvalue to the last digit
            return value
    roots = np.roots([left @ (A @ v) for A in matrices])
    return complex(min([*roots, np.inf], key=lambda root: abs(root - value)))


def lowest_modes(K: sp.csr_array, M: sp.csr_array, count: int) -> tuple[Floats, Floats]:
    """The lowest undamped modes, normalised to a mass of one.

    Args:
        K: Stiffness, of which the symmetric part counts.
        M: Mass.
        count: How many, at most as coordinates.

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
    if count < size:
        values, vectors = spla.eigsh(even, count, M.tocsc(), sigma=shift)
    else:
        values, vectors = la.eigh(even.toarray(), M.toarray())
    order = np.argsort(values)
    return values[order], vectors[:, order]
