"""Rates at the start of a step, also where bodies are linked, for schemes whose rows take them."""

from collections.abc import Mapping, Sequence

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.model.body import Body
from shellmb.schemes.base import END, Levels
from shellmb.system.assembly.blocks import BlockSystem

type Pair = tuple[Floats, Floats]
# times the way that a speed at the start carries a body in a step it is no motion of it
FLOWN = 10.0
# an array, some of its places, and what belongs to them
type Pairs = tuple[Floats, Ints, Ints]


class Arrays:
    """Arrays of a body's functions, which DOLFINx looks up anew whenever it is asked.

    Args:
        levels: The functions.
    """

    def __init__(self, levels: Levels) -> None:
        self.q = levels.q.x.array
        self.rates, self.unknown, self.scaled = (
            {key: f.x.array for key, f in functions.items()}
            for functions in (levels.rates, levels.unknown, levels.scaled)
        )


class ScaledRates:
    """Fills `scaled` of all levels, that of nodes which are linked to other bodies, too.

    Joints and force elements have no velocities of their own: those of their nodes are the bodies'.
    Schemes that do not scale their rates keep these, and only what is linked is filled.

    Args:
        system: The block system.
        fields: Body, functions and stage of each of its fields.
        rate: One of the rates, of which what is linked is filled; None: `scaled` is.
    """

    def __init__(
        self,
        system: BlockSystem,
        fields: Sequence[tuple[Body, Levels, str]],
        rate: str | None = None,
    ) -> None:
        self._system = system
        # rates and what they fill; of these, where they are unknowns of this rank, and where others
        # link them
        self._filled, self._own, self._linked = list[Pair](), list[Pairs](), list[Pairs]()
        for k, (body, levels, stage) in enumerate(fields):
            if stage not in levels.scaled if rate is None else stage != END:
                continue
            scaled = (levels.scaled[stage] if rate is None else levels.rates[rate]).x.array
            linked = np.concatenate([*(link.dofs for link in body.links), np.zeros(0, np.int32)])
            if len(linked):
                places = int(system.numbering.offsets[k]) + linked
                self._linked.append((scaled, linked, places))
            if not body.kinematic:
                # multipliers have no rates
                continue
            if rate is None:
                self._filled.append((levels.rates[stage].x.array, scaled))
            dofs, numbers = system.owned(k)
            own = ~np.isin(dofs, linked)
            self._own.append((scaled, dofs[own], numbers[own]))
        self._any = bool(system.comm.allreduce(len(self._linked)))

    def take(self, dt: float) -> None:
        """Take the velocities of the bodies; collective.

        Args:
            dt: Length of the step, s.
        """
        for rates, scaled in self._filled:
            np.multiply(rates, dt, out=scaled)
        if not self._any:
            return
        unknowns = np.zeros(self._system.numbering.owned)
        for scaled, dofs, numbers in self._own:
            unknowns[numbers] = scaled[dofs]
        local = self._system.exchange.seen(unknowns)
        for scaled, dofs, places in self._linked:
            scaled[dofs] = local[places]


def flight(bodies: Sequence[Body], levels: Mapping[str, Levels], dt: float) -> float:
    """A distance that no body moves in a step, by its speed at the start, m; collective.

    Args:
        bodies: The bodies.
        levels: Their functions.
        dt: Length of the step, s.
    """
    moving = [b for b in bodies if "u" in b.kinematic]
    speeds = [levels[b.name].rates["v"].x.array[b.mixed.dofs["u"]] for b in moving]
    here = max((float(np.abs(v).max(initial=0.0)) for v in speeds), default=0.0)
    return FLOWN * dt * float(bodies[0].mixed.space.mesh.comm.allreduce(here, op=MPI.MAX))
