"""Unknowns at both sides of a run, differences of their residuals, and sizes of their changes.

In one process one call of `sides.c` each: of small systems half of the time was spent between
calls.
"""

from collections.abc import Container
from enum import IntEnum
from typing import Any, Protocol

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Floats
from shellmb.native import library as native
from shellmb.native.library import CArrays
from shellmb.native.operations import part_sizes
from shellmb.native.reference import ComparedParts
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.newton.convergence import joined, owned_parts

# that C works with
VECTORS = "change", "one", "central", "rest", "solution"
# forces follow from motions by stiffnesses: so many times the change of motions is as good
FORCES = 1e-2
# a part whose derivatives are smaller than this share of the largest ones, each in its unit, is
# round-off of these
LEAST = 1e-4
# differences of both sides below this, in their units, are compared with it: unknowns are known to
# 1e-16 of their units, and better than to 1e-5 of this nothing can be
SMALL = 1e-9


class Side(Protocol):
    """A scene at one side.

    Attributes:
        system: Its block system.
        at_once: Whether one call of C evaluates it, and one normalises its directors.
        members: For C, its evaluation and what normalises its directors, if it is `at_once`.
    """

    system: BlockSystem

    @property
    def at_once(self) -> bool: ...  # noqa: D102
    @property
    def members(self) -> tuple[Any, list[Any]]: ...  # noqa: D102

    def project(self, unknowns: Floats) -> Floats:
        """Unknowns near given ones that keep constraints of directors, and fixed values."""
        ...

    def residual(self, unknowns: Floats) -> Floats:
        """Residual at given unknowns, the same array at each call; collective."""
        ...

    def hold(self, unknowns: Floats) -> None:
        """Give the fields their unknowns."""
        ...


class Sizes:
    """Compares changes of derivatives with these, part by part.

    Args:
        system: The block system of the run.
        untested: Titles of parts that are not compared.

    Attributes:
        parts: How changes and sizes of parts are compared.
    """

    def __init__(self, system: BlockSystem, untested: Container[str] = ()) -> None:
        # jumps of velocities follow from the states
        found = [(p, e) for p, e in owned_parts(system) if np.isfinite(p.scale)]
        self._comm = system.comm
        scales = np.array([p.scale for p, _ in found])
        # sizes are compared in the units of each
        moves = np.isfinite([p.bound for p, _ in found])
        counts = np.where(moves, 1.0, FORCES)
        counts[[p.name in untested for p, _ in found]] = 0.0
        unbounded, moving = np.full(len(found), np.inf), LEAST * moves / scales
        joint = joined([e for _, e in found])
        self.parts = part_sizes(ComparedParts(*joint, scales, unbounded, counts, moving, SMALL))

    def relative(self, change: Floats, whole: Floats) -> float:
        """Largest change of a part relative to the whole of it; the same on all ranks.

        Args:
            change: Change of the difference of both sides.
            whole: The difference.

        Returns:
            The change; infinite where one of both is no number.
        """
        self.parts.largest(np.stack([change, whole]), self.parts.table)
        self._comm.Allreduce(MPI.IN_PLACE, self.parts.table, op=MPI.MAX)
        self.parts.relate()
        return float(self.parts.found[3])


class Kind(IntEnum):
    """Differences of residuals."""

    # the residual of the run is zero, so that twice this is one of first order
    ABOVE = 0
    BETWEEN = 1
    # what BETWEEN has found, and twice the change of the residual above since
    SINCE = 2
    # of second order where both sides mirror each other
    SUM = 3


class TwoSided:
    """Scenes whose unknowns are those of the run, and `d` more and less, on any number of ranks.

    Arguments are those of `two_sided`.

    Attributes:
        d: Half the difference of the unknowns.
        is_one: Whether one call of C does an update.
    """

    is_one = False

    def __init__(self, sides: tuple[Side, Side], u: Floats, sizes: Sizes, distance: float) -> None:
        self._distance, self._factor = distance, 0.5 / distance
        self._sides, self._u, self._sizes = sides, u, sizes
        self.d = np.zeros(len(u))
        self._one, self._central = self.d, self.d

    def keep(self) -> None:
        """Make `d` keep the constraints of both sides to first order."""
        above, below = self._sides
        self.d[:] = 0.5 * (above.project(self._u + self.d) - below.project(self._u - self.d))

    def rest(self, kind: Kind, rest: PETSc.Vec) -> None:
        """Find a difference of residuals.

        Args:
            kind: Which one.
            rest: Gets it over twice the distance.
        """
        above = self._sides[0].residual(self._u + self.d)
        if kind is Kind.ABOVE:
            found = 2.0 * above
        elif kind is Kind.SINCE:
            found = self._central + 2.0 * (above - self._one)
        else:
            one = above.copy()
            below = self._sides[1].residual(self._u - self.d)
            found = one + below if kind is Kind.SUM else one - below
            if kind is Kind.BETWEEN:
                self._one, self._central = one, found
        rest.array[:] = self._factor * found

    def move(self, change: PETSc.Vec, taken: bool = True) -> float:
        """Take a change from `d`; its size relative to that of `d`; collective.

        Args:
            change: The change over the distance.
            taken: Whether it is taken, and not only compared.
        """
        moved = self._distance * change.array_r
        if taken:
            self.d -= moved
        return self._sizes.relative(moved, self.d)

    def update(self, kind: Kind, taken: bool, solution: tuple[Any, ...]) -> float:
        """Do both, with the solution between them, in one call where there `is_one`.

        Args:
            kind: As of `rest`.
            taken: As of `move`.
            solution: For C, a solution.
        """
        raise NotImplementedError

    def hold(self) -> None:
        """Give the fields of both sides their unknowns."""
        above, below = self._sides
        above.hold(self._u + self.d)
        below.hold(self._u - self.d)


class SerialTwoSided(TwoSided):
    """Both sides in one process; arguments as of `two_sided`."""

    is_one = True

    def __init__(self, sides: tuple[Side, Side], u: Floats, sizes: Sizes, distance: float) -> None:
        self._distance, self._factor = distance, 0.5 / distance
        self._lib, pointer = native.cells().lib, CArrays()
        # what it points to
        self._kept = pointer, sides
        self._sizes, self.d = sizes, np.zeros(len(u))

        def side(given: Side) -> Any:
            (evaluation, turnings), system = given.members, given.system
            members = {
                "evaluation": evaluation,
                "sets": len(turnings),
                "set": pointer.many("Turning *", turnings),
                "x": pointer(system.x.array),
                "b": pointer(system.b.array),
            }
            return pointer.many("OneSide", [members])

        members = {
            "size": len(u),
            "above": side(sides[0]),
            "below": side(sides[1]),
            "d": pointer(self.d),
            **{name: pointer(np.zeros(len(u))) for name in VECTORS},
        }
        self._where = pointer.many("BothSides", [members]), pointer(u)

    def keep(self) -> None:
        """Make `d` keep the constraints of both sides to first order."""
        self._lib.keep_both(*self._where)

    def rest(self, kind: Kind, rest: PETSc.Vec) -> None:
        """Find a difference of residuals."""
        both, u = self._where
        self._lib.rest_of(both, kind, u, self._factor, native.entries(rest, True))

    def move(self, change: PETSc.Vec, taken: bool = True) -> float:
        """Take a change from `d`; its relative size."""
        both, parts = self._where[0], self._sizes.parts.struct
        numbers = native.entries(change)
        return float(self._lib.move_both(both, parts, taken, self._distance, numbers))

    def update(self, kind: Kind, taken: bool, solution: tuple[Any, ...]) -> float:
        """Do both, with the solution between them."""
        (both, u), parts = self._where, self._sizes.parts.struct
        scales = self._factor, self._distance
        return float(self._lib.update_both(both, parts, kind, taken, u, *scales, *solution))

    def hold(self) -> None:
        """Give the fields of both sides their unknowns."""
        self._lib.hold_both(*self._where)


def two_sided(sides: tuple[Side, Side], u: Floats, sizes: Sizes, distance: float) -> TwoSided:
    """Make both sides of a run.

    Args:
        sides: The scenes above and below.
        u: Unknowns of the run, whose values change.
        sizes: Compares changes of `d` with it.
        distance: Relative distance of the sides from the run. Right-hand sides and solutions are
            of the size of the unknowns by it: what the run corrects by the way is round-off of
            these.
    """
    plain = all(side.at_once for side in sides)
    return (SerialTwoSided if plain else TwoSided)(sides, u, sizes, distance)
