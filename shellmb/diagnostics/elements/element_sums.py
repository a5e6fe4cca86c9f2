"""Sums over a run, or the most, of what its elements do."""

from __future__ import annotations

from shellmb.observers.summary import Sources
from shellmb.simulate.simulation import BaseObserver, Simulation

# what elements do does not come and go: it costs next to nothing to look at every tenth step
EVERY = 10


class Summed(BaseObserver):
    """Looks at every tenth step and at the end; to inherit from.

    Args:
        sources: The observers of the run.
    """

    remembered = ("_steps", "_sums")

    def __init__(self, sources: Sources) -> None:
        self._steps = 0
        self._sums: dict[str, tuple[float, ...]] = {}

    def _added(self, simulation: Simulation) -> dict[str, tuple[float, ...]]:
        """By body what was so far with what is in this state; changes nothing; collective."""
        raise NotImplementedError

    def accepted(self, simulation: Simulation) -> None:
        """Look at every tenth step."""
        self._steps += 1
        if self._steps % EVERY == 0:
            self._sums = self._added(simulation)

    def _all(self, simulation: Simulation) -> dict[str, tuple[float, ...]]:
        """By body the sums with those of the last step; changes nothing; collective."""
        return self._added(simulation) if self._steps % EVERY else self._sums
