"""A run tells of motions along thin quadrilaterals that their elements hardly resist."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from shellmb.diagnostics.base import Caution, said_of
from shellmb.diagnostics.elements.hourglass import Unresisted
from shellmb.diagnostics.elements.summed import Summed
from shellmb.observers.fields.nodal import state
from shellmb.observers.summary import Sources
from shellmb.simulate.simulation import Simulation

# part of the displacement, but for rigid motions, that is false
BOUND = 0.02


class UnresistedMotions(Summed):
    """Watches how far nodes of quadrilaterals move against one another without strains.

    Args:
        sources: The observers of the run.
    """

    name = "hourglass"

    def __init__(self, sources: Sources) -> None:
        super().__init__(sources)
        self._looks: dict[str, Unresisted] = {}

    def start(self, simulation: Simulation) -> None:
        """Find the shells of quadrilaterals; collective."""
        looks = {name: Unresisted(body) for name, body in simulation.model.shells.items()}
        self._looks = {name: look for name, look in looks.items() if not look.triangles}
        self.idle = not self._looks

    def _added(self, simulation: Simulation) -> dict[str, tuple[float, ...]]:
        """Mean squares of these motions and of all but rigid ones; collective."""
        sums = dict(self._sums)
        for name, look in self._looks.items():
            found = look.shares(state(simulation, name), small=simulation.scheme.linear)
            false, every = sums.get(name, (0.0, 0.0))
            sums[name] = false + float(found[0]), every + float(found[1])
        return sums

    def cautions(self, simulation: Simulation) -> Iterator[Caution]:
        """A sentence for each shell; collective."""
        for name, (false, every) in self._all(simulation).items():
            part = float(np.sqrt(false / every)) if every > 0 else 0.0
            if part > BOUND:
                yield Caution(
                    self.name,
                    name,
                    part,
                    BOUND,
                    f"nodes of {said_of(simulation, name)} move against one another within each "
                    f"element, which its elements hardly resist, by {100 * part:.2g} % of its "
                    "displacement (root mean squares, without rigid motions): that part is false; "
                    "use more elements, also across its width",
                )
