"""Linear systems of Newton's method: what solves them, and all unknowns in one matrix."""

from collections.abc import Mapping, Sequence
from typing import Any

from petsc4py import PETSc

from shellmb.arrays import Floats
from shellmb.clock import now
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.direct.mumps import NO_OPTIONS
from shellmb.system.direct.solver import SMALL_COST, DirectSolver, Purpose


class Linear:
    """Solves the linear systems of Newton's method.

    Args:
        system: The block system.

    Attributes:
        solver: Its factors; None before the first ones.
        seconds: Time spent in each of its parts so far.
        jacobians: Number of Jacobians assembled so far.
        multipliers: Last transposed solution, one number for each local dof of all fields.
    """

    solver: DirectSolver | None = None
    multipliers: Floats

    def __init__(self, system: BlockSystem) -> None:
        self.system = system
        self.seconds = {"jacobian": 0.0, "reduction": 0.0, "factor": 0.0, "solve": 0.0}
        self.jacobians = 0

    @property
    def size(self) -> int:
        """Number of its unknowns."""
        return self.system.size

    @property
    def factorisations(self) -> int:
        """Number of factorisations so far; of large matrices they last longer."""
        return 0 if self.solver is None else self.solver.factorisations

    @property
    def cost(self) -> float:
        """Cost of a new Jacobian and its factorisation, in iterations with an old one.

        The more forms a Jacobian has for each of the residual, the more it costs of what an
        iteration costs: in EP4 both rows of a step are one form (docs/theory/linear_systems.md).
        """
        if self.solver is None:
            return SMALL_COST
        return self.solver.cost * max(1.0, self.system.tangents)

    def renew(self) -> None:
        """Couplings have got other entries."""

    def factorise(self, purpose: Purpose = Purpose.EXACT) -> str | None:
        """Assemble and factorise at the state that the fields hold; returns why that failed.

        Args:
            purpose: What for.
        """
        raise NotImplementedError

    def solve(self, b: PETSc.Vec, dx: PETSc.Vec, fresh: bool) -> str | None:
        """Solve `J dx = b` with the last factorisation; returns why that failed.

        Args:
            b: Residual at the current state.
            dx: What is to be subtracted from the unknowns.
            fresh: Whether the factorisation belongs to the current state.
        """
        raise NotImplementedError

    def in_c(self) -> tuple[Any, ...] | None:
        """For C, a solution with an earlier factorisation; None: there is no call for it."""
        return None

    def solve_many(self, given: Sequence[PETSc.Vec], found: Sequence[PETSc.Vec]) -> str | None:
        """Solve for several right-hand sides with an earlier factorisation; returns why one failed.

        Args:
            given: Right-hand sides.
            found: Take the solutions.
        """
        pairs = zip(given, found, strict=True)
        reasons = (self.solve(b, dx, False) for b, dx in pairs)
        return next((reason for reason in reasons if reason is not None), None)

    def solve_transposed(self, b: PETSc.Vec) -> str | None:
        """Solve `J^T x = b` with the last factors; returns why that failed.

        Args:
            b: Right-hand side; `multipliers` gets the solution.
        """
        raise NotImplementedError

    def follow(self) -> None:
        """Take tangent spaces at the state that the fields hold, without new factors."""


class Unreduced(Linear):
    """All unknowns in one matrix, assembled by DOLFINx.

    Args:
        system: The block system.
        prefix: PETSc options prefix, unique per system.
        options: Options of MUMPS, besides those that all systems have.
    """

    def __init__(
        self, system: BlockSystem, prefix: str, options: Mapping[str, int] = NO_OPTIONS
    ) -> None:
        super().__init__(system)
        self._prefix, self._options, self._solution = prefix, options, system.x.duplicate()

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

    def solve_transposed(self, b: PETSc.Vec) -> str | None:
        """Solve the transposed system with the last factorisation."""
        assert self.solver is not None
        failure = self.solver.solve_transposed(b, self._solution)
        self.multipliers = self.system.local_values(self._solution)
        return failure
