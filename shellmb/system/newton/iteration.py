"""Parts of a Newton iteration: residual, linear solution, update, test."""

from collections.abc import Callable, Hashable
from dataclasses import dataclass

from petsc4py import PETSc

import numpy as np

from shellmb.clock import now
from shellmb.errors import ConvergenceError
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.direct.linear import Linear, Unreduced
from shellmb.system.direct.solver import Factors, Purpose
from shellmb.system.newton.convergence import Convergence, RoundOff
from shellmb.system.newton.refactorisation import REFRESH, Refresh
from shellmb.system.nullspace.nodes import SystemNodes

# why there is no solution, whatever else it looks like
NO_NUMBER = (
    "a force is no finite number here: a law, a potential or a function of the scene gives nan "
    "or inf"
)

# motion in an update, relative to the size of bodies, that a first guess is not off by: directors
# move by two at most. Beyond it the iteration may find another solution, a linkage turned over
ASTRAY = 3.0

# distance from the origin, relative to the size of bodies, from which on forces lose digits by it
FAR = 1e3

MakeLinear = Callable[[SystemNodes, str], Linear]


@dataclass(frozen=True)
class NewtonSettings:
    """Settings of the iteration.

    Args:
        tolerance: Largest update of each part relative to its scale at which the iteration ends;
            the error left behind is of the square of it, convergence being quadratic.
        max_iterations: Iterations after which the step counts as failed.
        newton: When to factorise: "full", "modified", "auto", the same behind "linear" or "static".
    """

    tolerance: float = 1e-8
    max_iterations: int = 20
    newton: str = "full"


class Iteration:
    """A Newton iteration: residual, linear solution, update, test.

    PETSc's and DOLFINx's solvers call it back: they hold the loop.

    Args:
        system: The block system.
        settings: Tolerances.
        prefix: PETSc options prefix, unique per system.
        linear: Makes what solves the linear systems; None: all unknowns in one matrix.

    Attributes:
        prefix: PETSc options prefix.
        lags: Whether it uses factorisations of earlier states.
        guessed: Whether the solution begins at an extrapolated guess, which may lead astray.
        residuals: Number of residuals so far.
        residual_seconds: Time spent in them.
    """

    def __init__(
        self,
        system: BlockSystem,
        settings: NewtonSettings,
        prefix: str,
        linear: MakeLinear | None = None,
    ) -> None:
        self.system, self.settings, self.prefix = system, settings, prefix
        self.nodes = SystemNodes(system)
        self.linear = Unreduced(system, prefix) if linear is None else linear(self.nodes, prefix)
        self.convergence = Convergence(system)
        self.roundoff = RoundOff(system, self.convergence)
        self._refresh: Refresh = REFRESH[settings.newton]()
        self._full = Refresh()
        self.lags = self._refresh.purpose is not Purpose.ONE
        self.refresh = self._refresh
        self.guessed = False
        self.failure: ConvergenceError | None = None
        self.residuals, self.residual_seconds = 0, 0.0
        self._dx = system.x.duplicate()

    @property
    def factorisations(self) -> int:
        """Number of factorisations so far."""
        return self.linear.factorisations

    @property
    def factors(self) -> Factors | None:
        """Maker of the factors; None before the first ones."""
        return None if self.linear.solver is None else self.linear.solver.factors

    def forget(self, factors: Factors | None) -> None:
        """Keep nothing of earlier solutions: the next one depends on the state alone.

        Args:
            factors: Who makes the factors, as from `factors`.
        """
        self._refresh = self.refresh = REFRESH[self.settings.newton]()
        self.convergence.widen(0.0)
        if self.linear.solver is not None and factors is not None:
            self.linear.solver.forget(factors)

    def begin(self, key: Hashable, full: bool, guess: PETSc.Vec | None = None) -> None:
        """Before the first iteration; arguments as of `Nonlinear.solve`."""
        self.refresh = self._full if full else self._refresh
        if full:
            # it factorises at states of its own
            self._refresh.forget()
        self.refresh.begin(key)
        self.convergence.begin()
        self.roundoff.begin()
        self.nodes.begin()
        self.failure = None
        if guess is None:
            self.system.gather()
            self.system.follow()
        else:
            guess.copy(self.system.x)
        self.system.update_fixed_values()
        if guess is not None or self.refresh.lasts:
            # an old factorisation knows no forces of given values that an update changes
            self.system.x.array[self.system.fixed] = self.system.fixed_values()
        self.system.residuals.refresh()

    def residual(self, x: PETSc.Vec, b: PETSc.Vec) -> None:
        """Residual at `x`, which the fields take."""
        start = now()
        self.system.evaluate(x, b)
        self._last = b
        self.residual_seconds += now() - start
        self.residuals += 1

    def solve_linear(self, b: PETSc.Vec, dx: PETSc.Vec) -> None:
        """Linear solution, with a new factorisation if one is wanted.

        A failure is kept in `failure`: exceptions do not pass through the loops of C++.
        """
        fresh = self.refresh.wanted()
        reason = None
        if fresh:
            reason = self.linear.factorise(self.refresh.purpose)
            self.refresh.factorised(self.linear.cost)
        reason = reason or self.linear.solve(b, dx, fresh)
        if reason is not None and not np.isfinite(b.norm()):
            reason = NO_NUMBER
        if reason is None:
            self.nodes.turn(self.system.x, dx)
        else:
            dx.set(0.0)
            self.failure = self.convergence.error(reason)

    def converged(self, x: PETSc.Vec, dx: PETSc.Vec) -> bool:
        """Decide whether the iteration may end.

        Raises:
            ConvergenceError: If it diverges.
        """
        try:
            update, moved, weighted = self.convergence.measure(x, dx)
        except ConvergenceError:
            if np.isfinite(self._last.norm()):
                raise
            raise self.convergence.error(NO_NUMBER) from None
        if self.guessed and moved > ASTRAY:
            raise self.convergence.error("the first guess leads astray")
        if self.refresh.converged(update, moved, weighted, self.settings.tolerance):
            return True
        if not self.roundoff.is_all(update, moved, self._last):
            return False
        self.refresh.settled()
        return True

    def unfinished(self) -> ConvergenceError:
        """Say why the iteration did not end in as many updates as it may take; collective."""
        if self.roundoff.is_left(self._last):
            far, update = self.convergence.far, self.convergence.worst()[1]
            if far > FAR:
                return self.convergence.error(
                    f"all equations hold to round-off of places that are {far:.1e} times as far "
                    "from the origin as bodies are large, and forces change with each iteration",
                    f"an origin next to the bodies, or Solver(tolerance={10 * update:.0e})",
                )
            return self.convergence.error(
                "all equations hold to round-off, and yet something changes with each iteration: "
                "nothing determines it",
                "another position, supports that hold it, or fewer constraints",
            )
        return self.convergence.error("too many iterations")

    def update(self) -> None:
        """The one update of a system that is known to be linear.

        Raises:
            ConvergenceError: If its matrix has no factors.
        """
        x, b = self.system.x, self.system.b
        self.residual(x, b)
        self.solve_linear(b, self._dx)
        if self.failure is not None:
            raise self.failure
        x.axpy(-1.0, self._dx)
        self.converged(x, self._dx)
        # reactions are those of the solution
        self.residual(x, b)

    def warm_up(self, key: Hashable) -> None:
        """First assembly and factorisation: what is singular shows, later steps are alike.

        Args:
            key: That of the first solution.
        """
        self.begin(key, not self._refresh.lasts)
        self.system.scatter(self.system.x)
        if self.linear.factorise(self._refresh.purpose) is None:
            self.refresh.factorised(self.linear.cost)
