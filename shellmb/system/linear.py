"""Linear systems of Newton's method: direct solvers, and their failures in words."""

from __future__ import annotations

import time
from typing import Protocol

from petsc4py import PETSc

from shellmb.system.assembly import BlockSystem

# icntl_6 = 0: the analysis, done once per structure, depends on the pattern alone and not on the
# values that happen to be in the matrix, so that a resumed run orders its unknowns as the first one
# did. icntl_14: MUMPS estimates the workspace of the factorisation from the pattern, and a saddle
# point needs far more, in per cent
WORKSPACE = "mat_mumps_icntl_14"
MUMPS_OPTIONS: dict[str, int] = {WORKSPACE: 400, "mat_mumps_icntl_6": 0}

SMALL_SYSTEM = 5000
# of a small system the estimate is a few kilobytes, and delayed pivots may need many times that
SMALL_OPTIONS: dict[str, int] = {WORKSPACE: 20_000}

# of a reduced system: minimum degree orders small ones best, nested dissection large ones, and
# scaling rows and columns once takes half the time of the iteration that is the default (measured
# from 6x2 to 32x32 elements)
REDUCED_OPTIONS: dict[str, int] = {"mat_mumps_icntl_7": 5, "mat_mumps_icntl_8": 4}
SMALL_REDUCED_OPTIONS: dict[str, int] = {"mat_mumps_icntl_7": 0}


def mumps_options(size: int, reduced: bool) -> dict[str, int]:
    """Options of MUMPS.

    Args:
        size: Number of unknowns.
        reduced: Whether the system is a reduced one.
    """
    small = size < SMALL_SYSTEM
    found = MUMPS_OPTIONS | (SMALL_OPTIONS if small else {})
    if reduced:
        found |= REDUCED_OPTIONS | (SMALL_REDUCED_OPTIONS if small else {})
    return found


def use_mumps(pc: PETSc.PC, kind: str, prefix: str, options: dict[str, int]) -> None:
    """Make a preconditioner a factorisation by MUMPS.

    Args:
        pc: The preconditioner.
        kind: Kind of the factorisation, of `PETSc.PC.Type`.
        prefix: PETSc options prefix, unique per system.
        options: Options of MUMPS.
    """
    database = PETSc.Options()
    for key, value in options.items():
        database[prefix + key] = value
    # a system that is never factorised uses none of them, which is no reason for a warning
    database["options_left"] = 0
    pc.setOptionsPrefix(prefix)
    pc.setType(kind)
    pc.setFactorSolverType("mumps")
    # the options stay: MUMPS reads them at each first factorisation of a structure, not here
    pc.setFromOptions()


# Three steps of 32x32 elements end in directors of direct solutions to 1e-13 and in velocities
# to 1e-12, with this tolerance as with a thousandth: the next iteration squares what is left
KRYLOV_TOLERANCE, KRYLOV_ITERATIONS = 1e-10, 15
# As factors age, iterations become more. With young ones a solution takes `YOUNG` of them, and they
# serve about one step; new ones pay before a single solution costs as much as they do
YOUNG, SOLUTIONS = 3.0, 3.0

# Cost of assembling and factorising in iterations with an old factorisation: of small systems
# between 6 and 10; of large ones it grows as the operations of the factorisation for each number of
# its factors do, which an iteration reads. At 32x32 elements steps take 4 % (EP) and 29 % (ED) less
# time than with the cost of small systems. An estimate and no measurement of each run, so that a
# run gives the same result each time
SMALL_COST, OPERATIONS = 8.0, 25.0


class DirectSolver:
    """MUMPS on one matrix, analysed once and factorised as often as it changes.

    Args:
        A: The matrix.
        prefix: PETSc options prefix, unique per system.
        reduced: Whether it is that of a reduced system.

    Attributes:
        factorisations: Their number so far.
        solutions: Number of solutions with factors so far, each Krylov iteration being one.
    """

    def __init__(self, A: PETSc.Mat, prefix: str, reduced: bool = False) -> None:
        ksp = PETSc.KSP().create(A.getComm())
        ksp.setOptionsPrefix(prefix)
        ksp.setType(PETSc.KSP.Type.PREONLY)
        options = mumps_options(A.getSize()[0], reduced)
        use_mumps(ksp.getPC(), PETSc.PC.Type.LU, prefix, options)
        ksp.setFromOptions()
        self.A, self._ksp = A, ksp
        self._paying, self._recycled = False, False
        self._work: float | None = None
        self.factorisations, self.solutions = 0, 0

    def factorise(self, once: bool = False) -> str | None:
        """Factorise the matrix as it is; returns why that failed, if it did.

        Args:
            once: Whether one system will be solved with it. Of a large matrix the factors of an
                earlier one are then kept as a preconditioner, as long as few iterations do.
        """
        self._recycled = once and self._paying and self.A.getSize()[0] >= SMALL_SYSTEM
        self._ksp.setOperators(self.A)
        self._ksp.getPC().setReusePreconditioner(self._recycled)
        self.factorisations += not self._recycled
        self._ksp.setUp()
        failure = self._failure()
        self._paying = failure is None
        if failure is None and self._work is None:
            self._work = self._operations()
        return failure

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
        if self._recycled:
            ksp = self._ksp
            # flexible GMRES solves with the factors once an iteration, and not once more at the end
            ksp.setType(PETSc.KSP.Type.FGMRES)
            ksp.setTolerances(rtol=KRYLOV_TOLERANCE, max_it=KRYLOV_ITERATIONS)
            ksp.solve(b, x)
            reached = ksp.getConvergedReason() > 0
            iterations = ksp.getIterationNumber()
            self.solutions += iterations
            self._paying = iterations <= YOUNG + self.cost / SOLUTIONS
            ksp.setType(PETSc.KSP.Type.PREONLY)
            if reached:
                return None
            failure = self.factorise()
            if failure is not None:
                return failure
        self._ksp.solve(b, x)
        self.solutions += 1
        return self._failure()

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


class Linear(Protocol):
    """Solves the linear systems of Newton's method.

    Attributes:
        size: Number of its unknowns.
        seconds: Time spent in each of its parts so far.
        jacobians: Number of Jacobians assembled so far.
        factorisations: Number of factorisations so far; of large matrices they last longer.
        cost: Cost of a new Jacobian and its factorisation, in iterations with an old one.
    """

    seconds: dict[str, float]
    jacobians: int

    @property
    def size(self) -> int: ...  # noqa: D102
    @property
    def factorisations(self) -> int: ...  # noqa: D102
    @property
    def cost(self) -> float: ...  # noqa: D102

    def factorise(self, once: bool = False) -> str | None:
        """Assemble and factorise at the state that the fields hold; returns why that failed.

        Args:
            once: Whether one system will be solved with it.
        """
        ...

    def solve(self, b: PETSc.Vec, dx: PETSc.Vec, fresh: bool) -> str | None:
        """Solve `J dx = b` with the last factorisation; returns why that failed.

        Args:
            b: Residual at the current state.
            dx: What is to be subtracted from the unknowns.
            fresh: Whether the factorisation belongs to the current state.
        """
        ...


class Unreduced:
    """All unknowns in one matrix, assembled by DOLFINx.

    Args:
        system: The block system.
        prefix: PETSc options prefix, unique per system.
    """

    def __init__(self, system: BlockSystem, prefix: str) -> None:
        self.system, self._prefix = system, prefix
        self.seconds = {"jacobian": 0.0, "reduction": 0.0, "factor": 0.0, "solve": 0.0}
        self.jacobians = 0
        self._solver: DirectSolver | None = None

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.system.size

    @property
    def factorisations(self) -> int:
        """Number of factorisations so far."""
        return 0 if self._solver is None else self._solver.factorisations

    @property
    def cost(self) -> float:
        """Cost of a new factorisation in iterations with an old one."""
        return SMALL_COST if self._solver is None else self._solver.cost

    def factorise(self, once: bool = False) -> str | None:
        """Assemble and factorise at the state that the fields hold."""
        system, start = self.system, time.perf_counter()
        system.jacobian(system.x, system.A)
        self.jacobians += 1
        self._solver = self._solver or DirectSolver(system.A, self._prefix)
        middle = time.perf_counter()
        failure = self._solver.factorise()
        self.seconds["jacobian"] += middle - start
        self.seconds["factor"] += time.perf_counter() - middle
        return failure

    def solve(self, b: PETSc.Vec, dx: PETSc.Vec, fresh: bool) -> str | None:
        """Solve with the last factorisation."""
        start = time.perf_counter()
        assert self._solver is not None
        failure = self._solver.solve(b, dx)
        self.seconds["solve"] += time.perf_counter() - start
        return failure
