"""Back to the start: measurements run the same steps again and again."""

from __future__ import annotations

from shellmb.simulate.simulation import Simulation


class Restart:
    """Puts a simulation back to where it is when this is made.

    Args:
        simulation: The simulation.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._start = simulation.arrays(), simulation.state()

    def __call__(self) -> None:
        """Be there again, with nothing left of what was learnt on the way."""
        self._simulation.restore(*self._start)
        self._simulation.problem.iteration.refresh.forget()
