"""Factors of single precision or without pivots, and when MUMPS's own take their place."""

from __future__ import annotations

from dataclasses import replace

from mpi4py import MPI  # noqa: F401 (before petsc4py)
from petsc4py import PETSc

import numpy as np
import pytest

from shellmb.arrays import Floats
from shellmb.demos import sudden_load
from shellmb.simulate.simulation import Simulation
from shellmb.system.direct.solver import (
    CONTRACTION,
    KRYLOV_TOLERANCE,
    PLAIN_SYSTEM,
    REFINED_TOLERANCE,
    REFINEMENTS,
    SMALL_SYSTEM,
    TRIED,
    DirectSolver,
    Factors,
    Purpose,
)
from tests.system.conftest import BEAM, FIRM, ONES, band, error


@pytest.mark.parametrize(
    ("purpose", "bound", "counts"),
    [
        # an error of some 1e-7: two solutions leave its square
        (Purpose.ONE, REFINED_TOLERANCE, (2, 4)),
        # one solution each, and the first time another, to see whether that is enough
        (Purpose.LAGGED, CONTRACTION, (2, 3)),
    ],
)
def test_single_precision_solves_as_exactly_as_asked(
    purpose: Purpose, bound: float, counts: tuple[int, int]
) -> None:
    solver = DirectSolver(band(SMALL_SYSTEM, FIRM), f"firm_{purpose.name}_", ONES)
    assert solver.factorise(purpose) is None
    for count in counts:
        assert error(solver) < bound
        assert solver.solutions == count
    assert solver.single and solver.factorisations == 1


def test_any_number_of_exact_solutions_takes_double_precision() -> None:
    solver = DirectSolver(band(SMALL_SYSTEM, FIRM), "exact_", ONES)
    assert solver.factorise(Purpose.LAGGED) is None and solver.single
    assert solver.factorise() is None and not solver.single
    assert error(solver) < 1e-14 and solver.solutions == 1


@pytest.mark.parametrize(
    ("n", "scales"),
    [(SMALL_SYSTEM - 1, ONES[1:]), (SMALL_SYSTEM, None)],
    ids=["small", "unreduced"],
)
def test_others_are_factorised_in_double_precision(n: int, scales: Floats | None) -> None:
    solver = DirectSolver(band(n, FIRM), f"double{n}_", scales)
    # a purpose that single precision serves
    assert solver.factorise(Purpose.LAGGED) is None
    # backward stable: some units of round-off
    assert not solver.single and error(solver) < 1e-14
    assert solver.solutions == 1


@pytest.mark.parametrize("purpose", [Purpose.ONE, Purpose.LAGGED])
def test_ill_conditioned_matrices_are_factorised_in_double_precision(purpose: Purpose) -> None:
    solver = DirectSolver(band(SMALL_SYSTEM, BEAM), f"beam_{purpose.name}_", ONES)
    double = DirectSolver(band(SMALL_SYSTEM, BEAM), f"double_{purpose.name}_")
    assert solver.factorise(purpose) is None and solver.single
    assert double.factorise() is None
    # orders of unknowns differ, and with them round-off
    assert error(solver) < 10 * error(double)
    assert not solver.single and solver.factorisations == 2
    # and stay so
    assert solver.factorise(purpose) is None
    assert not solver.single


@pytest.mark.parametrize("purpose", [Purpose.ONE, Purpose.LAGGED])
def test_soft_modes_count_whatever_their_forces_and_units(purpose: Purpose) -> None:
    """A beam beside something firm, its forces a millionth of the others': residuals hide it.

    The firm unknowns are in units in which they are a million. Where nothing says so, lagged
    solutions are not what they should be.
    """
    soft = 200
    A = band(SMALL_SYSTEM, FIRM)
    A.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)
    rows = range(soft)
    A.zeroRows([*rows, soft], diag=2.5)
    beam = band(soft, BEAM)
    A.setValues(rows, rows, beam.getValues(rows, rows))
    A.assemble()
    x, b = A.createVecs()
    b.array[:] = 1e6
    b.array[:soft] = 1e-7
    exact = np.linalg.solve(beam.getValues(rows, rows), np.full(soft, 1e-7))
    for firm, sees in [(1e6, True), (1.0, False)][: 2 if purpose is Purpose.LAGGED else 1]:
        solver = DirectSolver(A, f"soft{firm}{purpose.name}_", np.where(b.array_r > 1, firm, 1.0))
        assert solver.factorise(purpose) is None
        assert solver.solve(b, x) is None
        assert solver.single is not sees
        found = np.abs(x.array_r[:soft] - exact).max() / exact.max()
        # round-off times the condition, 3e8, in double and in single precision
        assert found < 1e-6 if sees else found > 1e-3


def test_singular_matrices_are_named_as_before() -> None:
    A = band(SMALL_SYSTEM, FIRM)
    A.setOption(PETSc.Mat.Option.KEEP_NONZERO_PATTERN, True)
    A.zeroRows([7], diag=0.0)
    solver = DirectSolver(A, "singular_", ONES)
    reason = solver.factorise(Purpose.LAGGED)
    assert reason is not None and "the matrix is singular" in reason
    assert not solver.single


def test_factors_of_single_precision_serve_matrices_that_are_near() -> None:
    A = band(SMALL_SYSTEM, FIRM)
    solver = DirectSolver(A, "near_", ONES)
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
    # those tried, and refinement with factors of its own
    assert solver.solutions - before <= TRIED + REFINEMENTS


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
