"""Linear or angular momentum changes by more than loads and supports explain."""

from __future__ import annotations

from collections.abc import Iterator

from shellmb.diagnostics.base import RunWarning, Watch, remedies, said_of
from shellmb.observers.account.momentum import KINDS
from shellmb.simulate.simulation import Simulation

# what a scheme conserves it keeps as well as Newton's method solves, which over 100 000 steps adds
# up to some 1e-9; of what it does not conserve, one per cent is an error that shows in results
CONSERVED, OTHERS = 1e-6, 1e-2

# errors of rotations grow with their square: a drift of ten times the largest has another cause
ROTATION = 10.0


class Drift(Watch):
    """Watches the balances of both momenta."""

    name = "drift"

    def cautions(self, simulation: Simulation) -> Iterator[RunWarning]:
        """Decide whether drifts are out of proportion; rotations that may be why are named."""
        turns = self.sources.rotations.turns
        most = max(turns, key=lambda name: turns[name].largest, default=None)
        for kind, which in KINDS.items():
            drift = self.sources.momentum.relative_drift(kind)
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
