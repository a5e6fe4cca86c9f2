"""Limit points of a static path whose loads are only those of a curve between two states."""

from __future__ import annotations

from collections.abc import Iterator

from shellmb.diagnostics.base import RunWarning
from shellmb.observers.summary import Sources
from shellmb.simulate.simulation import BaseObserver, Simulation


class LimitPoints(BaseObserver):
    """Looks whether all limit points of a path were located.

    Newton's method finds them where forces are smooth; contact that opens there has a corner.

    Args:
        sources: The observers of the run.
    """

    name = "limit points"

    def __init__(self, sources: Sources) -> None:
        pass

    def cautions(self, simulation: Simulation) -> Iterator[RunWarning]:
        """A sentence for the first one that was not."""
        path = simulation.path
        if path is None or not path.unsure:
            return
        yield RunWarning(
            self.name,
            None,
            float(len(path.unsure)),
            0.0,
            f"the limit point near the load factor {path.unsure[0]:.6g} was not located "
            f"({len(path.unsure)} in all): its load is that of a cubic between two states, which "
            "may be off by some per mille or more; use smaller steps (max_dt)",
        )
