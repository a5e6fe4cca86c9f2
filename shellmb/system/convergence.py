"""Convergence of Newton's method, judged part by part, and its failures in words."""

from __future__ import annotations

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import numpy.typing as npt

from shellmb.errors import ConvergenceError
from shellmb.system.assembly import BlockSystem
from shellmb.system.fields import Part

Floats = npt.NDArray[np.float64]


class Convergence:
    """Judges an update part by part.

    Args:
        system: The block system.
    """

    def __init__(self, system: BlockSystem) -> None:
        self.system = system
        self.parts = [p for f in system.fields for p in f.parts]
        dofs = [_owned(system, k, p) for k, f in enumerate(system.fields) for p in f.parts]
        some = [k for k, d in enumerate(dofs) if len(d)]
        self._some = np.array(some, dtype=np.int64)
        self._dofs = np.concatenate([*(dofs[k] for k in some), np.zeros(0, np.int64)])
        self._starts = np.cumsum([0, *(len(dofs[k]) for k in some)])[:-1].astype(np.int64)
        self._scales = np.array([p.scale for p in self.parts])
        self._bounds = np.array([p.bound for p in self.parts])
        self._moving = np.isfinite(self._bounds)
        self.history: list[tuple[Floats, Floats]] = []

    def begin(self) -> None:
        """A new solution."""
        self.history = []

    def measure(self, x: PETSc.Vec, dx: PETSc.Vec) -> tuple[float, float]:
        """Largest relative update of a part, and of what must not move far; on all ranks the same.

        Raises:
            ConvergenceError: If the iteration diverges.
        """
        relative, update = self._sizes(x.array_r, dx.array_r)
        self.history.append((relative, update))
        if not np.all(update < self._bounds):
            raise self.error("the iteration diverged")
        moved = np.max(update / self._scales, where=self._moving, initial=0.0)
        return float(relative.max(initial=0.0)), float(moved)

    def size(self, x: Floats, dx: Floats) -> float:
        """Largest relative change of a part; owned entries, the same on every rank."""
        return float(self._sizes(x, dx)[0].max(initial=0.0))

    def _sizes(self, x: Floats, dx: Floats) -> tuple[Floats, Floats]:
        """Changes of the parts, relative to their scales or own sizes, and as they are."""
        table = np.zeros((2, len(self.parts)))
        if len(self._some):
            for row, values in enumerate((dx, x)):
                entries = np.abs(values[self._dofs])
                table[row, self._some] = np.maximum.reduceat(entries, self._starts)
        # a NaN must win the reduction
        table[~np.isfinite(table)] = np.inf
        if self.system.comm.size > 1:
            self.system.comm.Allreduce(MPI.IN_PLACE, table, op=MPI.MAX)
        update, size = table
        scale = np.maximum(self._scales, size)
        # infinite where the change is, whatever the scale
        with np.errstate(invalid="ignore"):
            relative = np.where(np.isfinite(update), update / scale, np.inf)
        return relative, update

    def error(self, reason: str) -> ConvergenceError:
        """The failure in words: the field that did not converge, and what to try."""
        if not self.history:
            return ConvergenceError(f"Newton failed: {reason}", field=None, norms={})
        last = self.history[-1][0]
        worst = int(np.argmax(last))
        part = self.parts[worst]
        return ConvergenceError(
            f"Newton failed after {len(self.history)} iterations: {reason}; the {part.name} did "
            f"not converge (last relative update {last[worst]:.1e}); try {part.advice}",
            field=part.name,
            norms={p.name: float(u) for p, u in zip(self.parts, last, strict=True)},
        )


def _owned(system: BlockSystem, field: int, part: Part) -> npt.NDArray[np.int64]:
    """Places of a part's unknowns among those that this rank owns."""
    n = system.numbering
    numbers = n.by_field[field][part.dofs] - n.start
    return np.asarray(numbers[(numbers >= 0) & (numbers < n.owned)])
