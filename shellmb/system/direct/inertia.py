"""Number of negative eigenvalues of a matrix, by the signs of its pivots."""

from petsc4py import PETSc

from shellmb.system.direct.mumps import MUMPS_OPTIONS, WORKSPACE, use_mumps
from shellmb.system.direct.symmetry import is_symmetric

# icntl_13 = 1: the last block is factorised on one rank, else its pivots are not counted;
# icntl_24 = 1: pivots that are zero are counted by themselves; the workspace as of other systems
OPTIONS = {"mat_mumps_icntl_13": 1, "mat_mumps_icntl_24": 1, WORKSPACE: MUMPS_OPTIONS[WORKSPACE]}
# icntl_33 = 1: the determinant, too
DETERMINANT = {**OPTIONS, "mat_mumps_icntl_24": 0, "mat_mumps_icntl_33": 1}


class Inertia:
    """Factorises `A = L D L^T` by MUMPS and counts the negative entries of `D`.

    Sylvester's law of inertia: as many as there are negative eigenvalues. Resultants and
    multipliers have to be in the matrix: where they are eliminated, round-off of what they leave is
    larger than forces of bending of thin bodies, and what is eliminated is not counted.

    Args:
        A: The matrix; its values may change, its pattern not.
        prefix: PETSc options prefix, unique per matrix.
    """

    def __init__(self, A: PETSc.Mat, prefix: str) -> None:
        self._A, self._prefix = A, prefix
        self._symmetric: PETSc.PC | None = None
        self._other: PETSc.PC | None = None

    @property
    def symmetric(self) -> bool:
        """Decide whether the matrix is symmetric, as it is."""
        return is_symmetric(self._A)

    def negative(self) -> int | None:
        """Number of negative eigenvalues of the matrix, which is symmetric.

        Returns:
            The number; None if the matrix has no factors.
        """
        if self._symmetric is None:
            self._symmetric = PETSc.PC().create(self._A.getComm())
            use_mumps(self._symmetric, PETSc.PC.Type.CHOLESKY, f"{self._prefix}ldl_", OPTIONS)
        if not self._factorised(self._symmetric):
            return None
        return int(self._symmetric.getFactorMatrix().getInertia()[0])

    def solve(self, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """Solve with the factors of the last `negative`."""
        assert self._symmetric is not None
        self._symmetric.apply(b, x)

    def odd(self) -> bool | None:
        """Decide by its determinant if a matrix has an odd number of negative real eigenvalues.

        Returns:
            Whether; None if the matrix has no factors.
        """
        if self._other is None:
            self._other = PETSc.PC().create(self._A.getComm())
            use_mumps(self._other, PETSc.PC.Type.LU, f"{self._prefix}lu_", DETERMINANT)
        if not self._factorised(self._other):
            return None
        return bool(self._other.getFactorMatrix().getMumpsRinfog(12) < 0.0)

    def _factorised(self, pc: PETSc.PC) -> bool:
        """Decide whether the matrix has factors, which are made."""
        pc.setOperators(self._A)
        pc.setUp()
        if pc.getFailedReason() == 0:
            return True
        pc.reset()
        return False
