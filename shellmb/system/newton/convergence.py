"""Convergence of Newton's method, judged part by part, and its failures in words."""

from __future__ import annotations

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.errors import ConvergenceError
from shellmb.native import library as native
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.assembly.fields import Part


class Convergence:
    """Judges an update part by part.

    Args:
        system: The block system.

    Attributes:
        iterations: Number of updates measured since `begin`.
    """

    def __init__(self, system: BlockSystem) -> None:
        self.system = system
        found = owned_parts(system)
        self.parts, dofs = [part for part, _ in found], [entries for _, entries in found]
        self._lib = native.cells().lib
        self._entries = np.concatenate([*dofs, np.zeros(0, np.int64)]).astype(np.int64)
        self._ends = np.cumsum([0, *(len(d) for d in dofs)]).astype(np.int64)
        self._where = (len(self.parts), native.longs(self._ends), native.longs(self._entries))
        self._scales = np.array([p.scale for p in self.parts])
        self._bounds = np.array([p.bound for p in self.parts])
        # changes of all parts, and their sizes, which give way to relative changes
        self._table = np.zeros((2, len(self.parts)))
        # the largest relative change, how far the largest motion went, whether it went too far
        self._found = np.zeros(3)
        tables = (self._scales, self._bounds, self._table, self._found)
        self._relate = (len(self.parts), *map(native.doubles, tables))
        self._serial = system.comm.size == 1
        self.iterations = 0

    def begin(self) -> None:
        """A new solution."""
        self.iterations = 0

    def measure(self, x: PETSc.Vec, dx: PETSc.Vec) -> tuple[float, float]:
        """Largest relative update of a part, and of what must not move far; on all ranks the same.

        Raises:
            ConvergenceError: If the iteration diverges.
        """
        self._judge(x.array_r, dx.array_r)
        self.iterations += 1
        largest, moved, diverged = self._found.tolist()
        if diverged:
            raise self.error("the iteration diverged")
        return largest, moved

    def sizes(self, x: Floats, changes: Floats) -> Floats:
        """Largest relative change of a part for each of several changes, the same on every rank.

        Args:
            x: Owned entries, shape (n,).
            changes: Changes of them, shape (k, n).

        Returns:
            Shape (k,).
        """
        count, found = len(changes), np.empty(len(changes))
        table = np.empty((count + 1, len(self.parts)))
        sizes, rows = native.doubles(table[0]), native.doubles(table[1:])
        self._lib.largest(*self._where, native.doubles(x), sizes)
        self._lib.largest_of_each(count, len(x), *self._where, native.doubles(changes), rows)
        if not self._serial:
            self.system.comm.Allreduce(MPI.IN_PLACE, table, op=MPI.MAX)
        self._lib.relate_each(count, *self._relate[:2], sizes, rows, native.doubles(found))
        return found

    def typical(self, x: Floats) -> Floats:
        """How large the part of each unknown is: its scale, or its largest value; collective.

        Args:
            x: Owned entries, shape (n,).

        Returns:
            Shape (n,); of unknowns without a part, their own size.
        """
        found, sizes = np.abs(x), np.zeros(len(self.parts))
        self._lib.largest(*self._where, native.doubles(x), native.doubles(sizes))
        self.system.comm.Allreduce(MPI.IN_PLACE, sizes, op=MPI.MAX)
        scales = np.where(np.isfinite(self._scales), self._scales, 0.0)
        found[self._entries] = np.repeat(np.maximum(scales, sizes), np.diff(self._ends))
        return found

    def _judge(self, x: Floats, dx: Floats) -> None:
        """Compare changes of the parts with their scales or own sizes, whichever is larger."""
        if self._serial:
            pair = native.doubles(x), native.doubles(dx)
            self._lib.judge(*self._where, *pair, *self._relate[1:])
            return
        for values, row in zip((dx, x), self._table, strict=True):
            # a NaN wins, of all ranks, too
            self._lib.largest(*self._where, native.doubles(values), native.doubles(row))
        self.system.comm.Allreduce(MPI.IN_PLACE, self._table, op=MPI.MAX)
        self._lib.relate(*self._relate)

    def worst(self) -> tuple[str, float]:
        """Title of the part with the largest relative update, and that."""
        last = self._table[1]
        worst = int(np.argmax(last))
        return self.parts[worst].name, float(last[worst])

    def error(self, reason: str, advice: str | None = None) -> ConvergenceError:
        """The failure in words: the field that did not converge, and what to try.

        Args:
            reason: Why it is given up.
            advice: What to try; None: what helps the field.
        """
        if not self.iterations:
            return ConvergenceError(f"Newton failed: {reason}", field=None, norms={})
        last = self._table[1]
        part = self.parts[int(np.argmax(last))]
        return ConvergenceError(
            f"Newton failed after {self.iterations} iterations: {reason}; the {part.name} did "
            f"not converge (last relative update {np.max(last):.1e}); try {advice or part.advice}",
            field=part.name,
            norms={p.name: float(u) for p, u in zip(self.parts, last, strict=True)},
        )


def unknown_scales(system: BlockSystem) -> Floats:
    """Scale of the part of each unknown that this rank owns; one where there is none."""
    scales = np.ones(system.numbering.owned)
    for part, entries in owned_parts(system):
        scales[entries] = part.scale
    return scales


def owned_parts(system: BlockSystem) -> list[tuple[Part, Ints]]:
    """All parts, each with the places of its unknowns among those that this rank owns."""
    n, found = system.numbering, []
    for k, f in enumerate(system.fields):
        for part in f.parts:
            numbers = n.by_field[k][part.dofs] - n.start
            found.append((part, numbers[(numbers >= 0) & (numbers < n.owned)]))
    return found
