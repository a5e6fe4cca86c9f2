"""Direct solutions by MUMPS, in single precision where that serves, and their failures in words."""

from __future__ import annotations

import itertools
import weakref
from collections.abc import Mapping
from enum import Enum
from types import MappingProxyType

from petsc4py import PETSc

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

# icntl_6 = 0: the analysis, done once per structure, depends on the pattern alone and not on the
# values that happen to be in the matrix, so that a resumed run orders its unknowns as the first one
# did. icntl_14: MUMPS estimates the workspace of the factorisation from the pattern, and a saddle
# point needs far more, in per cent
WORKSPACE, SCALING = "mat_mumps_icntl_14", "mat_mumps_icntl_8"
MUMPS_OPTIONS: dict[str, int] = {WORKSPACE: 400, "mat_mumps_icntl_6": 0}

# scaling goes on until rows and columns are alike. Masses are 1e-16 of multipliers' forces where
# velocities are sought, and with a multiplier that a whole body has, as of a floating frame, the
# usual scaling stops too early: factors of 32x8 elements are 25 times as large. Of matrices that
# several ranks have MUMPS scales in this way only, and not at all where it is asked for another
# one: factors of single precision would not serve (64x64: contraction 0.09 in place of 0.001)
ALIKE: dict[str, int] = {SCALING: 8}

SMALL_SYSTEM = 5000
# of a small system the estimate is a few kilobytes, and delayed pivots may need many times that
SMALL_OPTIONS: dict[str, int] = {WORKSPACE: 20_000}

# of a reduced system: minimum degree orders small ones best, nested dissection large ones, and
# scaling rows and columns once takes half the time of the iteration that is the default (measured
# from 6x2 to 32x32 elements)
REDUCED_OPTIONS: dict[str, int] = {"mat_mumps_icntl_7": 5, SCALING: 4}
SMALL_REDUCED_OPTIONS: dict[str, int] = {"mat_mumps_icntl_7": 0}


# of options that users set for all factorisations, `PETSC_OPTIONS="-shellmb_mumps_icntl_35 2"`:
# prefixes are different in each run
CHOSEN, NATIVE = "shellmb_mumps_", "mat_mumps_"

_NUMBERS = itertools.count(1)


NO_OPTIONS: Mapping[str, int] = MappingProxyType({})


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


def use_mumps(pc: PETSc.PC, kind: str, prefix: str, options: Mapping[str, int | str]) -> None:
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


# With factors of an earlier matrix flexible GMRES solves to this residual. Three steps of 32x32
# elements end in directors of direct solutions to 1e-13 and in velocities to 1e-12, with this
# tolerance as with a thousandth of it: the next iteration squares what is left
KRYLOV_TOLERANCE, KRYLOV_ITERATIONS = 1e-10, 15

# Factors of single precision of a large system take half the time and memory, solutions with them
# two thirds of the time (ED, 32x32 and 64x64 elements). Refinement with the matrix itself, which is
# of double precision, makes them exact to the tolerance: errors and not residuals are looked at,
# as those of soft modes hardly show in forces. Beyond this contraction the matrix is too
# ill-conditioned for it
REFINED_TOLERANCE, REFINEMENTS, CONTRACTION = 1e-10, 6, 0.02

# As factors age, iterations become more. With young ones a solution takes `YOUNG` of them, and they
# serve about one step; new ones pay before a single solution costs as much as they do
YOUNG, SOLUTIONS = 3.0, 3.0

# Cost of assembling and factorising in iterations with an old factorisation: of small systems
# between 6 and 10; of large ones it grows as the operations of the factorisation for each number of
# its factors do, which an iteration reads. At 32x32 elements steps take 4 % (EP) and 29 % (ED) less
# time than with the cost of small systems. An estimate and no measurement of each run, so that a
# run gives the same result each time
SMALL_COST, OPERATIONS = 8.0, 25.0


class Purpose(Enum):
    """What a factorisation is for."""

    EXACT = "any number of exact solutions"
    ONE = "one exact solution"
    LAGGED = "solutions for iterations that contract linearly in any case"


class DirectSolver:
    """MUMPS on one matrix, analysed once and factorised as often as it changes.

    Factors of large reduced systems are of single precision as long as that serves: not for any
    number of exact solutions, and of a matrix that is singular or too ill-conditioned for it no
    more after the first one (mixed precision refinement: Langou et al., Exploiting the performance
    of 32 bit floating point arithmetic in obtaining 64 bit accuracy, SC 2006).

    Args:
        A: The matrix.
        prefix: PETSc options prefix, unique per system.
        scales: Of a reduced system, sizes of the unknowns that this rank owns, by which errors are
            judged; None: it is not a reduced one.
        options: More options of MUMPS.

    Attributes:
        single: Whether factors are of single precision.
        factorisations: Their number so far.
        solutions: Number of solutions with factors so far, each Krylov iteration being one.
        contraction: By what factor the last refinement made errors smaller; None: there was none.
    """

    def __init__(
        self,
        A: PETSc.Mat,
        prefix: str,
        scales: Floats | None = None,
        options: Mapping[str, int] = NO_OPTIONS,
    ) -> None:
        ksp = PETSc.KSP().create(A.getComm())
        ksp.setOptionsPrefix(prefix)
        ksp.setType(PETSc.KSP.Type.PREONLY)
        self.A, self._ksp, self._prefix = A, ksp, prefix
        reduced = scales is not None
        self._options = {**mumps_options(A.getSize()[0], reduced, A.comm.size), **options}
        self._large = A.getSize()[0] >= SMALL_SYSTEM
        self._use(single=reduced and self._large)
        if self.single:
            self._rest, self._change, self._scaled = (A.createVecRight() for _ in range(3))
            self._units = self._rest.duplicate()
            self._units.array[:] = 1.0 / np.asarray(scales)
        ksp.setFromOptions()
        self._purpose = Purpose.EXACT
        self.contraction: float | None = None
        # whether old factors pay, whether those there are old, and whether they do by themselves
        self._paying, self._recycled, self._enough = False, False, False
        self._work: float | None = None
        self.factorisations, self.solutions = 0, 0

    def _use(self, single: bool) -> None:
        """Choose the precision of the factors to come."""
        self.single = single
        pc = self._ksp.getPC()
        pc.reset()
        options = self._options | {"pc_precision": "single" if single else "double"}
        use_mumps(pc, PETSc.PC.Type.LU, self._prefix, options)

    def factorise(self, purpose: Purpose = Purpose.EXACT) -> str | None:
        """Factorise the matrix as it is; returns why that failed, if it did.

        Args:
            purpose: What for. For one exact solution of a large system factors of an earlier matrix
                are kept as a preconditioner, as long as few iterations do.
        """
        self._purpose = purpose
        if self.single and purpose is Purpose.EXACT:
            self._use(single=False)
        recycled = purpose is Purpose.ONE and self._paying and self._large
        return self._factorise(recycled)

    def _factorise(self, recycled: bool) -> str | None:
        self._recycled, self._enough = recycled, not (recycled or self.single)
        self._ksp.setOperators(self.A)
        self._ksp.getPC().setReusePreconditioner(recycled)
        self.factorisations += not recycled
        self._ksp.setUp()
        failure = self._failure()
        if failure is not None and self.single:
            self._use(single=False)
            return self._factorise(recycled=False)
        self._paying = failure is None
        if failure is None and self._work is None:
            self._work = self._operations()
        return failure

    @property
    def rough(self) -> bool:
        """Whether solutions are as exact as factors of single precision, and not refined."""
        return self.single and self._enough

    @property
    def cost(self) -> float:
        """Cost of assembling and factorising, in iterations with an old factorisation."""
        return max(SMALL_COST, (self._work or 0.0) / OPERATIONS)

    def _operations(self) -> float:
        """Operations of the factorisation for each number of its factors, from the analysis."""
        factors = self._ksp.getPC().getFactorMatrix()
        entries = factors.getMumpsInfog(20)
        # MUMPS counts large numbers in millions, and says so by the sign
        numbers = float(entries) if entries > 0 else -1e6 * entries
        return float(factors.getMumpsRinfog(1)) / max(numbers, 1.0)

    def solve(self, b: PETSc.Vec, x: PETSc.Vec) -> str | None:
        """Solve with the last factorisation; returns why that failed, if it did."""
        while not self._enough:
            if self._iterate(b, x) if self._recycled else self._refine(b, x):
                return None
            # old factors are made anew; new ones in double precision
            if not self._recycled:
                self._use(single=False)
            failure = self._factorise(recycled=False)
            if failure is not None:
                return failure
            # the next matrix will be as far from this one
            self._paying = False
        self._direct(b, x)
        return self._failure()

    def _direct(self, b: PETSc.Vec, x: PETSc.Vec) -> None:
        self._ksp.solve(b, x)
        self.solutions += 1

    def _iterate(self, b: PETSc.Vec, x: PETSc.Vec) -> bool:
        """Solve by Krylov iterations with factors of an earlier matrix; whether that succeeds."""
        ksp = self._ksp
        # flexible GMRES solves with the factors once an iteration, and not once more at the end
        ksp.setType(PETSc.KSP.Type.FGMRES)
        ksp.setTolerances(rtol=KRYLOV_TOLERANCE, max_it=KRYLOV_ITERATIONS)
        ksp.solve(b, x)
        reached = ksp.getConvergedReason() > 0
        iterations = ksp.getIterationNumber()
        ksp.setType(PETSc.KSP.Type.PREONLY)
        self.solutions += iterations
        self._paying = iterations <= YOUNG + self.cost / SOLUTIONS
        return bool(reached)

    def _refine(self, b: PETSc.Vec, x: PETSc.Vec) -> bool:
        """Solve by refinement with factors of single precision; whether they are good enough."""
        rest, change = self._rest, self._change
        self._direct(b, x)
        size = before = self._size(x)
        if size == 0.0:
            return True
        for _ in range(REFINEMENTS):
            self.A.mult(x, rest)
            rest.aypx(-1.0, b)
            self._direct(rest, change)
            x.axpy(1.0, change)
            found = self._size(change)
            self.contraction = found / before
            if not self.contraction <= CONTRACTION:
                return False
            # iterations that contract by less themselves need no refinement from now on
            self._enough = self._purpose is Purpose.LAGGED
            # the error left contracts as the last one did
            if self._enough or found * found <= REFINED_TOLERANCE * size * before:
                return True
            before = found
        return False

    def _size(self, x: PETSc.Vec) -> float:
        """Largest of some values of the unknowns, each in its unit."""
        self._scaled.pointwiseMult(x, self._units)
        return float(self._scaled.norm(PETSc.NormType.INFINITY))

    def _failure(self) -> str | None:
        pc = self._ksp.getPC()
        if pc.getFailedReason() == 0:
            return None
        reason = self._reason()
        # a factor that failed once is not tried again
        pc.reset()
        return reason

    def _reason(self) -> str:
        try:
            infog = self._ksp.getPC().getFactorMatrix().getMumpsInfog(1)
        except PETSc.Error:
            return "the linear solver failed"
        reasons = {
            -10: "the matrix is singular: a body can move freely, or constraints are redundant",
            -9: "the direct solver ran out of workspace",
            -13: "the direct solver could not allocate memory",
        }
        return reasons.get(infog, f"the direct solver failed (MUMPS INFOG(1) = {infog})")
