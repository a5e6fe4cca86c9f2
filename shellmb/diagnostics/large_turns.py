"""A step turns a body by more than the scheme can follow."""

from __future__ import annotations

from collections.abc import Iterator

from shellmb.diagnostics.base import RunWarning, said_of
from shellmb.observers.summary import Sources
from shellmb.simulate.simulation import BaseObserver, Simulation


class LargeTurns(BaseObserver):
    """Watches the angle of all bodies in a step against what the scheme says of itself.

    Args:
        sources: The observers of the run.
    """

    name = "turning"

    def __init__(self, sources: Sources) -> None:
        self._rotations = sources.rotations

    def cautions(self, simulation: Simulation) -> Iterator[RunWarning]:
        """A sentence for each body that turns too far."""
        bound = simulation.scheme.rotations.largest
        for name, turn in self._rotations.turns.items():
            if turn.largest > bound:
                dt = turn.dt * bound / turn.largest
                yield RunWarning(
                    self.name,
                    name,
                    turn.largest,
                    bound,
                    f"{said_of(simulation, name)} turns by {turn.largest:.2g} rad in the step to "
                    f"t = {turn.t:g} s; the scheme follows up to {bound:g} rad, to 5 per cent of "
                    f"the angle: use a step of at most {dt:.2g} s",
                )
