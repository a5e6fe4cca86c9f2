"""The bare work of a Newton iteration, each part timed alone at the current state."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median

from mpi4py import MPI

import numpy as np

from shellmb.accuracy.measuring import slowest
from shellmb.clock import now
from shellmb.simulate.problem import Problem
from shellmb.system.assembly.loops import FormLoop, LoopResiduals
from shellmb.system.assembly.meshgroups import mesh_groups
from shellmb.system.condensation.reduction import Reduction
from shellmb.system.direct.linear import Linear, Unreduced
from shellmb.system.direct.solver import DirectSolver, Purpose

# a part is timed until it has taken so long, but at least and at most so often
ENOUGH, FEWEST, MOST = 0.02, 3, 15


@dataclass(frozen=True)
class Bare:
    """Seconds of each part, alone.

    Args:
        residual: Kernels of all residuals over all cells.
        jacobian: Kernels of all blocks over all cells.
        factor: Factorisation.
        solve: Solution with it; with full Newton on large systems an iteration of Krylov's method.
    """

    residual: float
    jacobian: float
    factor: float
    solve: float

    def total(
        self, residuals: float, jacobians: float, factorisations: float, solutions: float
    ) -> float:
        """Time of so many of them."""
        return (
            residuals * self.residual
            + jacobians * self.jacobian
            + factorisations * self.factor
            + solutions * self.solve
        )


class BareWork:
    """Kernels of a problem with packed data, and its linear solver.

    The loops are those of the reduced path, for both paths: nothing assembles faster.

    Args:
        problem: The problem.
    """

    def __init__(self, problem: Problem) -> None:
        self._problem, system = problem, problem.system
        groups = mesh_groups(system)
        self._residuals = LoopResiduals(group.residuals for group in groups)
        self._local = np.zeros(len(system.numbering.local_to_global))
        self._loops = []
        for group in groups:
            cells = group.cells
            loop = FormLoop(cells, group.jacobians())
            loop.bind(cells)
            self._loops.append((loop, cells))

    def _kernels(self) -> None:
        for loop, cells in self._loops:
            # all of them, of which none is kept
            deque(loop.matrices(cells), maxlen=0)

    def measure(self) -> Bare:
        """Time each part."""
        self._residuals.refresh()
        for loop, _ in self._loops:
            loop.refresh()
        comm = self._problem.system.comm
        linear = self._problem.newton.iteration.linear
        solver = direct_solver(linear)
        x, b = solver.A.createVecs()
        b.set(1.0)

        def factorise() -> None:
            # PETSc would keep the factors of an unchanged matrix
            solver.A.stateIncrease()
            solver.factorise(Purpose.LAGGED)

        def solve() -> None:
            solver.solve(b, x)

        work = (lambda: self._residuals.add(self._local), self._kernels, factorise)
        residual, jacobian, factor = (_alone(comm, part) for part in work)
        # as in the run: where solutions are exact, Krylov's method is part of them
        solver.factorise(self._problem.iteration.refresh.purpose)
        solve()
        before = solver.solutions
        solve()
        each = solver.solutions - before
        return Bare(residual, jacobian, factor, _alone(comm, solve) / each)


def direct_solver(linear: Linear) -> DirectSolver:
    """Solver that factorises.

    Args:
        linear: The linear solution of a problem that has been solved once.
    """
    found = linear.solver if isinstance(linear, Unreduced) else None
    if isinstance(linear, Reduction):
        found = linear.solver
    assert found is not None
    return found


def _alone(comm: MPI.Comm, work: Callable[[], object]) -> float:
    """Median of its times; as many on each rank, some works being collective."""
    times: list[float] = []

    def once() -> None:
        begin = now()
        work()
        times.append(now() - begin)

    once()
    first = slowest(comm, times[0])
    for _ in range(min(MOST, max(FEWEST, int(ENOUGH / first))) - 1):
        once()
    return median(times)
