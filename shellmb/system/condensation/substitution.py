"""The passes of a solution: from the residual to the reduced system, and from its solution back."""

from collections.abc import Sequence
from typing import Any

from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Floats
from shellmb.native import library as native
from shellmb.native.library import CArrays
from shellmb.system.condensation.meshreduction import MeshReduction
from shellmb.system.nullspace.numbers import ReducedNumbers


class Passes:
    """Both passes of a solution; the second one belongs to the first one before it.

    Between the loops over cells the ranks tell one another what they know.

    Args:
        numbers: Numbers of the reduced unknowns.
        parts: Reductions of all meshes.
    """

    def __init__(self, numbers: ReducedNumbers, parts: Sequence[MeshReduction]) -> None:
        self.numbers, self.parts = numbers, parts

    def before(self, b: Floats, load: Floats | None, rhs: Floats, transposed: bool = False) -> None:
        """Fill the right-hand side of the reduced system.

        Args:
            b: Residual, entries that this rank owns.
            load: Forces of given changes on the local dofs; None: there are none.
            rhs: Gets the result, entries of the matrix's rows that this rank owns.
            transposed: Whether it is of the transposed system, rows and columns exchanged.
        """
        numbers = self.numbers
        tests = numbers.right if transposed else numbers.left
        local = numbers.full.seen(b)
        change = np.zeros_like(local)
        for part in self.parts:
            part.reduce(local, change, transposed)
        outer = b + numbers.full.summed(change)
        if not transposed:
            self._forces = numbers.forces.transposed(outer)
        if load is not None:
            outer = outer - numbers.full.summed(load)
        reduced = tests.transposed(outer)
        self._r = tests.numbers.seen(reduced)
        rest = np.zeros(len(self._r))
        for part in self.parts:
            part.reduce_inner(self._r, rest, transposed)
        reduced = reduced + tests.numbers.summed(rest)
        rhs[:] = reduced[numbers.outer]

    def _combined(self, solution: Floats, transposed: bool) -> Floats:
        """Values of the local dofs, those of element-wise ones still to come."""
        numbers = self.numbers
        trials = numbers.left if transposed else numbers.right
        reduced = np.zeros(numbers.count)
        reduced[numbers.outer] = solution
        seen = trials.seen(reduced)
        for part in self.parts:
            part.expand_inner(self._r, seen, transposed)
        return trials.times(seen)

    def after(self, solution: Floats, given: Floats, dx: Floats) -> None:
        """Fill in the solution for all unknowns.

        Args:
            solution: Of the reduced system, owned entries.
            given: Given changes of the local dofs.
            dx: Gets the result, owned entries.
        """
        numbers = self.numbers
        x = self._combined(solution, False) - given
        rows = np.zeros(len(numbers.forces.numbers.wanted))
        for part in self.parts:
            part.expand(x, rows)
        forces = self._forces - numbers.forces.numbers.summed(rows)
        values = numbers.multiplier_values
        x += values.times(values.seen(forces))
        dx[:] = x[numbers.own]

    def after_transposed(self, solution: Floats) -> Floats:
        """Multipliers of the local dofs.

        Args:
            solution: Of the reduced system, owned entries.
        """
        values = self._combined(solution, True)
        for part in self.parts:
            part.expand(values, None)
        return values


class DirectSolution:
    """Both passes with the solution between them by one call of `unknowns.c`, in one process.

    Args:
        numbers: Numbers of the reduced unknowns.
        parts: Reductions of all meshes.
        rhs: Place for the right-hand side of the reduced system.
        solution: Place for its solution.
    """

    def __init__(
        self,
        numbers: ReducedNumbers,
        parts: Sequence[MeshReduction],
        rhs: PETSc.Vec,
        solution: PETSc.Vec,
    ) -> None:
        self._lib, pointer, void = native.cells().lib, CArrays(), native.cells().ffi
        seen = len(numbers.forces.numbers.wanted)
        local = len(numbers.full.wanted)

        def zeros(size: int) -> Any:
            return pointer(np.zeros(size))

        members = {
            "parts": len(parts),
            "owned": len(numbers.own),
            "local": local,
            "reduced": numbers.count,
            "outer": len(numbers.outer),
            "multipliers": seen,
            "part": pointer.many("Part", [part.part[0] for part in parts]),
            "wanted": pointer(numbers.full.wanted),
            "own": pointer(numbers.own),
            "outer_numbers": pointer(numbers.outer.astype(np.int64)),
            "left": numbers.left.members,
            "right": numbers.right.members,
            "force": numbers.forces.members,
            "multiplier": numbers.multiplier_values.members,
            "b": zeros(local),
            "change": zeros(local),
            "reaction": zeros(len(numbers.own)),
            **{name: zeros(seen) for name in ("forces", "rows")},
            **{name: zeros(numbers.count) for name in ("r", "seen", "rest")},
        }
        vectors = {
            "right": void.cast("void *", rhs.handle),
            "unknown": void.cast("void *", solution.handle),
            "rhs": pointer(rhs.array),
            "solution": pointer(solution.array),
        }
        self._kept = pointer, rhs, solution
        self._solution = pointer.many("Solution", [members])
        self._reduced = pointer.many("Reduced", [vectors])

    def in_c(self, factors: tuple[int, Any], given: Floats) -> tuple[Any, ...]:
        """For C, what `solve` takes without a load; vectors come later."""
        return self._solution, self._reduced, *factors, native.doubles(given)

    def solve(
        self,
        factors: tuple[int, Any],
        b: PETSc.Vec,
        load: Floats | None,
        given: Floats,
        dx: PETSc.Vec,
    ) -> tuple[int, float]:
        """Solve.

        Args:
            factors: As of `DirectSolver.made`.
            b: Residual.
            load: As of `Passes.before`.
            given: As of `Passes.after`.
            dx: Takes the solution.

        Returns:
            Error of PETSc, zero if it could solve, and the time that the solution between both
            passes took, s.
        """
        reduced = self._reduced
        where = b.handle, *map(native.doubles, (load, given)), dx.handle
        error = self._lib.solve(self._solution, reduced, *factors, *where)
        return error, reduced[0].seconds
