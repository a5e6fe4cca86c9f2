"""Newton's method with a convergence test per field; DOLFINx's solver, or PETSc's SNES.

Both hold the loop around `Iteration`. They are kept in this one module because DOLFINx's
`NewtonSolver` is deprecated.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from typing import Any, Protocol

from petsc4py import PETSc

from dolfinx import cpp, log  # type: ignore[attr-defined]

from shellmb.errors import ConvergenceError
from shellmb.system.newton.iteration import Iteration

# DOLFINx logs a warning where Newton fails; here that is an error with words of its own, or a
# smaller step
log.set_log_level(log.LogLevel.ERROR)  # type: ignore[attr-defined]


class Nonlinear(Protocol):
    """Solves a block system from the fields' current values.

    Attributes:
        iteration: What it iterates.
    """

    iteration: Iteration

    def solve(self, key: Hashable = None, full: bool = False) -> int:
        """Solve, leave the solution in the fields, return the number of iterations.

        Args:
            key: What tells whether an old factorisation may still be of use: the step size, say.
            full: Factorise in each iteration, whatever the settings.

        Raises:
            ConvergenceError: Names the field that did not converge.
        """
        ...


class Running[T]:
    """What callbacks work on while something is solved.

    Loops in C++ keep their callbacks for ever. What these would keep alive, and through it all
    meshes, of which MPI has room for some hundreds only, is here only while they are needed.

    Attributes:
        now: It.
    """

    now: T

    def __call__(self, now: T) -> Running[T]:
        """For a `with` statement.

        Args:
            now: What is solved.
        """
        self.now = now
        return self

    def __enter__(self) -> None:
        """It runs already."""

    def __exit__(self, *failure: object) -> None:
        """Nothing runs any more."""
        del self.now


class LinearShell:
    """The linear solution as PETSc calls it.

    Args:
        running: What is solved at the moment.
    """

    def __init__(self, running: Running[Any]) -> None:
        self._running = running

    def apply(self, pc: PETSc.PC, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """Solve."""
        self._running.now.iteration.solve_linear(b, x)


def _shell(ksp: PETSc.KSP, iteration: Iteration, running: Running[Any]) -> PETSc.Mat:
    """Make a Krylov solver call the iteration's linear solution; returns a matrix to satisfy it."""
    ksp.setType(PETSc.KSP.Type.PREONLY)
    pc = ksp.getPC()
    pc.setType(PETSc.PC.Type.PYTHON)
    pc.setPythonContext(LinearShell(running))
    owned = iteration.system.numbering.owned
    sizes = (owned, PETSc.DETERMINE)
    none = PETSc.Mat().createPython((sizes, sizes), object(), comm=iteration.system.comm)
    none.setUp()
    ksp.setOperators(none)
    return none


@contextmanager
def _silent_stderr() -> Iterator[None]:
    """Close stderr for a moment, also to C++: DOLFINx says there that its solver is deprecated."""
    sys.stderr.flush()
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    try:
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


class DolfinxNewton:
    """DOLFINx's `NewtonSolver` on a block system.

    Args:
        iteration: What it iterates.
    """

    def __init__(self, iteration: Iteration) -> None:
        self.iteration, self.system = iteration, iteration.system
        with _silent_stderr():
            solver = cpp.nls.petsc.NewtonSolver(self.system.comm)
        running = self._running = Running[DolfinxNewton]()
        self._converged = False
        solver.setF(lambda x, b: running.now.iteration.residual(x, b), self.system.b)
        self._matrix = _shell(solver.krylov_solver, iteration, running)
        # what is assembled, and when, is up to the linear solution
        solver.setJ(lambda x, A: None, self._matrix)
        solver.set_update(lambda solver, dx, x: running.now._update(dx, x))
        solver.set_convergence_check(lambda solver, dx: (1.0, running.now._converged))
        solver.convergence_criterion = "incremental"
        solver.max_it = iteration.settings.max_iterations
        solver.error_on_nonconvergence = False
        solver.report = False
        self._solver = solver

    def _update(self, dx: PETSc.Vec, x: PETSc.Vec) -> None:
        if self.iteration.failure is not None:
            raise self.iteration.failure
        x.axpy(-1.0, dx)
        # here and not in the check, which DOLFINx leaves out after the first iteration
        self._converged = self.iteration.converged(x, dx)

    def solve(self, key: Hashable = None, full: bool = False) -> int:
        """Solve from the fields' current values.

        Args:
            key: What tells whether an old factorisation may still be of use.
            full: Factorise in each iteration.

        Raises:
            ConvergenceError: Names the field that did not converge.
        """
        self.iteration.begin(key, full)
        if self.iteration.refresh.exact:
            # its loop would go round twice at least
            self.iteration.update()
            return 1
        self._converged = False
        with self._running(self):
            iterations, converged = self._solver.solve(self.system.x)
        if not converged:
            raise self.iteration.unfinished()
        return int(iterations)


class SnesNewton:
    """PETSc's SNES, the same iteration and tests.

    Args:
        iteration: What it iterates.
    """

    def __init__(self, iteration: Iteration) -> None:
        self.iteration, self.system = iteration, iteration.system
        snes = PETSc.SNES().create(self.system.comm)
        snes.setOptionsPrefix(iteration.prefix)
        running = self._running = Running[SnesNewton]()
        self._matrix = _shell(snes.getKSP(), iteration, running)
        snes.setFunction(lambda snes, x, b: running.now.iteration.residual(x, b), self.system.b)
        snes.setJacobian(lambda snes, x, A, P: None, self._matrix)
        snes.setType(PETSc.SNES.Type.NEWTONLS)
        snes.getLineSearch().setType(PETSc.SNESLineSearch.Type.BASIC)
        snes.setConvergenceTest(lambda *args: running.now._test(*args))
        snes.setTolerances(max_it=iteration.settings.max_iterations)
        self._snes = snes
        self._error: ConvergenceError | None = None

    def _test(
        self, snes: PETSc.SNES, it: int, norms: tuple[float, float, float]
    ) -> PETSc.SNES.ConvergedReason:
        reasons = PETSc.SNES.ConvergedReason
        if it == 0:
            return reasons.ITERATING
        self._error = self.iteration.failure
        if self._error is None:
            try:
                converged = self.iteration.converged(snes.getSolution(), snes.getSolutionUpdate())
                return reasons.CONVERGED_SNORM_RELATIVE if converged else reasons.ITERATING
            except ConvergenceError as error:
                self._error = error
        return reasons.DIVERGED_DTOL

    def solve(self, key: Hashable = None, full: bool = False) -> int:
        """Solve from the fields' current values.

        Args:
            key: What tells whether an old factorisation may still be of use.
            full: Factorise in each iteration.

        Raises:
            ConvergenceError: Names the field that did not converge.
        """
        self.iteration.begin(key, full)
        self._error = None
        with self._running(self):
            self._snes.solve(None, self.system.x)
        if self._snes.getConvergedReason() <= 0:
            raise self._error or self.iteration.unfinished()
        self.system.scatter(self.system.x)
        return int(self._snes.getIterationNumber())


NEWTON: dict[str, Callable[[Iteration], Nonlinear]] = {"newton": DolfinxNewton, "snes": SnesNewton}
