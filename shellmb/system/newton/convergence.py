"""Convergence of Newton's method, judged part by part, its failures in words, and round-off."""

import math
from collections.abc import Sequence
from functools import cached_property

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Bools, Floats, Ints
from shellmb.errors import ConvergenceError
from shellmb.native.operations import part_sizes
from shellmb.native.reference import ComparedParts
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.assembly.fields import Part
from shellmb.system.direct.symmetry import sizes_of

# what relative updates of forces of constraints count in the error that a solution leaves behind:
# these do no work. Where bodies have resultants, they count fully: of stiff bodies forces of joints
# tell, too, whether motions are exact enough for the account of energy
IDLE = 0.1

# an update that is not smaller than this part of the smallest one so far makes no progress
PROGRESS = 0.5
# so many updates in a row without progress are looked at
STALLED = 2
# motion in an update, relative to the size of bodies, up to which they count as being at rest
STILL = 1e-6
# updates that round-off may make: beyond it forces have no digits that are worth a step
WORST = 1e-4
# residuals up to so many times the round-off of their terms are nothing else: in stalled solutions
# of mechanisms and plates it is 0.2 to 3, before the last iterations 1e5 and more
NOISE = 10.0
EPS = float(np.finfo(np.float64).eps)


class Convergence:
    """Judges an update part by part.

    Args:
        system: The block system.

    Attributes:
        iterations: Number of updates measured since `begin`.
        ratio: The last one over that before it; infinite where there is one only.
    """

    def __init__(self, system: BlockSystem) -> None:
        self.system = system
        found = owned_parts(system)
        self.parts = [part for part, _ in found]
        self._ends, self._entries = joined([entries for _, entries in found])
        self._scales = np.array([p.scale for p in self.parts])
        self._given = np.array([p.bound for p in self.parts])
        self._bounds = bounds = self._given.copy()
        idle = np.array([p.idle for p in self.parts], bool)
        # what follows from others has no scale
        other = np.isinf(bounds) & np.isfinite(self._scales) & ~idle
        weights = np.where(idle & ~np.any(other), IDLE, 1.0)
        given = self._ends, self._entries, self._scales, bounds, weights, np.zeros(len(bounds))
        self._sizes = part_sizes(ComparedParts(*given, least=1.0))
        self._serial = system.comm.size == 1
        self.begin()

    def begin(self) -> None:
        """A new solution."""
        self.iterations, self.ratio, self._largest = 0, math.inf, 0.0

    def widen(self, way: float) -> None:
        """Let updates be larger by a known distance [m] of free flight; the same on all ranks."""
        self._bounds[:] = self._given + way

    def measure(self, x: PETSc.Vec, dx: PETSc.Vec) -> tuple[float, float, float]:
        """Largest relative update of a part, of what must not move far, and by weights of parts.

        They are the same on all ranks.

        Raises:
            ConvergenceError: If the iteration diverges.
        """
        self._sizes.fill(x, dx)
        if not self._serial:
            # what is no number is infinite, and wins
            self.system.comm.Allreduce(MPI.IN_PLACE, self._sizes.table, op=MPI.MAX)
        self._sizes.relate()
        self.iterations += 1
        largest, moved, diverged, weighted = self._sizes.found.tolist()
        self.ratio = largest / self._largest if self._largest else math.inf
        self._largest = largest
        if diverged:
            raise self.error("the iteration diverged")
        return largest, moved, weighted

    def sizes(self, x: Floats, changes: Floats) -> Floats:
        """Largest relative changes of what moves and of other parts, the same on every rank.

        Args:
            x: Owned entries, shape (n,).
            changes: Several changes of them, shape (k, n).

        Returns:
            Shape (k, 2).
        """
        table = np.empty((len(changes) + 1, len(self.parts)))
        self._sizes.largest(x, table[0])
        self._sizes.largest(changes, table[1:])
        if not self._serial:
            self.system.comm.Allreduce(MPI.IN_PLACE, table, op=MPI.MAX)
        return self._sizes.relative(table[0], table[1:])

    def typical(self, x: Floats) -> Floats:
        """Size of the part of each unknown: its scale, or its largest value, and what is beside it.

        It is collective.

        Args:
            x: Owned entries, shape (n,).

        Returns:
            Shape (n,); of unknowns without a part, their own size.
        """
        found, sizes = np.abs(x), np.zeros(len(self.parts))
        self._sizes.largest(x, sizes)
        self.system.comm.Allreduce(MPI.IN_PLACE, sizes, op=MPI.MAX)
        scales = np.where(np.isfinite(self._scales), self._scales, 0.0)
        sizes = np.maximum(scales, sizes) + [part.beside for part in self.parts]
        found[self._entries] = np.repeat(sizes, np.diff(self._ends))
        return found

    @cached_property
    def judged(self) -> Bools:
        """Owned unknowns that are not of a part that follows from others, shape (n,)."""
        found = np.ones(self.system.numbering.owned, bool)
        found[self._entries] = np.repeat(np.isfinite(self._scales), np.diff(self._ends))
        return found

    @property
    def far(self) -> float:
        """Largest size of what is beside the values of a part, relative to its scale."""
        return max((part.beside / part.scale for part in self.parts), default=0.0)

    @property
    def moving(self) -> Ints:
        """Owned unknowns of parts that move: those that must not move far."""
        bounded = np.isfinite([part.bound for part in self.parts])
        return np.asarray(self._entries[np.repeat(bounded, np.diff(self._ends))])

    def worst(self) -> tuple[str, float]:
        """Title of the part with the largest relative update, and that."""
        last = self._sizes.table[1]
        worst = int(np.argmax(last))
        return self.parts[worst].name, float(last[worst])

    def error(self, reason: str, advice: str | None = None) -> ConvergenceError:
        """The failure in words: the field that did not converge, and what to try.

        Args:
            reason: Why it is given up.
            advice: What to try; None: what helps the field.
        """
        if not self.iterations:
            return ConvergenceError(f"Newton failed: {reason}")
        last = self._sizes.table[1]
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
    own, fields = system.numbering.own, enumerate(system.fields)
    return [(part, own(k, part.dofs)) for k, field in fields for part in field.parts]


def joined(lists: Sequence[Ints]) -> tuple[Ints, Ints]:
    """Lists one behind the other: where each begins and the last one ends, and all entries."""
    ends = np.cumsum([0, *map(len, lists)]).astype(np.int64)
    return ends, np.concatenate([*lists, np.zeros(0, np.int64)]).astype(np.int64)


class RoundOff:
    """Tells whether what is left of the equations is the round-off of their own terms.

    A row is a sum of terms. Each is known to its last digit at best, and an unknown that is wrong
    in its last digit changes row `i` by `eps |J_ij| size_j`. Where `|r_i|` is no larger than some
    multiple of the sum of these in all rows, the unknowns solve equations whose terms differ from
    the given ones by round-off (the componentwise backward error of W. Oettli and W. Prager,
    Numer. Math. 6 (1964) 405-409), and more iterations only find other such solutions. Near
    singular positions these differ by more than any tolerance in what is badly determined:
    multipliers.

    Args:
        system: The block system.
        convergence: Knows how large unknowns are.

    Attributes:
        found: What changed most in the last update of a solution that ended so, and by how much;
            nothing if it ended otherwise.
    """

    def __init__(self, system: BlockSystem, convergence: Convergence) -> None:
        self._system, self._convergence = system, convergence
        self.begin()

    def begin(self) -> None:
        """A new solution."""
        self.found: tuple[str, float] = ("", 0.0)
        self._best, self._stalled = math.inf, 0

    def is_all(self, update: float, moved: float, b: PETSc.Vec) -> bool:
        """Record an update; whether it and those before are nothing but round-off; collective.

        Args:
            update: Its size, relative to those of the parts.
            moved: How far it moved bodies, relative to their sizes.
            b: Residual at the state that the fields hold.
        """
        self._stalled = self._stalled + 1 if update >= PROGRESS * self._best else 0
        self._best = min(self._best, update)
        if update > WORST or moved > STILL or not self.is_left(b):
            return False
        self.found = self._convergence.worst()
        return True

    def is_left(self, b: PETSc.Vec) -> bool:
        """Decide whether updates make no progress and only round-off is left; collective.

        Args:
            b: Residual at the state that the fields hold.
        """
        return self._stalled >= STALLED and self.left(b) <= NOISE

    def left(self, b: PETSc.Vec) -> float:
        """Largest residual relative to the round-off of the row's terms; collective.

        Args:
            b: Residual at the state that the fields hold.
        """
        system = self._system
        system.jacobian(system.x, system.A)
        sizes, terms = system.A.createVecs()
        sizes.array[:] = self._convergence.typical(system.x.array_r)
        sizes_of(system.A).mult(sizes, terms)
        # rows without terms have none left
        noise = np.maximum(EPS * terms.array_r, np.finfo(float).tiny)
        # what follows from other unknowns, a change of velocities say, has the round-off of these,
        # which its own size does not tell
        rows = self._convergence.judged
        largest = float(np.max((np.abs(b.array_r) / noise)[rows], initial=0.0))
        return float(system.comm.allreduce(largest, op=MPI.MAX))
