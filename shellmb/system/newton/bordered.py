"""Newton's method with the load factor as one more unknown, and one more equation for it.

The matrix with the additional row and column is never formed: two solutions with one factorisation
of the Jacobian `J`, for the residual `r` and for `dr/dfactor`, and the equation in the border gives
the factor (block elimination). Near limit points `J` is nearly singular and both solutions are
large; their combination is not.

The loop is this module's own: DOLFINx's `NewtonSolver` and PETSc's SNES solve one linear system per
iteration for one vector of unknowns, and would need the bordered matrix, which the reduction does
not know. What an iteration does is the same as there (`Iteration`): assembly, reduction, the finite
turning of directors, convergence judged part by part.
"""

from collections.abc import Callable
from functools import cached_property

from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Floats
from shellmb.native.assembler import is_native
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.assembly.loops import FormLoop, MeshCells
from shellmb.system.assembly.meshgroups import mesh_groups
from shellmb.system.newton.iteration import Iteration


class Products:
    """Multiplies the Jacobian of a system with vectors.

    To enter the matrices of cells in a large one takes ten times as long as to evaluate them.

    Args:
        system: The system.
    """

    def __init__(self, system: BlockSystem) -> None:
        self._system = system
        self._loops = _loops(system) if is_native() else None

    def __call__(self, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Multiply with the Jacobian at the state that the functions hold; collective.

        Args:
            x: The vector.
            y: Gets the product; where values are given, these entries of `x`.
        """
        system = self._system
        if self._loops is None:
            system.jacobian(system.x, system.A)
            system.A.mult(x, y)
            return
        exchange = system.exchange
        seen = exchange.seen(x.array_r)
        local = np.zeros_like(seen)
        for cells, loop in self._loops:
            loop.refresh()
            for some, matrices in loop.matrices(cells):
                at = cells.dofs[some]
                np.add.at(local, at, (matrices @ seen[at][..., None])[..., 0])
        if system.couplings:
            local += system.coupled.times(system.coupled.derivatives(), seen)
        y.array[:] = exchange.summed(local)
        y.array[system.fixed] = x.array_r[system.fixed]


def _loops(system: BlockSystem) -> list[tuple[MeshCells, FormLoop]]:
    """Loops over the cells of each mesh with all derivatives of the residuals on it."""
    found = []
    for group in mesh_groups(system):
        loop = FormLoop(group.cells, group.jacobians())
        loop.bind(group.cells)
        found.append((group.cells, loop))
    return found


class Bordered:
    """Solves `r(x, factor) = 0` with one linear equation `normal . x = given`.

    Args:
        iteration: What an iteration of Newton's method does.
        set_factor: Gives the forms another load factor. The residual must be linear in it.
        set_given: Gives the fixed unknowns their values at another load factor, and returns their
            derivatives by it; None: they do not depend on it.
    """

    def __init__(
        self,
        iteration: Iteration,
        set_factor: Callable[[float], None],
        set_given: Callable[[float], Floats] | None = None,
    ) -> None:
        self.iteration, self.system = iteration, iteration.system
        self._set_factor, self._set_given = set_factor, set_given
        self._given = np.zeros(len(self.system.fixed))
        self._residual, self._derivative, self._a, self._b = (
            self.system.x.duplicate() for _ in range(4)
        )

    def dot(self, a: Floats, b: Floats) -> float:
        """Scalar product over all ranks of arrays of owned unknowns."""
        return float(self.system.comm.allreduce(float(a @ b)))

    def take_load(self, factor: float, over: float = 0.0) -> None:
        """Take the residual and its derivative by the factor, `load`.

        Args:
            factor: Load factor of the state that the fields hold.
            over: Change of the factor over which given values are told by their difference; 0:
                by their derivative.
        """
        self.iteration.begin(None, True)
        self._take(factor, over)

    def _take(self, factor: float, over: float = 0.0) -> None:
        """Residual and its derivative by the factor at the current state."""
        if self._set_given is not None and over:
            self._set_given(factor + over)
            there = self.system.fixed_values()
            self._set_given(factor)
            self._given = (there - self.system.fixed_values()) / over
        elif self._set_given is not None:
            self._given = self._set_given(factor)
        _, derivative = self._by_load(factor)
        if self._set_given is not None:
            # forces of the given motion of fixed unknowns
            self.system.scatter(self.system.x)
            derivative += self.multiply(self._motion(None))
            derivative[self.system.fixed] = 0.0
        self._derivative.array[:] = derivative

    def _by_load(self, factor: float) -> tuple[Floats, Floats]:
        """Residual at the state that the fields hold, and its derivative by the loads' factor."""
        more = self._residual_now(factor + 1.0)
        residual = self._residual_now(factor)
        # exact, the residual being linear in the factor
        return residual, more - residual

    def _motion(self, free: Floats | None) -> Floats:
        """Derivative of all unknowns by the factor, from that of free ones; None: they stay."""
        whole = np.zeros(self._residual.local_size) if free is None else free.copy()
        whole[self.system.fixed] = self._given
        return whole

    def _linearise(self, factor: float) -> None:
        """Residual and its derivative by the factor, Jacobian factorised, at the current state.

        Raises:
            ConvergenceError: If the matrix is singular.
        """
        self._take(factor)
        self.factorise()

    def _solve(self, b: PETSc.Vec, x: PETSc.Vec) -> None:
        reason = self.iteration.linear.solve(b, x, True)
        if reason is not None:
            raise self.iteration.convergence.error(reason)

    def factorise(self) -> None:
        """Factorise the Jacobian at the state of the last `take_load`.

        Raises:
            ConvergenceError: If it is singular.
        """
        reason = self.iteration.linear.factorise()
        if reason is not None:
            raise self.iteration.convergence.error(reason)

    def derivative(self, inverse: Callable[[Floats], Floats]) -> Floats:
        """Derivative of the solution by the factor at the state of the last `take_load`.

        Args:
            inverse: Multiplies with the inverse of the Jacobian there, fixed unknowns held.

        Returns:
            One number for each unknown that this rank owns.
        """
        found = -inverse(np.asarray(self._derivative.array_r))
        found[self.system.fixed] += self._given
        return found

    def apply_inverse(self, b: Floats) -> Floats:
        """`J^-1 b` with the Jacobian last factorised, one number for each owned unknown."""
        given, none = self._residual.duplicate(), self._residual.duplicate()
        none.set(0.0)
        given.array[:] = b
        # solutions hold a correction of fixed values and directors, too: the difference does not
        self._solve(given, self._a)
        self._solve(none, self._b)
        return np.asarray(self._a.array_r - self._b.array_r)

    def hold(self, x: Floats, factor: float) -> Floats:
        """Give the fields a state; its residual, one number for each owned unknown; collective.

        Args:
            x: Owned unknowns.
            factor: The load factor.
        """
        self._hold(x, factor)
        return self._residual_now(factor)

    def along(
        self, x: Floats, factor: float, direction: Floats | None
    ) -> tuple[Floats, Floats, Floats]:
        """Residual at a state, and its derivative where the factor grows by one; collective.

        Args:
            x: Owned unknowns, which the fields take.
            factor: The load factor.
            direction: Derivative of the unknowns that are free; None: they stay.

        Returns:
            The residual, its derivative along the direction, which is zero where unknowns are
            fixed, and that derivative of the unknowns with those of fixed ones.
        """
        self._hold(x, factor)
        residual, along = self._by_load(factor)
        whole = self._motion(direction)
        if direction is not None or self._set_given is not None:
            along += self.multiply(whole)
        along[self.system.fixed] = 0.0
        return residual, along, whole

    def _hold(self, x: Floats, factor: float) -> None:
        self.system.x.array[:] = x
        self.system.scatter(self.system.x)
        if self._set_given is not None:
            self._given = self._set_given(factor)

    def _residual_now(self, factor: float) -> Floats:
        self._set_factor(factor)
        self.iteration.residual(self.system.x, self._residual)
        return np.array(self._residual.array_r)

    def multiply(self, direction: Floats) -> Floats:
        """The Jacobian at the state that the fields hold, times a direction; collective.

        Args:
            direction: One number for each owned unknown.
        """
        self._a.array[:] = direction
        self._products(self._a, self._b)
        return np.array(self._b.array_r)

    @cached_property
    def _products(self) -> Products:
        return Products(self.system)

    def move(self, change: Floats) -> None:
        """Add a change to the state that the fields hold, directors turning by finite rotations.

        Args:
            change: One number for each owned unknown.
        """
        system = self.system
        system.gather()
        self._a.array[:] = -change
        self.iteration.nodes.turn(system.x, self._a)
        system.x.axpy(-1.0, self._a)
        system.scatter(system.x)

    def solve(self, factor: float, normal: Floats, given: float) -> tuple[int, float]:
        """Solve from the fields' current values, leave the solution in the fields.

        Args:
            factor: First guess of the factor.
            normal: Row of the additional equation, of owned unknowns.
            given: Its right-hand side.

        Returns:
            Number of iterations, and the factor.

        Raises:
            ConvergenceError: Names the field that did not converge.
        """
        iteration, system = self.iteration, self.system
        iteration.begin(None, True)
        for count in range(1, iteration.settings.max_iterations + 1):
            self._linearise(factor)
            self._solve(self._residual, self._a)
            self._derivative.axpy(1.0, self._residual)
            self._solve(self._derivative, self._b)
            self._b.axpy(-1.0, self._a)
            self._b.array[system.fixed] -= self._given
            # (a + change b) is subtracted from x
            missing = given - self.dot(normal, system.x.array_r)
            along = self.dot(normal, self._b.array_r)
            if along == 0.0 or not np.isfinite(along):
                raise iteration.convergence.error("the load does not move what is followed")
            change = -(missing + self.dot(normal, self._a.array_r)) / along
            self._a.axpy(change, self._b)
            iteration.nodes.turn(system.x, self._a)
            system.x.axpy(-1.0, self._a)
            factor += change
            # a solution for other given values than those of the factor is none
            if iteration.converged(system.x, self._a) and self._takes_given(factor):
                system.scatter(system.x)
                self._set_factor(factor)
                return count, factor
        raise iteration.unfinished()

    def _takes_given(self, factor: float) -> bool:
        """Decide whether fixed unknowns have their values at a factor, which they get if so.

        The update knows only the derivatives of these at the factor before.
        """
        if self._set_given is None:
            return True
        iteration, system = self.iteration, self.system
        self._set_given(factor)
        missing = np.zeros(self._residual.local_size)
        missing[system.fixed] = system.fixed_values() - system.x.array_r[system.fixed]
        off = np.max(iteration.convergence.sizes(system.x.array_r, missing[None]))
        if off > iteration.settings.tolerance:
            return False
        system.x.array[:] += missing
        return True
