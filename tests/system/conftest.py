"""Matrices whose solutions and conditions are known, and the error of a solution."""

from __future__ import annotations

from mpi4py import MPI  # noqa: F401 (before petsc4py)
from petsc4py import PETSc

import numpy as np

from shellmb.system.direct.solver import SMALL_SYSTEM, DirectSolver


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
ONES = np.ones(SMALL_SYSTEM)
# a beam without inertia: its condition grows as n^4
BEAM = {-2: 1.0, -1: -4.0, 0: 6.0, 1: -4.0, 2: 1.0}
