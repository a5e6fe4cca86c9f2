"""A step turns a body by more than the scheme can follow."""

from __future__ import annotations

from collections.abc import Iterator

from shellmb.diagnostics.base import RunWarning, Watch, said_of
from shellmb.simulate.simulation import Simulation


class LargeTurns(Watch):
    """Watches the angle of all bodies in a step against what the scheme says of itself."""

    name = "turning"

    def cautions(self, simulation: Simulation) -> Iterator[RunWarning]:
        """A sentence for each body that turns too far."""
        bound = simulation.scheme.rotations.largest
        for name, turn in self.sources.rotations.turns.items():
            if turn.largest > bound:
                dt = turn.dt * bound / turn.largest
                says = (
                    f"{said_of(simulation, name)} turns by {turn.largest:.2g} rad in the step to "
                    f"t = {turn.t:g} s; the scheme follows up to {bound:g} rad, to 5 per cent of "
                    f"the angle: use a step of at most {dt:.2g} s"
                )
                yield self.caution(name, turn.largest, bound, says)
