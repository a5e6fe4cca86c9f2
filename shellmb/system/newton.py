"""Newton's method with a convergence test per field; DOLFINx's solver, or PETSc's SNES.

Both solvers share `Convergence`. It is kept in this one module because DOLFINx's `NewtonSolver` is
deprecated.
"""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Protocol
from weakref import WeakMethod

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
from dolfinx import cpp, log  # type: ignore[attr-defined]

from shellmb.errors import ConvergenceError
from shellmb.system import linear
from shellmb.system.assembly import BlockSystem

# DOLFINx logs a warning where Newton fails; here that is an error with words of its own, or a
# smaller step
log.set_log_level(log.LogLevel.ERROR)  # type: ignore[attr-defined]


@dataclass(frozen=True)
class NewtonSettings:
    """Settings of the iteration.

    Args:
        tolerance: Largest update of each part relative to its scale at which the iteration ends.
        The
            error left behind is of the square of it, convergence being quadratic.
        max_iterations: Iterations after which the step counts as failed.
    """

    tolerance: float = 1e-8
    max_iterations: int = 20


@dataclass(frozen=True)
class PartNorm:
    """Size of an update of one part.

    Args:
        name: Name of the part.
        update: Relative to the part's scale or its own size, whichever is larger.
        bounded: Whether it is small enough for the iteration to go on.
        advice: What to try if it does not converge.
    """

    name: str
    update: float
    bounded: bool
    advice: str


class Convergence:
    """Judges an update part by part.

    Args:
        system: The block system.
        settings: Tolerances.
    """

    def __init__(self, system: BlockSystem, settings: NewtonSettings) -> None:
        self.system, self.settings = system, settings
        self.history: list[tuple[PartNorm, ...]] = []

    def measure(self, x: PETSc.Vec, dx: PETSc.Vec) -> tuple[PartNorm, ...]:
        """Largest relative update of each part, the same on every rank."""
        system = self.system
        update, value = system.local_values(dx), system.local_values(x)
        local = []
        for k, field in enumerate(system.fields):
            part = system.numbering.slice(k)
            du, u = np.abs(update[part]), np.abs(value[part])
            for p in field.parts:
                local.append((_max(du[p.dofs]), _max(u[p.dofs])))
        table = np.asarray(local)
        # a NaN must win the reduction
        table[~np.isfinite(table)] = np.inf
        system.comm.Allreduce(MPI.IN_PLACE, table, op=MPI.MAX)
        parts = [p for f in system.fields for p in f.parts]
        norms = tuple(
            PartNorm(p.name, _ratio(du, max(p.scale, u)), bool(du < p.bound), p.advice)
            for p, (du, u) in zip(parts, table, strict=True)
        )
        self.history.append(norms)
        return norms

    def converged(self, x: PETSc.Vec, dx: PETSc.Vec) -> tuple[float, bool]:
        """Largest relative update and whether every part has converged.

        Raises:
            ConvergenceError: If the iteration diverges.
        """
        norms = self.measure(x, dx)
        worst = max(norms, key=lambda p: p.update)
        if not all(p.bounded for p in norms):
            raise self.error("the iteration diverged")
        return worst.update, worst.update <= self.settings.tolerance

    def error(self, reason: str) -> ConvergenceError:
        """The failure in words: the field that did not converge, and what to try."""
        if not self.history:
            return ConvergenceError(f"Newton failed: {reason}", field=None, norms={})
        last = self.history[-1]
        worst = max(last, key=lambda p: p.update)
        return ConvergenceError(
            f"Newton failed after {len(self.history)} iterations: {reason}; the {worst.name} did "
            f"not converge (last relative update {worst.update:.1e}); try {worst.advice}",
            field=worst.name,
            norms={p.name: p.update for p in last},
        )


def _ratio(a: float, b: float) -> float:
    """Quotient; infinite where the first is, whatever the second."""
    return float(a / b) if np.isfinite(a) else float("inf")


def _max(values: np.ndarray) -> float:
    return float(np.max(values)) if len(values) else 0.0


class Nonlinear(Protocol):
    """Solves a block system from the fields' current values."""

    def solve(self) -> int:
        """Solve, leave the solution in the fields, return the number of iterations."""
        ...

    def warm_up(self) -> None:
        """Assemble and factorise once at the fields' current values."""
        ...


def _warm_up(system: BlockSystem, ksp: PETSc.KSP) -> None:
    """First assembly and factorisation: the pattern is known, and what is singular shows."""
    system.gather()
    system.scatter(system.x)
    system.jacobian(system.x, system.A)
    ksp.setOperators(system.A)
    ksp.setUp()


def _live(method: WeakMethod[Any]) -> Callable[..., Any]:
    """The method itself; it is only called while its object solves."""
    found = method()
    assert found is not None
    return found


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
        system: The block system.
        settings: Tolerances.
        prefix: PETSc options prefix, unique per system.
    """

    def __init__(self, system: BlockSystem, settings: NewtonSettings, prefix: str) -> None:
        self.system, self.settings = system, settings
        with _silent_stderr():
            solver = cpp.nls.petsc.NewtonSolver(system.comm)
        solver.setF(system.residual, system.b)
        solver.setJ(system.jacobian, system.A)
        solver.set_form(system.scatter)
        # the C++ solver keeps its callbacks for ever; strong ones would keep this object and all of
        # its meshes alive, of which MPI has room for some hundreds only
        update, check = WeakMethod(self._update), WeakMethod(self._check)
        solver.set_update(lambda *args: _live(update)(*args))
        solver.set_convergence_check(lambda *args: _live(check)(*args))
        solver.convergence_criterion = "incremental"
        solver.max_it = settings.max_iterations
        solver.error_on_nonconvergence = False
        solver.report = False
        linear.direct_solver(solver.krylov_solver, prefix, system.size)
        self._solver = solver
        self._iteration = 0

    def _update(self, solver: object, dx: PETSc.Vec, x: PETSc.Vec) -> None:
        failure = linear.failure(self._solver.krylov_solver)
        if failure is not None:
            raise self._convergence.error(failure)
        x.axpy(-1.0, dx)
        self._iteration += 1

    def _check(self, solver: object, dx: PETSc.Vec) -> tuple[float, bool]:
        if self._iteration == 0:
            return 1.0, False
        return self._convergence.converged(self.system.x, dx)

    def warm_up(self) -> None:
        """Assemble and factorise once at the fields' current values."""
        _warm_up(self.system, self._solver.krylov_solver)

    def solve(self) -> int:
        """Solve from the fields' current values.

        Raises:
            ConvergenceError: Names the field that did not converge.
        """
        self._convergence = Convergence(self.system, self.settings)
        self._iteration = 0
        self.system.gather()
        self.system.update_fixed_values()
        iterations, converged = self._solver.solve(self.system.x)
        if not converged:
            raise self._convergence.error("too many iterations")
        return int(iterations)


class SnesNewton:
    """PETSc's SNES with full Newton steps, the same tests.

    Args:
        system: The block system.
        settings: Tolerances.
        prefix: PETSc options prefix, unique per system.
    """

    def __init__(self, system: BlockSystem, settings: NewtonSettings, prefix: str) -> None:
        self.system, self.settings = system, settings
        snes = PETSc.SNES().create(system.comm)
        snes.setOptionsPrefix(prefix)
        residual, jacobian = WeakMethod(self._residual), WeakMethod(self._jacobian)
        snes.setFunction(lambda *args: _live(residual)(*args), system.b)
        snes.setJacobian(lambda *args: _live(jacobian)(*args), system.A)
        snes.setType(PETSc.SNES.Type.NEWTONLS)
        snes.getLineSearch().setType(PETSc.SNESLineSearch.Type.BASIC)
        test = WeakMethod(self._test)
        snes.setConvergenceTest(lambda *args: _live(test)(*args))
        snes.setTolerances(max_it=settings.max_iterations)
        linear.direct_solver(snes.getKSP(), prefix, system.size)
        self._snes = snes
        self._error: ConvergenceError | None = None

    def _residual(self, snes: PETSc.SNES, x: PETSc.Vec, b: PETSc.Vec) -> None:
        self.system.scatter(x)
        self.system.residual(x, b)

    def _jacobian(self, snes: PETSc.SNES, x: PETSc.Vec, A: PETSc.Mat, P: PETSc.Mat) -> None:
        self.system.scatter(x)
        self.system.jacobian(x, A)

    def _test(
        self, snes: PETSc.SNES, it: int, norms: tuple[float, float, float]
    ) -> PETSc.SNES.ConvergedReason:
        reasons = PETSc.SNES.ConvergedReason
        if it == 0:
            return reasons.ITERATING
        try:
            _, converged = self._convergence.converged(snes.getSolution(), snes.getSolutionUpdate())
        except ConvergenceError as error:
            self._error = error
            return reasons.DIVERGED_DTOL
        return reasons.CONVERGED_SNORM_RELATIVE if converged else reasons.ITERATING

    def warm_up(self) -> None:
        """Assemble and factorise once at the fields' current values."""
        _warm_up(self.system, self._snes.getKSP())

    def solve(self) -> int:
        """Solve from the fields' current values.

        Raises:
            ConvergenceError: Names the field that did not converge.
        """
        self._convergence = Convergence(self.system, self.settings)
        self._error = None
        self.system.gather()
        self.system.update_fixed_values()
        self._snes.solve(None, self.system.x)
        if self._snes.getConvergedReason() <= 0:
            failure = linear.failure(self._snes.getKSP())
            raise self._error or self._convergence.error(failure or "too many iterations")
        self.system.scatter(self.system.x)
        return int(self._snes.getIterationNumber())


NEWTON: dict[str, Callable[[BlockSystem, NewtonSettings, str], Nonlinear]] = {
    "newton": DolfinxNewton,
    "snes": SnesNewton,
}
