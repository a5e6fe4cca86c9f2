"""Newton's method with a convergence test per field; DOLFINx's solver, or PETSc's SNES.

Both hold the loop around `Iteration`.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from types import SimpleNamespace
from typing import Protocol
from weakref import proxy

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


def _own_linear(ksp: PETSc.KSP, iteration: Iteration) -> PETSc.Mat:
    """Make a Krylov solver call the iteration's linear solution; returns a matrix to satisfy it."""
    own, sizes = proxy(iteration), (iteration.system.numbering.owned, PETSc.DETERMINE)
    ksp.setType(PETSc.KSP.Type.PREONLY)
    ksp.getPC().setType(PETSc.PC.Type.PYTHON)
    apply = SimpleNamespace(apply=lambda pc, b, x: own.solve_linear(b, x))
    ksp.getPC().setPythonContext(apply)
    # what is assembled, and when, is up to the linear solution
    none = PETSc.Mat().createPython((sizes, sizes), object(), comm=iteration.system.comm)
    none.setUp()
    ksp.setOperators(none)
    return none


class LoopNewton:
    """Newton's method in the loop of DOLFINx's `NewtonSolver`.

    It keeps its callbacks for ever. What these would keep alive, and through it all meshes, of
    which MPI has room for some hundreds only, they know by proxies.

    Args:
        iteration: What it iterates.
    """

    def __init__(self, iteration: Iteration) -> None:
        self.iteration, self.system = iteration, iteration.system
        self._converged = False
        # it says at each call of its constructor that it is deprecated
        with silenced(2):
            self._solver = solver = cpp.nls.petsc.NewtonSolver(self.system.comm)
        own = proxy(self)
        solver.setF(lambda x, b: own.iteration.residual(x, b), self.system.b)
        self._matrix = _own_linear(solver.krylov_solver, iteration)
        solver.setJ(lambda x, A: None, self._matrix)
        solver.set_update(lambda solver, dx, x: own._update(dx, x))
        solver.set_convergence_check(lambda solver, dx: (1.0, own._converged))
        solver.convergence_criterion = "incremental"
        solver.max_it = iteration.settings.max_iterations
        solver.error_on_nonconvergence = False
        solver.report = False

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
        self._snes = snes = PETSc.SNES().create(self.system.comm)
        snes.setOptionsPrefix(iteration.prefix)
        own = proxy(self)
        self._matrix = _own_linear(snes.getKSP(), iteration)
        snes.setFunction(lambda snes, x, b: own.iteration.residual(x, b), self.system.b)
        snes.setJacobian(lambda snes, x, A, P: None, self._matrix)
        snes.setType(PETSc.SNES.Type.NEWTONLS)
        snes.getLineSearch().setType(PETSc.SNESLineSearch.Type.BASIC)
        snes.setConvergenceTest(lambda *args: own._test(*args))
        snes.setTolerances(max_it=iteration.settings.max_iterations)
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
