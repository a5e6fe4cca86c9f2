"""Rates at the start of a step times the step, for schemes whose unknowns are such, too."""

from collections.abc import Sequence

import numpy as np

from shellmb.arrays import Floats
from shellmb.model.body import NodeLink
from shellmb.schemes.base import Levels
from shellmb.system.assembly.blocks import BlockSystem


class ScaledRates:
    """Fills `scaled` of all levels, that of nodes which are linked to other bodies, too.

    Joints have no velocities of their own: those of their nodes are the bodies'.

    Args:
        system: The block system.
        fields: Functions and stage of each of its fields.
        links: Links of each.
    """

    def __init__(
        self,
        system: BlockSystem,
        fields: Sequence[tuple[Levels, str]],
        links: Sequence[Sequence[NodeLink]],
    ) -> None:
        self._system = system
        # numbers of the rates, those to fill, and whether the field is of rates
        self._fields = list[tuple[Floats, Floats, bool]]()
        for levels, stage in fields:
            ((rate, scaled),) = levels.scaled.items()
            self._fields.append((levels.rates[rate].x.array, scaled.x.array, stage == rate))
        self._linked = {
            k: np.concatenate(dofs)
            for k, (levels, stage) in enumerate(fields)
            if stage in levels.scaled and (dofs := [link.dofs for link in links[k]])
        }
        self._vector = system.x.duplicate()
        self._any = bool(system.comm.allreduce(len(self._linked)))

    def take(self, dt: float) -> None:
        """Take the velocities of the bodies; collective.

        Args:
            dt: Length of the step, s.
        """
        system, found = self._system, []
        for rates, scaled, fills in self._fields:
            if fills:
                np.multiply(rates, dt, out=scaled)
            found.append(scaled)
        if not self._any:
            return
        for k, linked in self._linked.items():
            found[k][linked] = np.nan
        self._vector.array[:] = system.global_values(found, known=True)
        local = system.local_values(self._vector)
        for k, linked in self._linked.items():
            found[k][linked] = local[system.numbering.slice(k)][linked]
