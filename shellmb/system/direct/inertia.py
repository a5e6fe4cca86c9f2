"""Number of negative eigenvalues of a symmetric matrix, by the signs of its pivots."""

from __future__ import annotations

from mpi4py import MPI as _MPI  # noqa: F401  (before petsc4py)
from petsc4py import PETSc

from shellmb.system.direct.mumps import MUMPS_OPTIONS, WORKSPACE, use_mumps
from shellmb.system.direct.symmetry import asymmetry

# icntl_13 = 1: the last block is factorised on one rank, else its pivots are not counted;
# icntl_24 = 1: pivots that are zero are counted by themselves; the workspace as of other systems
OPTIONS = {"mat_mumps_icntl_13": 1, "mat_mumps_icntl_24": 1, WORKSPACE: MUMPS_OPTIONS[WORKSPACE]}

# what round-off can make of a small path's matrix, whose membrane is 1e7 times as stiff as it bends
SYMMETRIC = 1e-7


class Inertia:
    """Factorises `A = L D L^T` by MUMPS and counts the negative entries of `D`.

    Sylvester's law of inertia: as many as there are negative eigenvalues. What was eliminated
    before `A` was assembled is not counted: cells that are unstable by themselves, all around them
    held.

    Args:
        A: The matrix; its values may change, its pattern not.
        prefix: PETSc options prefix, unique per matrix.
    """

    def __init__(self, A: PETSc.Mat, prefix: str) -> None:
        self._A = A
        self._pc = PETSc.PC().create(A.getComm())
        use_mumps(self._pc, PETSc.PC.Type.CHOLESKY, prefix, OPTIONS)

    def negative(self) -> int | None:
        """Number of negative eigenvalues of the matrix as it is.

        Returns:
            The number; None if the matrix is not symmetric (follower loads) or singular to the last
            digit.
        """
        if asymmetry(self._A) > SYMMETRIC:
            return None
        self._pc.setOperators(self._A)
        self._pc.setUp()
        if self._pc.getFailedReason() != 0:
            self._pc.reset()
            return None
        return int(self._pc.getFactorMatrix().getInertia()[0])
