"""Watches that need not look at each step."""

from __future__ import annotations

from typing import ClassVar

from shellmb.diagnostics.base import Watch
from shellmb.observers.account.energy import Scalar, scalar
from shellmb.schemes.linearised import strain_energy
from shellmb.simulate.simulation import Simulation

# what elements do does not come and go: it costs next to nothing to look at every tenth step
EVERY = 10


class Sampled(Watch):
    """Looks at every tenth step; to inherit from."""

    remembered: ClassVar[tuple[str, ...]] = ("_steps",)

    def _begin(self) -> None:
        self._steps = 0

    def _look(self, simulation: Simulation) -> None:
        """Take a state; collective."""
        raise NotImplementedError

    def accepted(self, simulation: Simulation) -> None:
        """Look at every tenth step."""
        self._steps += 1
        if self._steps % EVERY == 0:
            self._look(simulation)


def energy_of(simulation: Simulation, name: str) -> Scalar:
    """Gives the strain energy of a shell, J; collective."""
    form = strain_energy(simulation.model.shells[name], simulation.problem.levels[name])
    energy = scalar([form], simulation.model.comm)
    assert energy is not None
    return energy
