"""Factors of single precision, and when those of double precision take their place."""

from __future__ import annotations

from mpi4py import MPI  # noqa: F401 (before petsc4py)
from petsc4py import PETSc

import numpy as np
import pytest

from shellmb.system.direct import (
    KRYLOV_TOLERANCE,
    LAGGED_TOLERANCE,
    SMALL_SYSTEM,
    DirectSolver,
    Purpose,
)


def band(n: int, stencil: dict[int, float]) -> PETSc.Mat:
    """A matrix of constant diagonals."""
    A = PETSc.Mat().createAIJ((n, n), nnz=len(stencil))
    for row in range(n):
        for shift, value in stencil.items():
            if 0 <= row + shift < n:
                A.setValue(row, row + shift, value)
    A.assemble()
    return A


def error(solver: DirectSolver) -> float:
    """Residual of a solution, relative to the right-hand side."""
    x, b = solver.A.createVecs()
    b.array[:] = np.random.default_rng(0).standard_normal(b.getLocalSize())
    assert solver.solve(b, x) is None
    rest = b.duplicate()
    solver.A.mult(x, rest)
    rest.axpy(-1.0, b)
    return float(rest.norm() / b.norm())


# unsymmetric, and its condition is bounded whatever its size
FIRM = {-1: -1.0, 0: 2.5, 1: -1.2}


def test_single_precision_solves_as_exactly_as_asked() -> None:
    """Its own error is some 1e-7: two solutions leave its square."""
    solver = DirectSolver(band(SMALL_SYSTEM, FIRM), "firm_", reduced=True)
    assert solver.factorise(Purpose.ONE) is None
    for count in (2, 4):
        assert error(solver) < KRYLOV_TOLERANCE
        assert solver.solutions == count
    assert solver.single and solver.factorisations == 1


def test_lagged_iterations_need_one_solution_each() -> None:
    solver = DirectSolver(band(SMALL_SYSTEM, FIRM), "lagged_", reduced=True)
    assert solver.factorise(Purpose.LAGGED) is None
    for count in (1, 2):
        assert error(solver) < LAGGED_TOLERANCE
        assert solver.solutions == count
    assert solver.single and solver.factorisations == 1


def test_any_number_of_exact_solutions_takes_double_precision() -> None:
    solver = DirectSolver(band(SMALL_SYSTEM, FIRM), "exact_", reduced=True)
    assert solver.factorise(Purpose.LAGGED) is None and solver.single
    assert solver.factorise() is None and not solver.single
    assert error(solver) < 1e-14 and solver.solutions == 1


@pytest.mark.parametrize(
    ("n", "reduced"), [(SMALL_SYSTEM - 1, True), (SMALL_SYSTEM, False)], ids=["small", "unreduced"]
)
def test_others_are_factorised_in_double_precision(n: int, reduced: bool) -> None:
    solver = DirectSolver(band(n, FIRM), f"double{reduced}_", reduced=reduced)
    assert solver.factorise() is None
    # backward stable: some units of round-off
    assert not solver.single and error(solver) < 1e-14
    assert solver.solutions == 1


@pytest.mark.parametrize("purpose", [Purpose.ONE, Purpose.LAGGED])
def test_ill_conditioned_matrices_are_factorised_in_double_precision(purpose: Purpose) -> None:
    """A beam of many elements without inertia: its condition grows as n^4."""
    beam = {-2: 1.0, -1: -4.0, 0: 6.0, 1: -4.0, 2: 1.0}
    solver = DirectSolver(band(SMALL_SYSTEM, beam), f"beam_{purpose.name}_", reduced=True)
    double = DirectSolver(band(SMALL_SYSTEM, beam), f"double_{purpose.name}_", reduced=False)
    assert solver.factorise(purpose) is None and solver.single
    assert double.factorise() is None
    # orders of unknowns differ, and with them round-off
    assert error(solver) < 10 * error(double)
    assert not solver.single and solver.factorisations == 2
    # and stay so
    assert solver.factorise(purpose) is None
    assert not solver.single


def test_singular_matrices_are_named_as_before() -> None:
    A = band(SMALL_SYSTEM, FIRM)
    A.setOption(PETSc.Mat.Option.KEEP_NONZERO_PATTERN, True)
    A.zeroRows([7], diag=0.0)
    solver = DirectSolver(A, "singular_", reduced=True)
    reason = solver.factorise(Purpose.LAGGED)
    assert reason is not None and "the matrix is singular" in reason
    assert not solver.single


def test_factors_of_single_precision_serve_matrices_that_are_near() -> None:
    A = band(SMALL_SYSTEM, FIRM)
    solver = DirectSolver(A, "near_", reduced=True)
    assert solver.factorise(Purpose.ONE) is None
    error(solver)
    A.shift(1e-3)
    assert solver.factorise(Purpose.ONE) is None
    assert error(solver) < KRYLOV_TOLERANCE
    assert solver.factorisations == 1 and solver.single
    # one far from it needs its own
    A.scale(-1.0)
    A.shift(10.0)
    assert solver.factorise(Purpose.ONE) is None
    assert error(solver) < KRYLOV_TOLERANCE
    assert solver.factorisations == 2 and solver.single
