"""Columns of the history for readings and commands of controllers, and for events."""

from __future__ import annotations

from typing import Any

from shellmb.simulate.simulation import BaseObserver, Simulation

# what follows an event's name
ON = ".on"


class ControlColumns(BaseObserver):
    """`CONTROLLER.OUTPUT` of the step that ends, the readings it was made from, `EVENT.on`.

    Before the first step outputs are 0, and nothing has been read.
    """

    def start(self, simulation: Simulation) -> None:
        """Know what there is."""
        self._control = simulation.control

    def measure(self) -> dict[str, float]:
        """Columns of the history."""
        found: dict[str, float] = {}
        for sampler in self._control.samplers:
            who = sampler.law.name
            found |= {f"{who}.{name}": value for name, value in sampler.outputs.items()}
            found |= {f"{who}.{label}": value for label, value in sampler.readings.items()}
        return found | {f"{w.event.name}{ON}": float(w.on) for w in self._control.watches}


def control_summary(simulation: Simulation) -> dict[str, Any]:
    """Events with the times [s] at which they went on and off, for `summary.json`.

    Args:
        simulation: The simulation, at its end.
    """
    control = simulation.control
    if not control.watches:
        return {}
    events = {w.event.name: {"on": w.on, "times": list(w.times)} for w in control.watches}
    return {"events": events, "ended_by": control.ended}
