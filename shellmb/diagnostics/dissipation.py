"""The scheme dissipates a good part of the energy."""

from __future__ import annotations

from collections.abc import Iterator

from shellmb.diagnostics.base import RunWarning, Watch, remedies, said_of
from shellmb.simulate.simulation import Simulation

# what is dissipated should be noise: frequencies that the step does not resolve
BOUND = 0.05


class Dissipation(Watch):
    """Watches what the scheme itself dissipates; impacts, dampers and terms are not its doing."""

    name = "dissipation"

    def cautions(self, simulation: Simulation) -> Iterator[RunWarning]:
        """Decide whether the dissipation is out of proportion, and in which body."""
        share = self.sources.energy.dissipated_share
        if share <= BOUND:
            return
        dissipated = self.sources.energy.dissipated
        worst = max(dissipated, key=dissipated.__getitem__)
        part = dissipated[worst] / sum(dissipated.values())
        says = (
            f"the scheme dissipates {share:.0%} of the energy that was present or supplied, "
            f"{part:.0%} of it in {said_of(simulation, worst)}: motion that the step does not "
            f"resolve; before you trust the rest, compare with "
            f"{remedies(simulation.scheme, 'a smaller step', 'a smaller alpha')}"
        )
        yield self.caution(worst, share, BOUND, says)
