"""Factors without pivots or of earlier matrices, and when new ones of MUMPS take their place."""

from __future__ import annotations

from dataclasses import replace

from mpi4py import MPI  # noqa: F401 (before petsc4py)
from petsc4py import PETSc

import numpy as np
import pytest

from shellmb.demos import sudden_load
from shellmb.simulate.simulation import Simulation
from shellmb.system.direct.solver import (
    KRYLOV_TOLERANCE,
    PLAIN_SYSTEM,
    SMALL_SYSTEM,
    TRIED,
    DirectSolver,
    Factors,
    Purpose,
)
from tests.system.conftest import BEAM, FIRM, ONES, band, error


@pytest.mark.parametrize("purpose", [Purpose.ONE, Purpose.LAGGED])
def test_ill_conditioned_matrices_are_solved_as_exactly(purpose: Purpose) -> None:
    solver = DirectSolver(band(SMALL_SYSTEM, BEAM), f"beam_{purpose.name}_", ONES)
    double = DirectSolver(band(SMALL_SYSTEM, BEAM), f"double_{purpose.name}_")
    assert solver.factorise(purpose) is None and solver.factors is Factors.SYMMETRIC
    assert double.factorise() is None
    # orders of unknowns differ, and with them round-off
    assert error(solver) < 10 * error(double)
    assert solver.factorisations == 1


def test_singular_matrices_are_named_as_before() -> None:
    A = band(SMALL_SYSTEM, FIRM)
    A.setOption(PETSc.Mat.Option.KEEP_NONZERO_PATTERN, True)
    A.zeroRows([7], diag=0.0)
    solver = DirectSolver(A, "singular_", ONES)
    reason = solver.factorise(Purpose.LAGGED)
    assert reason is not None and "the matrix is singular" in reason


def test_factors_serve_matrices_that_are_near() -> None:
    A = band(SMALL_SYSTEM, FIRM)
    solver = DirectSolver(A, "near_", ONES)
    assert solver.factorise(Purpose.ONE) is None
    error(solver)
    A.shift(1e-3)
    assert solver.factorise(Purpose.ONE) is None
    assert error(solver) < KRYLOV_TOLERANCE
    assert solver.factorisations == 1
    # one far from it needs its own
    A.scale(-1.0)
    A.shift(10.0)
    assert solver.factorise(Purpose.ONE) is None
    assert error(solver) < KRYLOV_TOLERANCE
    assert solver.factorisations == 2


def test_factors_of_another_matrix_are_soon_given_up() -> None:
    A = band(SMALL_SYSTEM, FIRM)
    solver = DirectSolver(A, "other_", ONES)
    assert solver.factorise(Purpose.ONE) is None
    error(solver)
    scale = A.createVecRight()
    scale.array[:] = np.random.default_rng(2).uniform(-1.0, 1.0, SMALL_SYSTEM)
    A.diagonalScale(scale)
    before = solver.solutions
    assert solver.factorise(Purpose.ONE) is None
    assert error(solver) < KRYLOV_TOLERANCE
    assert solver.factorisations == 2
    # those tried, and one with factors of its own
    assert solver.solutions - before <= TRIED + 1


# both purposes of Newton's method
@pytest.mark.parametrize("purpose", [Purpose.ONE, Purpose.LAGGED])
def test_small_systems_need_no_mumps(purpose: Purpose) -> None:
    solver = DirectSolver(
        band(PLAIN_SYSTEM - 1, FIRM), f"plain_{purpose.name}_", ONES[: PLAIN_SYSTEM - 1]
    )
    for count in (1, 2):
        assert solver.factorise(purpose) is None and solver.factors is Factors.PLAIN
        # round-off: no pivot of this matrix is small
        assert error(solver) < 1e-14
        assert solver.solutions == solver.factorisations == count
    assert solver.factorise(Purpose.EXACT) is None and solver.factors is Factors.DOUBLE


@pytest.mark.parametrize("first", [0.0, 1e-13], ids=["zero", "tiny"])
def test_what_needs_pivots_gets_them(first: float) -> None:
    """A zero first pivot stops factors without pivots; next to one they have no digits left."""
    A = band(30, FIRM)
    A.setValue(0, 0, first)
    A.assemble()
    solver = DirectSolver(A, f"pivots{first}_", ONES[:30])
    assert solver.factorise(Purpose.LAGGED) is None and solver.factors is Factors.DOUBLE
    assert error(solver) < 1e-13
    # and goes on with them
    A.shift(1.0)
    assert solver.factorise(Purpose.LAGGED) is None and solver.factors is Factors.DOUBLE


def test_small_singular_matrices_are_named_as_before() -> None:
    A = band(30, FIRM)
    A.setOption(PETSc.Mat.Option.KEEP_NONZERO_PATTERN, True)
    A.zeroRows([7], diag=0.0)
    reason = DirectSolver(A, "small_singular_", ONES[:30]).factorise(Purpose.LAGGED)
    assert reason is not None and "the matrix is singular" in reason


@pytest.mark.parametrize(
    ("scheme", "alpha"), [("ep", None), ("ed", 0.0), ("ep4", 0.0), ("ed3", 0.5)]
)
def test_thin_plates_need_no_pivots_with_long_steps(scheme: str, alpha: float | None) -> None:
    """Quadratic in time, diagonals would be 1e-10 of their rows if equations kept their order."""
    more = {} if alpha is None else {"alpha": alpha}
    base = sudden_load.scene(dt=2e-2, t_end=0.1)
    simulation = Simulation(replace(base, scheme=scheme, **more))
    for _ in range(5):
        simulation.advance()
    assert simulation.problem.iteration.linear.solver.factors is Factors.PLAIN
