"""A run tells of motions along thin quadrilaterals that their elements hardly resist."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from shellmb.diagnostics.base import Caution, said_of
from shellmb.diagnostics.elements.hourglass import Unresisted
from shellmb.observers.fields.nodal import state
from shellmb.observers.summary import Sources
from shellmb.simulate.simulation import Silent, Simulation

# part of the displacement, but for rigid motions, that is false
BOUND = 0.02
# it costs next to nothing to look at every tenth step, and at the end
EVERY = 10


class UnresistedMotions(Silent):
    """Watches how far nodes of quadrilaterals move against one another without strains.

    Args:
        sources: The observers of the run.
    """

    name = "hourglass"

    def __init__(self, sources: Sources) -> None:
        self._looks: dict[str, Unresisted] = {}
        self._steps = 0
        # by body mean squares of these motions and of all but rigid ones, summed over all looks
        self._sums: dict[str, tuple[float, float]] = {}

    def start(self, simulation: Simulation) -> None:
        """Find the shells of quadrilaterals; collective."""
        looks = {name: Unresisted(body) for name, body in simulation.model.shells.items()}
        self._looks = {name: look for name, look in looks.items() if not look.triangles}
        self.idle = not self._looks

    def accepted(self, simulation: Simulation) -> None:
        """Look at every tenth step."""
        self._steps += 1
        if self._steps % EVERY == 0:
            self._look(simulation)

    def _look(self, simulation: Simulation) -> None:
        for name, look in self._looks.items():
            found = look.shares(state(simulation, name), small=simulation.scheme.linear)
            false, every = self._sums.get(name, (0.0, 0.0))
            self._sums[name] = false + float(found[0]), every + float(found[1])

    def cautions(self, simulation: Simulation) -> Iterator[Caution]:
        """A sentence for each shell; collective."""
        if self._steps % EVERY:
            self._look(simulation)
        for name, (false, every) in self._sums.items():
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

    def state(self) -> dict[str, Any]:
        """The sums so far."""
        return {"steps": self._steps, "sums": {n: list(s) for n, s in self._sums.items()}}

    def restore(self, state: dict[str, Any]) -> None:
        """Take them up."""
        self._steps = state["steps"]
        self._sums = {n: (s[0], s[1]) for n, s in state["sums"].items()}
