"""Newton's method with a convergence test per field; DOLFINx's solver, or PETSc's SNES.

Both hold the loop around `Iteration`. DOLFINx's `NewtonSolver` is deprecated: where it is gone,
the same loop is in this module.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any, Protocol

from petsc4py import PETSc

from dolfinx import cpp, log  # type: ignore[attr-defined]

from shellmb.errors import ConvergenceError
from shellmb.guarding import silenced
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.direct.mumps import new_prefix
from shellmb.system.newton.iteration import Iteration, MakeLinear, NewtonSettings

# DOLFINx logs a warning where Newton fails; here that is an error with words of its own, or a
# smaller step
log.set_log_level(log.LogLevel.ERROR)  # type: ignore[attr-defined]


class Nonlinear(Protocol):
    """Solves a block system.

    Attributes:
        iteration: What it iterates.
    """

    iteration: Iteration

    def solve(
        self, key: Hashable = None, full: bool = False, guess: PETSc.Vec | None = None
    ) -> int:
        """Solve, leave the solution in the fields, return the number of iterations.

        Args:
            key: What tells whether an old factorisation may still be of use: the step size, say.
            full: Factorise in each iteration, whatever the settings.
            guess: Unknowns to begin with, but for given ones; None: those that the fields hold.

        Raises:
            ConvergenceError: Names the field that did not converge.
        """
        ...


class Running[T]:
    """State that callbacks work on while something is solved.

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
        """Nothing to do: `now` is set."""

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


class LoopNewton:
    """The loop of DOLFINx's `NewtonSolver`: DOLFINx's own or, where that is gone, `_loop`.

    Args:
        iteration: What it iterates.
    """

    def __init__(self, iteration: Iteration) -> None:
        self.iteration, self.system = iteration, iteration.system
        self._converged = False
        self._solve = self._dolfinx() if has_newton_solver() else self._loop
        self._dx = self.system.x.duplicate()

    def _dolfinx(self) -> Callable[[PETSc.Vec], tuple[int, bool]]:
        """DOLFINx's solver, which says at each call of its constructor that it is deprecated."""
        with silenced(2):
            solver = cpp.nls.petsc.NewtonSolver(self.system.comm)
        running = self._running = Running[LoopNewton]()
        solver.setF(lambda x, b: running.now.iteration.residual(x, b), self.system.b)
        self._matrix = _shell(solver.krylov_solver, self.iteration, running)
        # what is assembled, and when, is up to the linear solution
        solver.setJ(lambda x, A: None, self._matrix)
        solver.set_update(lambda solver, dx, x: running.now._update(dx, x))
        solver.set_convergence_check(lambda solver, dx: (1.0, running.now._converged))
        solver.convergence_criterion = "incremental"
        solver.max_it = self.iteration.settings.max_iterations
        solver.error_on_nonconvergence = False
        solver.report = False

        def solve(x: PETSc.Vec) -> tuple[int, bool]:
            with running(self):
                return solver.solve(x)

        return solve

    def _loop(self, x: PETSc.Vec) -> tuple[int, bool]:
        """Do what DOLFINx's solver does: number of iterations, and whether they converged."""
        iteration, b, dx = self.iteration, self.system.b, self._dx
        iteration.residual(x, b)
        for k in range(iteration.settings.max_iterations):
            iteration.solve_linear(b, dx)
            self._update(dx, x)
            iteration.residual(x, b)
            # the first update is always followed by another
            if k > 0 and self._converged:
                return k + 1, True
        return iteration.settings.max_iterations, False

    def _update(self, dx: PETSc.Vec, x: PETSc.Vec) -> None:
        if self.iteration.failure is not None:
            raise self.iteration.failure
        x.axpy(-1.0, dx)
        # here and not in the check, which DOLFINx leaves out after the first iteration
        self._converged = self.iteration.converged(x, dx)

    def solve(
        self, key: Hashable = None, full: bool = False, guess: PETSc.Vec | None = None
    ) -> int:
        """Solve; arguments as of `Nonlinear`.

        Raises:
            ConvergenceError: Names the field that did not converge.
        """
        self.iteration.begin(key, full, guess)
        if self.iteration.refresh.exact:
            # its loop would go round twice at least
            self.iteration.update()
            return 1
        self._converged = False
        iterations, converged = self._solve(self.system.x)
        if not converged:
            raise self.iteration.unfinished()
        return int(iterations)


def has_newton_solver() -> bool:
    """Look for DOLFINx's `NewtonSolver`, which its main branch lacks since August 2026."""
    return hasattr(getattr(getattr(cpp, "nls", None), "petsc", None), "NewtonSolver")


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

    def solve(
        self, key: Hashable = None, full: bool = False, guess: PETSc.Vec | None = None
    ) -> int:
        """Solve; arguments as of `Nonlinear`.

        Raises:
            ConvergenceError: Names the field that did not converge.
        """
        self.iteration.begin(key, full, guess)
        self._error = None
        with self._running(self):
            self._snes.solve(None, self.system.x)
        if self._snes.getConvergedReason() <= 0:
            raise self._error or self.iteration.unfinished()
        self.system.scatter(self.system.x)
        return int(self._snes.getIterationNumber())


NEWTON: dict[str, Callable[[Iteration], Nonlinear]] = {"newton": LoopNewton, "snes": SnesNewton}


def newton_alone(
    owner: object, system: BlockSystem, iterations: int, linear: MakeLinear | None = None
) -> Nonlinear:
    """DOLFINx's solver for a system that is not that of the steps.

    Args:
        owner: Who has it.
        system: The system.
        iterations: At most so many.
        linear: As of `Iteration`.
    """
    settings = NewtonSettings(1e-9, iterations)
    return NEWTON["newton"](Iteration(system, settings, new_prefix(owner), linear))
