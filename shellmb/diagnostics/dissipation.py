"""The scheme dissipates a good part of the energy."""

from __future__ import annotations

from collections.abc import Iterator

from shellmb.diagnostics.base import RunWarning, remedies, said_of
from shellmb.observers.summary import Sources
from shellmb.simulate.simulation import BaseObserver, Simulation

# what is dissipated should be noise: frequencies that the step does not resolve
BOUND = 0.05


class Dissipation(BaseObserver):
    """Watches what the scheme itself dissipates; impacts, dampers and terms are not its doing.

    Args:
        sources: The observers of the run.
    """

    name = "dissipation"

    def __init__(self, sources: Sources) -> None:
        self._account = sources.energy

    def cautions(self, simulation: Simulation) -> Iterator[RunWarning]:
        """Decide whether the dissipation is out of proportion, and in which body."""
        share = self._account.dissipated_share
        if share <= BOUND:
            return
        dissipated = self._account.dissipated
        worst = max(dissipated, key=dissipated.__getitem__)
        part = dissipated[worst] / sum(dissipated.values())
        yield RunWarning(
            self.name,
            worst,
            share,
            BOUND,
            f"the scheme dissipates {share:.0%} of the energy that was present or supplied, "
            f"{part:.0%} of it in {said_of(simulation, worst)}: motion that the step does not "
            f"resolve; before you trust the rest, compare with "
            f"{remedies(simulation.scheme, 'a smaller step', 'a smaller alpha')}",
        )
