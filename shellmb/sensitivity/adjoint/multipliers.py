"""Multipliers of the equations of a step, by iteration with factors of another step.

A sweep backwards solves one transposed system for each step, whose matrices differ little from step
to step. So factors are kept over steps, as Newton's method keeps them, and precondition the method
of conjugate residuals (GCR: Eisenstat, Elman and Schultz, SIAM J. Numer. Anal. 20 (1983) 345-357).
The matrix itself is not assembled: its transposed product is a pass of `Transposed`.
"""

from functools import cached_property
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.errors import ConvergenceError
from shellmb.sensitivity.adjoint.transposed import Transposed
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.direct.linear import Linear
from shellmb.system.direct.solver import Purpose

# error at which the iteration ends, of each part of the multipliers relative to its largest one;
# with parameters of the scene, which may act on small ones alone, such as those normal to a slide
TOLERANCE, ROUND_OFF = 1e-11, 1e-14
# the same where round-off ends it before: an iteration leaves more than this share of the error
USELESS, STALLED = 1e-8, 0.5
# share of an error that a product and a solution with old factors give back along it at least: of
# where the matrix is far softer than the factors, what is left does not tell how large the error is
SOFT = 0.3
# iterations with old factors, and with new ones
PATIENCE, MOST = 12, 40


class Multipliers:
    """Solves the transposed systems of the steps of a sweep.

    Args:
        system: The block system.
        transposed: Derivatives of its residuals.
        linear: What factorises.
        ready: Whether it has factors of a state near the first one.
        tolerance: Error at which the iteration ends.

    Attributes:
        local: Multipliers of the step that was solved last, one for each local dof.
        iterations: Number of solutions with factors so far.
        factorisations: Number of factorisations so far.
    """

    def __init__(
        self,
        system: BlockSystem,
        transposed: Transposed,
        linear: Linear,
        ready: bool,
        tolerance: float = TOLERANCE,
    ) -> None:
        self._tolerance = tolerance
        self._system, self._transposed, self._linear = system, transposed, linear
        self._product = system.x.duplicate()
        fixed = np.zeros(system.numbering.owned)
        fixed[system.fixed] = 1.0
        self._product.array[:] = fixed
        # local dofs with given values, and one for each of these
        self._given = np.flatnonzero(system.local_values(self._product))
        unknowns = system.numbering.local_to_global[self._given] - system.numbering.start
        mine = (unknowns >= 0) & (unknowns < system.numbering.owned)
        self._own_given = self._given[mine][np.unique(unknowns[mine], return_index=True)[1]]
        self._taken = np.empty((0, 0))
        self._purpose = Purpose.LAGGED
        # steps that the factors served, their cost in iterations, and that of the last step
        self._served, self._spent, self._last = int(ready), linear.cost, 0
        self.iterations = self.factorisations = 0

    def solve(self, right: PETSc.Vec) -> None:
        """Solve at the state that the fields hold; `local` and `Transposed` take it; collective.

        Args:
            right: Right-hand side.

        Raises:
            ConvergenceError: If there is no solution.
        """
        before = self.iterations
        # factors serve as long as that lessens their mean cost
        fresh = not self._served or self._last * self._served > self._spent
        if fresh:
            self._factorise()
        else:
            self._linear.follow()
        while (found := self._iterate(right, fresh)) is None:
            if fresh and self._purpose is Purpose.EXACT:
                raise ConvergenceError(
                    "adjoint: the transposed system of a step has no solution to eight digits; its "
                    "stiffness is nearly singular there"
                )
            self._purpose = Purpose.EXACT if fresh else self._purpose
            self._factorise()
            fresh = True
        self._last = self.iterations - before
        self._served, self._spent = self._served + 1, self._spent + self._last
        self._take(found)

    def by_field(self) -> list[Floats]:
        """Multipliers of the last step, an array of local dofs for each field."""
        slices = map(self._system.numbering.slice, range(len(self._system.fields)))
        return [self.local[place] for place in slices]

    def _factorise(self) -> None:
        """Factorise at this state.

        Raises:
            ConvergenceError: If that fails.
        """
        _check(self._linear.factorise(self._purpose))
        self.factorisations += 1
        self._served, self._spent = 0, self._linear.cost

    def _precondition(self, rest: Floats) -> Floats:
        """A solution with the factors as they are."""
        self._product.array[:] = rest
        _check(self._linear.solve_transposed(self._product))
        self.iterations += 1
        return self._linear.multipliers

    def _take(self, local: Floats) -> None:
        """Take multipliers, where no values are given."""
        self.local = free = local
        if len(self._given):
            free = local.copy()
            free[self._given] = 0.0
        self._transposed.take(free)

    def _times(self, multipliers: Floats) -> Floats:
        """Transposed matrix times multipliers."""
        local = np.zeros(len(multipliers))
        self._take(multipliers)
        # equations of given values; linked dofs are one unknown
        local[self._own_given] = multipliers[self._own_given]
        self._transposed.add_unknown(local)
        return self._system.exchange.summed(local)

    def _iterate(self, right: PETSc.Vec, fresh: bool) -> Floats | None:
        """Multipliers by conjugate residuals; None if that does not converge.

        What is left of the right-hand side is updated, and its solution taken anew in each
        iteration: so what elimination of resultants loses of round-off is lost of what is left.
        Old factors are not used where the matrix is far softer, as where a contact has opened.
        """
        most = MOST if fresh else PATIENCE
        rest = np.array(right.array_r)
        error = self._precondition(rest)
        sizes = self._sizes(error)
        count = len(sizes)
        state = np.concatenate([np.zeros(count), error / sizes, rest])
        found, error, rest = state[:count], state[count : 2 * count], state[2 * count :]
        # what each iteration may take from these, and squares of its changes of the error
        if self._taken.shape[1] != len(state):
            self._taken = np.empty((MOST, len(state)))
        taken, changes, squares = self._taken, self._taken[:, count : 2 * count], np.empty(MOST)
        errors = [self._largest(error)]
        while errors[-1] > 0.0:
            if _ends(errors, self._tolerance):
                # the error left contracts as the last ones did
                found += error
                break
            k = len(errors) - 1
            if k == most or not np.isfinite(errors[-1]):
                return None
            row = taken[k]
            loss, change, force = row[:count], row[count : 2 * count], row[2 * count :]
            np.negative(error, out=loss)
            force[:] = self._times(error * sizes)
            np.divide(self._precondition(rest - force), sizes, out=change)
            np.subtract(error, change, out=change)
            back, before = self._sums([change @ error, error @ error])
            if not (fresh or back >= SOFT * before):
                return None
            if k:
                row -= (self._sums(changes[:k] @ change) / squares[:k]) @ taken[:k]
            squares[k], step = self._sums([change @ change, change @ error])
            if squares[k] == 0.0:
                return None
            state -= (step / squares[k]) * row
            errors.append(self._largest(error))
        return found * sizes

    def _sizes(self, multipliers: Floats) -> Floats:
        """Largest number of each part, at all places of the part."""
        dofs, starts, counts = self._parts
        largest = np.zeros(len(counts))
        if len(starts):
            largest[counts > 0] = np.maximum.reduceat(np.abs(multipliers[dofs]), starts)
        self._system.comm.Allreduce(MPI.IN_PLACE, largest, op=MPI.MAX)
        largest[largest == 0.0] = 1.0
        sizes = np.ones(len(multipliers))
        sizes[dofs] = np.repeat(largest, counts)
        return sizes

    @cached_property
    def _parts(self) -> tuple[Ints, Ints, Ints]:
        """Local dofs of all named parts, where those that have any begin, and how many all have."""
        offsets = self._system.numbering.offsets.tolist()
        pairs = zip(self._system.fields, offsets, strict=False)
        parts = [part.dofs + first for field, first in pairs for part in field.parts]
        counts = np.array([len(part) for part in parts], dtype=np.int64)
        starts = (np.cumsum(counts) - counts)[counts > 0]
        return np.concatenate([np.zeros(0, np.int64), *parts]), starts, counts

    def _largest(self, values: Floats) -> float:
        """Largest absolute number over all ranks."""
        largest = float(np.abs(values).max(initial=0.0))
        return float(self._system.comm.allreduce(largest, op=MPI.MAX))

    def _sums(self, values: Any) -> Any:
        """Sums over all ranks."""
        sums = np.array(values, dtype=float)
        self._system.comm.Allreduce(MPI.IN_PLACE, sums)
        return sums


def _ends(errors: list[float], tolerance: float) -> bool:
    """Decide whether one more update leaves an error that is small enough."""
    now = errors[-1]
    if len(errors) == 1:
        return False
    # every other one contracts less
    contraction = now / errors[-2] if len(errors) == 2 else np.sqrt(now / errors[-3])
    contraction = min(1.0, contraction)
    return bool(now * contraction <= tolerance or (now > STALLED * errors[-2] and now <= USELESS))


def _check(failed: str | None) -> None:
    """Raise an error if a linear solution failed."""
    if failed is not None:
        raise ConvergenceError(f"adjoint: {failed}")
