"""Unknowns at both sides of a run, differences of their residuals, and sizes of their changes.

In one process an update is one call of `sides.c`: of small systems half of the time was spent
between calls.
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
    """

    system: BlockSystem

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
    # what BETWEEN has found, the sum of both residuals being as it was then
    SINCE = 2
    # of second order where both sides mirror each other
    SUM = 3


class TwoSided:
    """Scenes whose unknowns are those of the run, and `d` more and less.

    Args:
        sides: The scenes above and below.
        u: Unknowns of the run, whose values change.
        sizes: Compares changes of `d` with it.
        distance: Relative distance of the sides from the run. Right-hand sides and solutions are
            of the size of the unknowns by it: what the run corrects by the way is round-off of
            these.

    Attributes:
        d: Half the difference of the unknowns.
        is_one: Whether one call of C does an update.
    """

    is_one = False

    def __init__(self, sides: tuple[Side, Side], u: Floats, sizes: Sizes, distance: float) -> None:
        self._distance, self._factor = distance, 0.5 / distance
        self._sides, self._u, self._sizes = sides, u, sizes
        self.d, self._sum = np.zeros((2, len(u)))

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
        if kind in (Kind.BETWEEN, Kind.SUM):
            self._sum[:] = above + self._sides[1].residual(self._u - self.d)
        if kind is Kind.SUM:
            found = self._sum
        else:
            # of BETWEEN it is `above - below`
            found = 2.0 * above - (0.0 if kind is Kind.ABOVE else self._sum)
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
    """Both sides in one process, each evaluated by one call of C; arguments as of `TwoSided`."""

    is_one = True

    def __init__(self, sides: tuple[Side, Side], u: Floats, sizes: Sizes, distance: float) -> None:
        super().__init__(sides, u, sizes, distance)
        self._lib, self._pointer = native.cells().lib, (pointer := CArrays())

        def side(system: BlockSystem) -> Any:
            vectors = {"x": pointer(system.x.array), "b": pointer(system.b.array)}
            return pointer.many("OneSide", [{"evaluation": system.evaluation, **vectors}])

        members = {
            "size": len(u),
            "above": side(sides[0].system),
            "below": side(sides[1].system),
            "d": pointer(self.d),
            "sum": pointer(self._sum),
            **{name: pointer(np.zeros(len(u))) for name in ("rest", "change")},
        }
        self._where = pointer.many("BothSides", [members]), sizes.parts.struct
        self._unknowns = pointer(u)

    def update(self, kind: Kind, taken: bool, solution: tuple[Any, ...]) -> float:
        """Do both, with the solution between them."""
        scales = self._unknowns, self._factor, self._distance
        return float(self._lib.update_both(*self._where, kind, taken, *scales, *solution))


def two_sided(sides: tuple[Side, Side], u: Floats, sizes: Sizes, distance: float) -> TwoSided:
    """Make both sides of a run; arguments as of `TwoSided`."""
    systems = [side.system for side in sides]
    one = all(system.evaluation is not None and not system.couplings for system in systems)
    return (SerialTwoSided if one else TwoSided)(sides, u, sizes, distance)
