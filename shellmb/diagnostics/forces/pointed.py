"""Reserve factors that are least where a point load acts, under which stresses have no limit."""

from __future__ import annotations

from collections.abc import Iterator

from shellmb.diagnostics.base import RunWarning, said_of
from shellmb.observers.summary import Sources
from shellmb.simulate.simulation import BaseObserver, Simulation


class Pointed(BaseObserver):
    """Watches where reserve factors are least.

    Args:
        sources: The observers of the run.
    """

    name = "singular stress"

    def __init__(self, sources: Sources) -> None:
        self._reserves = sources.reserves

    def cautions(self, simulation: Simulation) -> Iterator[RunWarning]:
        """A sentence for each that is least at a point load."""
        for name, load in self._reserves.at_loads().items():
            yield RunWarning(
                self.name,
                self._reserves.critical(name).body,
                None,
                None,
                f"reserve '{name}' is least where a {load} acts on "
                f"{said_of(simulation, self._reserves.critical(name).body)}: it falls towards zero "
                "with each refinement there; leave the place out by where, or spread the load",
            )
