"""What a factorisation costs, as the rule that keeps old ones is told, and options of users."""

from mpi4py import MPI  # noqa: F401 (before petsc4py)
from petsc4py import PETSc

import numpy as np
import pytest

from shellmb.system.direct.mumps import new_prefix
from shellmb.system.direct.solver import OPERATIONS, SMALL_COST, DirectSolver


@pytest.mark.parametrize("n", [30, 600, 1200])
def test_cost_is_that_of_operations_per_number(n: int) -> None:
    A = PETSc.Mat().createAIJ((n, n), nnz=n)
    A.setValues(range(n), range(n), np.eye(n) * n + 1.0)
    A.assemble()
    solver = DirectSolver(A, f"cost{n}_", np.ones(n))
    assert solver.cost == SMALL_COST
    assert solver.factorise() is None
    # a full matrix: n^2 numbers, 2/3 n^3 operations; of 30, less than what any factorisation costs
    assert solver.cost == pytest.approx(max(SMALL_COST, 2 / 3 * n / OPERATIONS), rel=0.02)


def test_users_set_options_of_mumps() -> None:
    """Block low-rank factors, as the documentation on large systems says."""
    A = PETSc.Mat().createAIJ((3, 3), nnz=3)
    A.setValues(range(3), range(3), np.eye(3))
    A.assemble()
    PETSc.Options()["shellmb_mumps_icntl_35"] = 2
    try:
        solver = DirectSolver(A, "chosen_")
        assert solver.factorise() is None
    finally:
        PETSc.Options().delValue("shellmb_mumps_icntl_35")
    assert solver._ksp.getPC().getFactorMatrix().getMumpsIcntl(35) == 2


def test_options_end_with_their_system() -> None:
    """What has the address of a system that is gone found its options before, its scaling too."""

    class Owner:
        pass

    owner, other = Owner(), Owner()
    first, second = new_prefix(owner), new_prefix(other)
    for prefix in (first, second):
        PETSc.Options()[f"{prefix}mat_mumps_icntl_8"] = 4
    del owner
    assert not PETSc.Options(first).getAll()
    assert PETSc.Options(second).getAll() == {"mat_mumps_icntl_8": "4"}
    assert new_prefix(other) not in (first, second)
