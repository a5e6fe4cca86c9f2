"""Linear systems of Newton's method: what solves them, and all unknowns in one matrix."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from petsc4py import PETSc

from shellmb.arrays import Floats
from shellmb.clock import now
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.direct.mumps import NO_OPTIONS
from shellmb.system.direct.solver import SMALL_COST, DirectSolver, Purpose


class Linear(Protocol):
    """Solves the linear systems of Newton's method.

    Attributes:
        solver: Its factors; None before the first ones.
        size: Number of its unknowns.
        seconds: Time spent in each of its parts so far.
        jacobians: Number of Jacobians assembled so far.
        factorisations: Number of factorisations so far; of large matrices they last longer.
        cost: Cost of a new Jacobian and its factorisation, in iterations with an old one.
    """

    seconds: dict[str, float]
    jacobians: int

    @property
    def solver(self) -> DirectSolver | None: ...  # noqa: D102
    @property
    def size(self) -> int: ...  # noqa: D102
    @property
    def factorisations(self) -> int: ...  # noqa: D102
    @property
    def cost(self) -> float: ...  # noqa: D102

    def renew(self) -> None:
        """Couplings have got other entries."""
        ...

    def factorise(self, purpose: Purpose = Purpose.EXACT) -> str | None:
        """Assemble and factorise at the state that the fields hold; returns why that failed.

        Args:
            purpose: What for.
        """
        ...

    def solve(self, b: PETSc.Vec, dx: PETSc.Vec, fresh: bool) -> str | None:
        """Solve `J dx = b` with the last factorisation; returns why that failed.

        Args:
            b: Residual at the current state.
            dx: What is to be subtracted from the unknowns.
            fresh: Whether the factorisation belongs to the current state.
        """
        ...

    def in_c(self) -> tuple[Any, ...] | None:
        """For C, a solution with an earlier factorisation; None: there is no call for it."""
        ...

    def solve_many(self, given: Sequence[PETSc.Vec], found: Sequence[PETSc.Vec]) -> str | None:
        """Solve for several right-hand sides with an earlier factorisation.

        Args:
            given: Right-hand sides.
            found: Take the solutions.
        """
        ...


def one_by_one(
    linear: Linear, given: Sequence[PETSc.Vec], found: Sequence[PETSc.Vec]
) -> str | None:
    """Solve for several right-hand sides by a solution each; returns why one failed."""
    for b, dx in zip(given, found, strict=True):
        reason = linear.solve(b, dx, False)
        if reason is not None:
            return reason
    return None


def refresh_cost(solver: DirectSolver, system: BlockSystem) -> float:
    """Cost of a new Jacobian and its factorisation, in iterations with an old one.

    The more forms a Jacobian has for each of the residual, the more it costs of what an iteration
    costs: in EP4 both rows of a step are one form (docs/theory/linear_systems.md).

    Args:
        solver: What factorises.
        system: What is assembled.
    """
    return solver.cost * max(1.0, system.tangents)


class Unreduced:
    """All unknowns in one matrix, assembled by DOLFINx.

    Args:
        system: The block system.
        prefix: PETSc options prefix, unique per system.
        options: Options of MUMPS, besides those that all systems have.

    Attributes:
        multipliers: Last transposed solution, of all local dofs.
    """

    multipliers: Floats

    def __init__(
        self, system: BlockSystem, prefix: str, options: Mapping[str, int] = NO_OPTIONS
    ) -> None:
        self.system, self._prefix, self._options = system, prefix, options
        self.seconds = {"jacobian": 0.0, "reduction": 0.0, "factor": 0.0, "solve": 0.0}
        self.jacobians = 0
        self.solver: DirectSolver | None = None
        self._solution = system.x.duplicate()

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.system.size

    @property
    def factorisations(self) -> int:
        """Number of factorisations so far."""
        return 0 if self.solver is None else self.solver.factorisations

    @property
    def cost(self) -> float:
        """Cost of a new factorisation in iterations with an old one."""
        return SMALL_COST if self.solver is None else refresh_cost(self.solver, self.system)

    def renew(self) -> None:
        """PETSc allocates entries as they come."""

    def factorise(self, purpose: Purpose = Purpose.EXACT) -> str | None:
        """Assemble and factorise at the state that the fields hold."""
        system, start = self.system, now()
        system.jacobian(system.x, system.A)
        self.jacobians += 1
        if self.solver is None:
            self.solver = DirectSolver(system.A, self._prefix, options=self._options)
        middle = now()
        failure = self.solver.factorise()
        self.seconds["jacobian"] += middle - start
        self.seconds["factor"] += now() - middle
        return failure

    def solve(self, b: PETSc.Vec, dx: PETSc.Vec, fresh: bool) -> str | None:
        """Solve with the last factorisation."""
        start = now()
        assert self.solver is not None
        failure = self.solver.solve(b, dx)
        self.seconds["solve"] += now() - start
        return failure

    def in_c(self) -> tuple[Any, ...] | None:
        """No call of C solves in all unknowns."""
        return None

    def solve_many(self, given: Sequence[PETSc.Vec], found: Sequence[PETSc.Vec]) -> str | None:
        """Solve for several right-hand sides with the last factorisation."""
        return one_by_one(self, given, found)

    def solve_transposed(self, b: PETSc.Vec) -> str | None:
        """Solve `J^T x = b` with the last factorisation; returns why that failed.

        Args:
            b: Right-hand side; `multipliers` gets the solution.
        """
        assert self.solver is not None
        failure = self.solver.solve_transposed(b, self._solution)
        self.multipliers = self.system.local_values(self._solution)
        return failure

    def follow(self) -> None:
        """Do nothing: the unknowns are the same at all states."""
