"""Linear or angular momentum changes by more than loads and supports explain."""

from __future__ import annotations

from collections.abc import Iterator

from shellmb.diagnostics.base import RunWarning, remedies, said_of
from shellmb.observers.account.momentum import KINDS
from shellmb.observers.summary import Sources
from shellmb.simulate.simulation import BaseObserver, Simulation

# what a scheme conserves it keeps as well as Newton's method solves, which over 100 000 steps adds
# up to some 1e-9; of what it does not conserve, one per cent is an error that shows in results
CONSERVED, OTHERS = 1e-6, 1e-2

# errors of rotations grow with their square: a drift of ten times the largest has another cause
ROTATION = 10.0


class Drift(BaseObserver):
    """Watches the balances of both momenta.

    Args:
        sources: The observers of the run.
    """

    name = "drift"

    def __init__(self, sources: Sources) -> None:
        self._momentum, self._rotations = sources.momentum, sources.rotations

    def cautions(self, simulation: Simulation) -> Iterator[RunWarning]:
        """Decide whether drifts are out of proportion; rotations that may be why are named."""
        turns = self._rotations.turns
        most = max(turns, key=lambda name: turns[name].largest, default=None)
        for kind, which in KINDS.items():
            drift = self._momentum.relative_drift(kind)
            bound = CONSERVED if kind in simulation.scheme.conserves else OTHERS
            if drift is None or drift <= bound:
                continue
            says = (
                f"{which} momentum has an unexplained error of {100 * drift:.2g} % (relative to "
                "the largest momentum or impulse)"
            )
            largest = 0.0 if most is None else turns[most].largest
            fastest = most if ROTATION * largest**2 > drift else None
            if fastest is not None:
                says += (
                    f"; {said_of(simulation, fastest)} turns most, by up to {largest:.2g} rad in a "
                    "step"
                )
            says += f": use {remedies(simulation.scheme, 'a smaller step')}"
            yield RunWarning(f"{which} momentum", fastest, drift, bound, says)
