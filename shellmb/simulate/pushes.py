"""Velocities at the start of a step times the step, for schemes that are quadratic in time."""

from collections.abc import Sequence

import numpy as np

from shellmb.model.body import NodeLink
from shellmb.schemes.base import Levels
from shellmb.system.assembly.blocks import BlockSystem


class Pushes:
    """Fills `push` of all levels, that of nodes which are linked to other bodies, too.

    Joints have no velocities of their own: those of their nodes are the bodies'.

    Args:
        system: The block system.
        fields: Functions of each of its fields, and whether the field is one of velocities.
        links: Links of each.
    """

    def __init__(
        self,
        system: BlockSystem,
        fields: Sequence[tuple[Levels, bool]],
        links: Sequence[Sequence[NodeLink]],
    ) -> None:
        self._system, self._fields = system, list(fields)
        self._linked = {
            k: np.concatenate(dofs)
            for k, (levels, rates) in enumerate(fields)
            if rates and (dofs := [link.dofs for link in links[k]])
        }
        self._vector = system.x.duplicate()
        self._any = bool(system.comm.allreduce(len(self._linked)))

    def take(self, dt: float) -> None:
        """Take the velocities of the bodies; collective.

        Args:
            dt: Length of the step, s.
        """
        system, found = self._system, []
        for levels, rates in self._fields:
            assert levels.push is not None
            if rates:
                np.multiply(levels.rates["v"].x.array, dt, out=levels.push.x.array)
            found.append(levels.push.x.array)
        if not self._any:
            return
        for k, linked in self._linked.items():
            found[k][linked] = np.nan
        self._vector.array[:] = system.global_values(found, known=True)
        local = system.local_values(self._vector)
        for k, linked in self._linked.items():
            found[k][linked] = local[system.numbering.slice(k)][linked]
