"""Poles of linear systems, and their undamped modes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from shellmb.arrays import Complex, Floats
from shellmb.errors import SceneError

if TYPE_CHECKING:
    from shellmb.running.rotating.quadratic import Pair


def poles(
    M: sp.csr_array,
    C: sp.csr_array,
    K: sp.csr_array,
    branches: Mapping[float, sp.csr_array],
    count: int,
    shift: float,
) -> Complex:
    """Poles of `s^2 M + s C + K`, the smallest ones, of pairs one, free motions as zeros [1/s].

    Of what relaxes those that creep and decay are left out.

    Args:
        M: Mass.
        C: Damping.
        K: Long-term stiffness.
        branches: Stiffness of Maxwell branches, by time [s].
        count: How many.
        shift: A number of the size of the lowest ones [1/s].
    """
    from mpi4py import MPI
    from petsc4py import PETSc

    from shellmb.running.rotating.quadratic import NEUTRAL, motions
    from shellmb.system.direct.symmetry import is_symmetric

    def petsc(A: sp.csr_array) -> PETSc.Mat:
        csr = A.indptr.astype(PETSc.IntType), A.indices.astype(PETSc.IntType), A.data
        return PETSc.Mat().createAIJ(A.shape, csr=csr, comm=MPI.COMM_SELF)

    k, c, m = map(petsc, (K, C, M))
    springs = {time: petsc(A) for time, A in branches.items()}
    zero, above = motions((k, c, m), springs, count, shift)
    values = [pair.value for pair in above]
    if not branches:
        # the left vectors are the right ones, but vectors of what may be zero are less exact
        exact = NEUTRAL * shift if is_symmetric(k) and is_symmetric(c) else np.inf
        values = [_refined(pair, (M, C, K), abs(pair.value) > exact) for pair in above[:count]]
    return np.array([*[0.0] * len(zero), *values], dtype=np.complex128)[:count]


def _refined(pair: Pair, matrices: Sequence[sp.csr_array], even: bool) -> complex:
    """The eigenvalue to the square of the error of its vectors, from the right and the left one."""
    left = v = pair.real.array + 1j * pair.imaginary.array
    if not even:
        whole = sum(pair.value**power * A for A, power in zip(matrices, (2, 1, 0), strict=True))
        try:
            inner = spla.splu(sp.csc_array(whole, dtype=np.complex128))
        except RuntimeError:
            # it is an eigenvalue to the last digit
            return pair.value
        left, v = inner.solve(v, "T"), inner.solve(v)
    roots = np.roots([left @ (A @ v) for A in matrices])
    return complex(min([*roots, np.inf], key=lambda root: abs(root - pair.value)))


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
