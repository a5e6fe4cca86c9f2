"""Velocities at the ends of steps slip where they should roll."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from shellmb.model.joints.rolling import ContactGroup
from shellmb.model.joints.slipping import sliding
from shellmb.observers.summary import Sources
from shellmb.simulate.simulation import Silent, Simulation
from shellmb.watches.base import Caution

# part of the speeds that it is the difference of: with 0.1 rad in a step it is 4e-3 in EP
BOUND = 2e-2


class Slipping(Silent):
    """Looks at the end of a run at the slip of contacts, which schemes linear in time leave.

    Args:
        sources: The observers of the run.
    """

    name = "slipping"

    def __init__(self, sources: Sources) -> None:
        pass

    def cautions(self, simulation: Simulation) -> Iterator[Caution]:
        """The contacts that slip by more than that."""
        for group in simulation.model.mechanism.groups:
            if not isinstance(group, ContactGroup):
                continue
            levels = simulation.problem.levels[group.name]
            slips = sliding(group, levels.q.x.array, levels.rates["v"].x.array)
            shares = slips[:, 0] / np.maximum(slips[:, 1], 1e-300)
            mine = [(int(k), float(s)) for k, s in zip(group.nodes.item, shares, strict=True)]
            for item, share in sorted(
                {p for part in group.nodes.mesh.comm.allgather(mine) for p in part}
            ):
                if share > BOUND:
                    joint = group.joints[item].joint
                    yield Caution(
                        self.name,
                        joint.second,
                        share,
                        BOUND,
                        f"{joint.said} slips by {share:.1%} of its speeds at the end of the run: "
                        "use --scheme ep4, --scheme ed3 or a smaller step",
                    )
