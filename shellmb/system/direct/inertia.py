"""Number of negative eigenvalues of a symmetric matrix, by the signs of its pivots."""

from __future__ import annotations

from mpi4py import MPI as _MPI  # noqa: F401  (before petsc4py)
from petsc4py import PETSc

from shellmb.system.direct.mumps import MUMPS_OPTIONS, WORKSPACE, use_mumps

# difference from the transposed matrix, relative in the Frobenius norm, that round-off can make
SYMMETRIC = 1e-9

# icntl_13 = 1: the last block is factorised on one rank, else its pivots are not counted;
# icntl_24 = 1: pivots that are zero are counted by themselves; the workspace as of other systems
OPTIONS = {"mat_mumps_icntl_13": 1, "mat_mumps_icntl_24": 1, WORKSPACE: MUMPS_OPTIONS[WORKSPACE]}


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
        self._A, self._prefix = A, prefix
        self._copy: PETSc.Mat | None = None

    def asymmetry(self) -> float:
        """Size of `A - A^T` relative to that of `A`."""
        difference = PETSc.Mat()
        self._A.transpose(difference)
        difference.aypx(-1.0, self._A)
        return float(difference.norm() / (self._A.norm() or 1.0))

    def negative(self) -> int | None:
        """Number of negative eigenvalues of the matrix as it is.

        Returns:
            The number; None if the matrix is not symmetric (follower loads) or singular to the last
            digit.
        """
        if self.asymmetry() > SYMMETRIC:
            return None
        self._take()
        self._pc.setOperators(self._copy)
        self._pc.setUp()
        if self._pc.getFailedReason() != 0:
            self._copy = None
            return None
        return int(self._pc.getFactorMatrix().getInertia()[0])

    def _take(self) -> None:
        """Copy the values: the mark of symmetry is not to change how others solve with `A`."""
        if self._copy is not None:
            self._A.copy(self._copy, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
            return
        self._copy = self._A.copy()
        self._copy.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        self._copy.setOption(PETSc.Mat.Option.SYMMETRY_ETERNAL, True)
        self._pc = PETSc.PC().create(self._A.getComm())
        use_mumps(self._pc, PETSc.PC.Type.CHOLESKY, self._prefix, OPTIONS)
