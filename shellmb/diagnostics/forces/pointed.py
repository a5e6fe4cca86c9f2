"""Reserve factors that are least where a point load acts, under which stresses have no limit."""

from shellmb.diagnostics.base import Cautions, Watch, said_of
from shellmb.simulate.simulation import Simulation


class Pointed(Watch):
    """Watches where reserve factors are least."""

    name = "singular stress"

    def cautions(self, simulation: Simulation) -> Cautions:
        """A sentence for each that is least at a point load."""
        for name, load in self.sources.reserves.at_loads().items():
            body = self.sources.reserves.critical(name).body
            says = (
                f"reserve '{name}' is least where a {load} acts on {said_of(simulation, body)}: it "
                "falls towards zero with each refinement there; leave the place out by where, or "
                "spread the load"
            )
            yield self.caution(body, None, None, says)
