"""Direct solutions, as cheap as the system lets them be, and their failures in words."""

from collections.abc import Mapping
from enum import Enum
from typing import Any

from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Floats
from shellmb.native import library as native
from shellmb.system.direct.banded import BandedFactors
from shellmb.system.direct.mumps import (
    NO_OPTIONS,
    SMALL_SYSTEM,
    SYMMETRIC_OPTIONS,
    mumps_options,
    use_mumps,
)
from shellmb.system.direct.symmetry import asymmetry

# With factors of an earlier matrix flexible GMRES solves to this residual. Three steps of 32x32
# elements end in directors of direct solutions to 1e-13 and in velocities to 1e-12, with this
# tolerance as with a thousandth of it: the next iteration squares what is left
KRYLOV_TOLERANCE, KRYLOV_ITERATIONS = 1e-10, 15
# Where residuals are not this small after so many, iterations come to nothing, and new factors are
# the shorter way: half of the attempts of static plates, which took 20 % of their steps. What does
# get to the tolerance is below 1e-5 by then (32x32 and 64x64 elements)
HOPELESS, TRIED = 1e-3, 5

# Of small systems PETSc's own factors take half the time to make, and solutions with them a sixth:
# MUMPS is made for large ones (160 unknowns: 80 and 3 us in place of 250 and 21; 930: 2.0 ms and 39
# us in place of 2.2 ms and 91 to 125, beyond that it factorises faster). They are found without
# pivots, so that each is tried on a solution that is known: beyond this error, in the units of the
# unknowns, or where there is a zero on the way, as of multipliers of joints, MUMPS takes over
PLAIN_SYSTEM, PLAIN_ERROR = 1000, 1e-6

# What forces that follow a body add to one triangle only may be little beside its stiffness, and
# all that a soft mode feels: this times a condition of 1e9 is a contraction of 0.01. Round-off of
# plates is 1e-15 to 1e-12, of elements 16 to 100 times as long as thick
SYMMETRIC = 1e-11

# As factors age, iterations become more. With young ones a solution takes `YOUNG` of them, and they
# serve about one step; new ones pay before a single solution costs as much as they do
YOUNG, SOLUTIONS = 3.0, 3.0

# Cost of assembling and factorising in iterations with an old factorisation, for each form of the
# Jacobian for one of the residual: of small systems between 8 and 16; of large ones it grows as the
# operations of the factorisation for each number of its factors do, which an iteration reads. At
# 32x32 elements steps take 4 % (EP) and 29 % (ED) less time than with the cost of small systems. An
# estimate and no measurement of each run, so that a run gives the same result each time
SMALL_COST, OPERATIONS = 12.0, 25.0
# The same of factors in a band, and of as many unknowns as make it twice that: measured 1 of three
# links, 2.5 of a hundred (EP, EP4). Where steps take as long with it fewer iterations are better.
# On several ranks messages make an iteration as slow: with 12 a four-bar linkage (EP4) took 1.6
# times the iterations, small plates twice as many in as much time
BANDED_COST, BANDED_SIZE = 1.0, 1000.0


class Purpose(Enum):
    """Purpose of a factorisation."""

    EXACT = "any number of exact solutions"
    ONE = "one exact solution"
    LAGGED = "solutions for iterations that contract linearly in any case"


class Factors(Enum):
    """Maker of factors."""

    PLAIN = "PETSc, without pivots"
    BANDED = "our own, in a band"
    SYMMETRIC = "MUMPS, one triangle"
    DOUBLE = "MUMPS"


class DirectSolver:
    """Factors of one matrix, analysed once and made anew as often as it changes.

    Those of small reduced systems are PETSc's own where they need no pivots, or our own in a band
    (`banded`); all others are MUMPS's.
    A large reduced matrix that is symmetric, as in statics, is factorised as L D L^T, with half the
    operations and numbers, until the first one that is not.

    Args:
        A: The matrix.
        prefix: PETSc options prefix, unique per system.
        scales: Of a reduced system, sizes of the unknowns that this rank owns, by which errors are
            judged; None: it is not a reduced one.
        options: More options of MUMPS.
        values: Entries of a reduced matrix in one process, which it works with.

    Attributes:
        factors: Who makes them.
        matrix: They, where they are of PETSc.
        factorisations: Their number so far.
        solutions: Number of solutions with factors so far, each Krylov iteration being one.
    """

    matrix: PETSc.Mat | None

    def __init__(
        self,
        A: PETSc.Mat,
        prefix: str,
        scales: Floats | None = None,
        options: Mapping[str, int] = NO_OPTIONS,
        values: Floats | None = None,
    ) -> None:
        ksp = PETSc.KSP().create(A.getComm())
        ksp.setOptionsPrefix(prefix)
        ksp.setType(PETSc.KSP.Type.PREONLY)
        self.A, self._ksp, self._prefix = A, ksp, prefix
        reduced = scales is not None
        self._options = {**mumps_options(A.getSize()[0], reduced, A.comm.size), **options}
        self._large = A.getSize()[0] >= SMALL_SYSTEM
        self._values, self._band = values, list[BandedFactors]()
        plain = A.comm.size == 1 and A.getSize()[0] < PLAIN_SYSTEM
        self._use(Factors.SYMMETRIC if self._large and reduced else Factors.DOUBLE)
        if reduced and not self._large:
            self._use(Factors.PLAIN if plain else self._with_pivots())
        if self.factors is Factors.PLAIN:
            self._rest, self._change, self._scaled = (A.createVecRight() for _ in range(3))
            self._units = self._rest.duplicate()
            self._units.array[:] = 1.0 / np.asarray(scales)
        ksp.setConvergenceHistory(reset=True)
        ksp.addConvergenceTest(_hopeless)
        ksp.setFromOptions()
        # whether old factors pay, and whether those there are old
        self._paying, self._recycled = False, False
        self._work: float | None = None
        self.factorisations, self.solutions = 0, 0

    def _use(self, factors: Factors) -> None:
        """Choose who makes the factors to come."""
        # without one who has them the old ones are gone before new ones are made
        self.factors, self.matrix = factors, None
        if factors is Factors.BANDED:
            return
        pc = self._ksp.getPC()
        pc.reset()
        if factors is Factors.PLAIN:
            pc.setType(PETSc.PC.Type.LU)
            pc.setFactorSolverType("petsc")
            pc.setFactorOrdering(PETSc.Mat.OrderingType.QMD)
            return
        symmetric = factors is Factors.SYMMETRIC
        kind = PETSc.PC.Type.CHOLESKY if symmetric else PETSc.PC.Type.LU
        more = SYMMETRIC_OPTIONS if symmetric else NO_OPTIONS
        use_mumps(pc, kind, self._prefix, {**self._options, **more})

    def forget(self, factors: Factors) -> None:
        """Make factors anew with the next matrix, none of which is taken from an earlier one.

        Args:
            factors: Who makes them.
        """
        self._paying = False
        if self.factors is not factors:
            self._use(factors)

    def factorise(self, purpose: Purpose = Purpose.EXACT) -> str | None:
        """Factorise the matrix as it is; returns why that failed, if it did.

        Args:
            purpose: What for. For one exact solution of a large system factors of an earlier matrix
                are kept as a preconditioner, as long as few iterations do.
        """
        if self._band:
            # a matrix that has no such factors is no reason to do without those of the next one
            self.factors = Factors.BANDED
        if purpose is Purpose.EXACT and self.factors is Factors.PLAIN:
            # without pivots they are only as exact as `PLAIN_ERROR`
            self._use(Factors.DOUBLE)
        recycled = purpose is Purpose.ONE and self._paying and self._large
        return self._factorise(recycled)

    def _with_pivots(self) -> Factors:
        """Factors of a small matrix that needs pivots."""
        if self._values is not None:
            band = BandedFactors(self.A, self._values)
            if band.pays:
                self._band.append(band)
                return Factors.BANDED
        return Factors.DOUBLE

    def _factorise(self, recycled: bool) -> str | None:
        if self.factors is Factors.BANDED:
            self._recycled = False
            self.factorisations += 1
            if self._band[0].factorise():
                return None
            # MUMPS has other pivots, and a reason
            self._use(Factors.DOUBLE)
        if self.factors is Factors.SYMMETRIC and not recycled and asymmetry(self.A) > SYMMETRIC:
            self._use(Factors.DOUBLE)
        self._recycled = recycled
        self._ksp.setOperators(self.A)
        self._ksp.getPC().setReusePreconditioner(recycled)
        self.factorisations += not recycled
        self._ksp.setUp()
        failure = self._failure()
        plain = self.factors is Factors.PLAIN
        unsound = failure is not None or (plain and not self._sound())
        if unsound and self.factors is not Factors.DOUBLE:
            self._use(self._with_pivots())
            return self._factorise(recycled=False)
        self._paying = failure is None
        if failure is None:
            self.matrix = self._ksp.getPC().getFactorMatrix()
            if self._work is None and not plain:
                self._work = self._operations()
        return failure

    def _sound(self) -> bool:
        """Decide whether factors without pivots give a known solution back."""
        known, found = self._rest, self._change
        known.array[:] = np.random.default_rng(0).uniform(0.5, 1.5, known.getLocalSize())
        known.pointwiseDivide(known, self._units)
        self.A.mult(known, self._scaled)
        self._ksp.solve(self._scaled, found)
        found.axpy(-1.0, known)
        return self._size(found) <= PLAIN_ERROR * self._size(known)

    @property
    def direct(self) -> bool:
        """Decide whether a solution is nothing but one with the factors."""
        return not self._recycled

    @property
    def many(self) -> bool:
        """Decide whether solutions with several right-hand sides are cheaper than one by one."""
        return self.direct and self._large and self.factors is not Factors.BANDED

    @property
    def cost(self) -> float:
        """Cost of assembling and factorising, in iterations with an old factorisation."""
        quick = self.factors is Factors.BANDED or self.A.comm.size > 1
        small = BANDED_COST * (1 + self.A.getSize()[0] / BANDED_SIZE) if quick else SMALL_COST
        return max(min(small, SMALL_COST), (self._work or 0.0) / OPERATIONS)

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
            if self._iterate(b, x):
                return None
            failure = self._factorise(recycled=False)
            if failure is not None:
                return failure
            # the next matrix will be as far from this one
            self._paying = False
        self._direct(b, x)
        return None if self.factors is Factors.BANDED else self._failure()

    def solve_many(self, B: PETSc.Mat, X: PETSc.Mat) -> None:
        """Solve for the columns of a dense matrix, which reads the factors once; see `many`."""
        assert self.matrix is not None
        self.matrix.matSolve(B, X)
        self.solutions += B.getSize()[1]

    def solve_transposed(self, b: PETSc.Vec, x: PETSc.Vec) -> str | None:
        """Solve with the transposed matrix, as exactly as factors are; returns why that failed."""
        self.solutions += 1
        if self.factors is Factors.BANDED:
            self._band[0].solve(b, x, transposed=True)
            return None
        self._ksp.solveTranspose(b, x)
        return self._failure()

    def _direct(self, b: PETSc.Vec, x: PETSc.Vec) -> None:
        if self.factors is Factors.BANDED:
            self._band[0].solve(b, x)
        else:
            self._ksp.solve(b, x)
        self.solutions += 1

    @property
    def made(self) -> tuple[int, Any]:
        """Address of PETSc's factors, or 0, and for C factors in a band, or NULL."""
        if self.factors is Factors.BANDED:
            return 0, self._band[0].struct
        assert self.matrix is not None
        return self.matrix.handle, native.doubles(None)

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
        if not np.isfinite(self.A.norm()):
            return (
                "the stiffness is no finite number: a law, a potential or a function of the scene "
                "gives nan or inf here, or has no derivative"
            )
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


def _hopeless(ksp: PETSc.KSP, iteration: int, norm: float) -> PETSc.KSP.ConvergedReason:
    """Ends Krylov iterations that come to nothing."""
    reasons = PETSc.KSP.ConvergedReason
    if iteration < TRIED or norm <= HOPELESS * ksp.getConvergenceHistory()[0]:
        return reasons.ITERATING
    return reasons.DIVERGED_DTOL
