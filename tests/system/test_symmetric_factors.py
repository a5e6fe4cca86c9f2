"""Symmetric matrices of large systems are factorised from one triangle, and only those."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI  # noqa: F401 (before petsc4py)
from petsc4py import PETSc

import numpy as np
import pytest

from shellmb.system.direct.solver import SMALL_SYSTEM, DirectSolver, Factors, Purpose
from shellmb.system.direct.symmetry import asymmetry
from tests.system.conftest import FIRM, ONES, band, error

# sums of random numbers, in units of the last place of their largest: up to 4 were seen
ROUND_OFF = 50 * np.finfo(float).eps
EVEN = {-1: -1.0, 0: 2.5, 1: -1.0}


def changed(A: PETSc.Mat, row: int, column: int, value: float) -> PETSc.Mat:
    A.setValue(row, column, value)
    A.assemble()
    return A


def test_one_entry_is_seen() -> None:
    """What two vectors at random see is as large as the difference, give or take a factor."""
    A = band(SMALL_SYSTEM, EVEN)
    assert asymmetry(A) < ROUND_OFF
    change = 1e-8
    changed(A, 70, 71, -1.0 - change)
    # diagonals being one: 2 entries of that matrix, against some 5000 of 1 and twice as many of 0.4
    exact = np.sqrt(2) * change / 2.5 / np.sqrt(SMALL_SYSTEM * (1 + 2 * 0.4**2))
    assert 0.1 * exact < asymmetry(A) < 10 * exact


def test_soft_parts_count_beside_firm_ones() -> None:
    """A load that follows a part of a millionth of the stiffness."""
    A = band(SMALL_SYSTEM, EVEN)
    scale, _ = A.createVecs()
    scale.array[:] = np.where(np.arange(SMALL_SYSTEM) < 100, 1e-3, 1.0)
    A.diagonalScale(scale, scale)
    firm = asymmetry(A)
    changed(A, 70, 71, -1e-6 * (1 + 1e-8))
    assert firm < ROUND_OFF and asymmetry(A) > 1e-12


def test_matrices_without_diagonal_have_an_answer() -> None:
    A = band(4, {-1: 1.0, 1: 1.0})
    # sums of the same products in another order
    assert asymmetry(A) < ROUND_OFF
    assert asymmetry(changed(A, 0, 1, 2.0)) > 1e-3
    A.zeroEntries()
    assert asymmetry(A) == 0.0


def test_one_triangle_is_enough_until_a_matrix_is_not_symmetric() -> None:
    A = band(SMALL_SYSTEM, EVEN)
    solver = DirectSolver(A, "even_", ONES)
    assert solver.factorise(Purpose.EXACT) is None and solver.factors is Factors.SYMMETRIC
    # round-off
    assert error(solver) < 1e-14
    changed(A, 70, 71, -1.5)
    assert solver.factorise(Purpose.LAGGED) is None and solver.factors is Factors.DOUBLE
    assert error(solver) < 1e-14
    # with the options of both triangles: scaled once, of full rank
    assert [solver.matrix.getMumpsIcntl(k) for k in (8, 35)] == [4, 0]
    # forces that follow will do so again
    changed(A, 70, 71, -1.0)
    assert solver.factorise(Purpose.EXACT) is None and solver.factors is Factors.DOUBLE
    assert error(solver) < 1e-14
    # nobody has the old factors while others are made: both at once take three times the memory
    solver.forget(Factors.SYMMETRIC)
    assert solver.matrix is None


@pytest.mark.parametrize(
    ("n", "stencil", "scales"),
    [
        (SMALL_SYSTEM - 1, EVEN, ONES[1:]),
        (SMALL_SYSTEM, EVEN, None),
        (SMALL_SYSTEM, FIRM, ONES),
    ],
    ids=["small", "unreduced", "unsymmetric"],
)
def test_others_need_both(n: int, stencil: dict[int, float], scales: Any) -> None:
    solver = DirectSolver(band(n, stencil), f"both{n}_", scales)
    assert solver.factorise() is None and solver.factors is Factors.DOUBLE
    assert error(solver) < 1e-14


def test_saddle_points() -> None:
    """Multipliers, here of every tenth unknown, have no diagonal and change the inertia."""
    A = band(SMALL_SYSTEM, EVEN)
    for row in range(5, SMALL_SYSTEM, 10):
        A.setValue(row, row, 0.0)
    A.assemble()
    solver = DirectSolver(A, "saddle_", ONES)
    assert solver.factorise() is None and solver.factors is Factors.SYMMETRIC
    assert error(solver) < 1e-13


def test_singular_matrices_are_named_as_of_both() -> None:
    A = band(SMALL_SYSTEM, EVEN)
    for column in (6, 7, 8):
        A.setValue(7, column, 0.0)
        A.setValue(column, 7, 0.0)
    A.assemble()
    reason = DirectSolver(A, "singular_even_", ONES).factorise()
    assert reason is not None and "the matrix is singular" in reason


PROGRAM = """
from mpi4py import MPI
from petsc4py import PETSc
import numpy as np
from shellmb.system.direct.solver import SMALL_SYSTEM, DirectSolver, Factors

n = SMALL_SYSTEM
A = PETSc.Mat().createAIJ((n, n), nnz=3, comm=MPI.COMM_WORLD)
for row in range(*A.getOwnershipRange()):
    for column, value in ((row - 1, -1.0), (row, 2.5), (row + 1, -1.0)):
        if 0 <= column < n:
            A.setValue(row, column, value)
A.assemble()
solver = DirectSolver(A, "ranks_", np.ones(A.getLocalSize()[0]))
x, b = A.createVecs()
rest = b.duplicate()
for factors, value in ((Factors.SYMMETRIC, -1.0), (Factors.DOUBLE, -1.5)):
    # an entry that the second rank sees only by what it makes of a product
    A.setValue(0, 1, value) if A.comm.rank == 0 else None
    A.assemble()
    assert solver.factorise() is None and solver.factors is factors, solver.factors
    b.set(1.0)
    assert solver.solve(b, x) is None
    A.mult(x, rest)
    rest.axpy(-1.0, b)
    assert rest.norm() < 1e-13 * b.norm(), rest.norm()
"""


@pytest.mark.mpi
def test_all_ranks_come_to_the_same_conclusion(mpirun: Any) -> None:
    mpirun(2, "-c", PROGRAM)
