"""Sizes of derivatives of the unknowns, part by part, for the end of their iteration."""

from __future__ import annotations

from collections.abc import Container

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats
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
