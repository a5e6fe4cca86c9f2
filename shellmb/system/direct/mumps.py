"""MUMPS: its options, and the number of negative eigenvalues by the signs of its pivots."""

import itertools
import weakref
from collections.abc import Mapping
from types import MappingProxyType

from petsc4py import PETSc

from shellmb.system.direct.symmetry import is_symmetric

# icntl_6 = 0: the analysis, done once per structure, depends on the pattern alone and not on the
# values that happen to be in the matrix, so that a resumed run orders its unknowns as the first one
# did. icntl_14: MUMPS estimates the workspace of the factorisation from the pattern, and a saddle
# point needs far more, in per cent
# icntl_35 is said where it is off, too: what factors of one triangle had stays in the database
WORKSPACE, SCALING = "mat_mumps_icntl_14", "mat_mumps_icntl_8"
LOW_RANK, ROUND_OFF = "mat_mumps_icntl_35", "mat_mumps_cntl_7"
MUMPS_OPTIONS: dict[str, int] = {WORKSPACE: 400, "mat_mumps_icntl_6": 0, LOW_RANK: 0}

# scaling goes on until rows and columns are alike. Masses are 1e-16 of multipliers' forces where
# velocities are sought, and with a multiplier that a whole body has, as of a floating frame, the
# usual scaling stops too early: factors of 32x8 elements are 25 times as large. Matrices that
# several ranks have are not scaled at all where scaling once is requested: of ED, 64x64 elements on
# two ranks, 46,000 pivots are then delayed, factors and processor time are 1.1 times as large, and
# a known solution comes back with 3e-8 in place of 8e-11
ALIKE: dict[str, int] = {SCALING: 8}

SMALL_SYSTEM = 5000
# of a small system the estimate is a few kilobytes, and delayed pivots may need many times that
SMALL_OPTIONS: dict[str, int] = {WORKSPACE: 20_000}

# of a reduced system: minimum degree orders small ones best, nested dissection large ones, and
# scaling rows and columns once takes half the time of the iteration that is the default (measured
# from 6x2 to 32x32 elements)
REDUCED_OPTIONS: dict[str, int] = {"mat_mumps_icntl_7": 5, SCALING: 4}
SMALL_REDUCED_OPTIONS: dict[str, int] = {"mat_mumps_icntl_7": 0}
# of one triangle no scaling but these is symmetric; without one, pivots are delayed, and 64x64
# elements take twice the operations. Blocks that are of low rank to round-off are kept as such,
# which is as exact (a known solution of static plates of 128x128 elements comes back with 4e-7 in
# place of 3e-7) and takes 0.95 (64x64) and 0.8 (128x128) of the time; of both triangles it gains
# nothing
SYMMETRIC_OPTIONS: Mapping[str, float] = MappingProxyType(
    {SCALING: 7, LOW_RANK: 2, ROUND_OFF: 1e-13}
)


# of options that users set for all factorisations, `PETSC_OPTIONS="-shellmb_mumps_icntl_35 2"`:
# prefixes are different in each run
CHOSEN, NATIVE = "shellmb_mumps_", "mat_mumps_"

_NUMBERS = itertools.count(1)


NO_OPTIONS: Mapping[str, int] = MappingProxyType({})

# icntl_13 = 1: the last block is factorised on one rank, else its pivots are not counted;
# icntl_24 = 1: pivots that are zero are counted by themselves; the workspace as of other systems
PIVOTS = {"mat_mumps_icntl_13": 1, "mat_mumps_icntl_24": 1, WORKSPACE: MUMPS_OPTIONS[WORKSPACE]}
# icntl_33 = 1: the determinant, too
DETERMINANT = {**PIVOTS, "mat_mumps_icntl_24": 0, "mat_mumps_icntl_33": 1}


def mumps_options(size: int, reduced: bool, ranks: int = 1) -> dict[str, int]:
    """Options of MUMPS.

    Args:
        size: Number of unknowns.
        reduced: Whether the system is a reduced one.
        ranks: How many have parts of it.
    """
    small = size < SMALL_SYSTEM
    found = MUMPS_OPTIONS | (SMALL_OPTIONS if small else {})
    if reduced:
        found |= REDUCED_OPTIONS | (SMALL_REDUCED_OPTIONS if small else {})
    return found | (ALIKE if reduced and ranks > 1 else {})


def new_prefix(owner: object) -> str:
    """A PETSc options prefix that no other system has or had.

    An address would not do: the next object there would find what this one had set.

    Args:
        owner: Whose systems they are; when it is gone, their options are.
    """
    prefix = f"shellmb_{next(_NUMBERS)}_"
    weakref.finalize(owner, _forget, prefix).atexit = False
    return prefix


def _forget(prefix: str) -> None:
    options = PETSc.Options(prefix)
    for key in options.getAll():
        options.delValue(key)


def use_mumps(pc: PETSc.PC, kind: str, prefix: str, options: Mapping[str, float | str]) -> None:
    """Make a preconditioner a factorisation by MUMPS.

    Args:
        pc: The preconditioner.
        kind: Kind of the factorisation, of `PETSc.PC.Type`.
        prefix: PETSc options prefix, unique per system.
        options: Options of MUMPS, and of PETSc for it.
    """
    database = PETSc.Options()
    chosen = {NATIVE + key: value for key, value in PETSc.Options(CHOSEN).getAll().items()}
    for key, value in {**options, **chosen}.items():
        database[prefix + key] = value
    # a system that is never factorised uses none of them, which is no reason for a warning
    database["options_left"] = 0
    pc.setOptionsPrefix(prefix)
    pc.setType(kind)
    pc.setFactorSolverType("mumps")
    # the options stay: MUMPS reads them at each first factorisation of a structure, not here
    pc.setFromOptions()


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
            use_mumps(self._symmetric, PETSc.PC.Type.CHOLESKY, f"{self._prefix}ldl_", PIVOTS)
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
