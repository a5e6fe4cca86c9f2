"""A stiff body spins under a scheme that stiff fibres do not follow.

Under ED the state j leaves the circle on which a fibre moves that does not stretch: eq. (31) works
against the stiff strain. The body loses spin, or takes it from what drives it, and the force along
the fibre is wrong, even in sign, while energy and linear momentum are balanced to round-off.

How stiff a body is for a step `h` tells the number `y = h c/r` of its wave speed `c` and its radius
of gyration `r` about the axis. Measured in a free plate (`schemes.base.Rotations`): of what a body
loses that does not stretch at all, the part `y^2/(y^2 + 40)`: 0.9 with y = 20, 0.28 with y = 4,
0.01 with y = 0.6.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from shellmb.diagnostics.base import RunWarning, Watch, remedies, said_of
from shellmb.observers.account.sizes import stiffness_of
from shellmb.simulate.simulation import Simulation

HALF_STIFF = 40.0
# as of a drift that shows (`drift.OTHERS`)
BOUND = 1e-2


class StiffSpin(Watch):
    """Adds up what shells and beams lose of their spin, as far as the scheme says that they do."""

    name = "stiff spin"
    remembered = ("_dissipated",)

    def _begin(self) -> None:
        self._dissipated: dict[str, float] = {}
        self._speed: dict[str, float] = {}

    def start(self, simulation: Simulation) -> None:
        """Take the wave speeds of the bodies."""
        self._speed = {
            name: stiffness_of(body).wave_speed
            for name, body in simulation.model.meshed.items()
            if name in self.sources.rotations.turns
        }
        for name in self._speed:
            self._dissipated.setdefault(name, 0.0)
        self._loss = simulation.scheme.rotations.stiff_loss
        self.idle = self._loss == 0

    def accepted(self, simulation: Simulation) -> None:
        """Add the step."""
        assert simulation.last is not None
        for name, speed in self._speed.items():
            turn = self.sources.rotations.turns[name]
            if turn.radius > 0 and speed > 0:
                soft = turn.radius / (speed * simulation.last.dt)
                self._dissipated[name] += self._loss * turn.mean**2 / (1 + HALF_STIFF * soft**2)

    def cautions(self, simulation: Simulation) -> Iterator[RunWarning]:
        """A sentence for each body that spins and is stiff."""
        for name, dissipated in self._dissipated.items():
            if dissipated <= BOUND:
                continue
            turn = self.sources.rotations.turns[name]
            # what it loses in each step adds up by and by
            share = 1 - float(np.exp(-dissipated))
            step = f"a step of about {turn.dt * BOUND / dissipated:.1g} s"
            says = (
                f"{said_of(simulation, name)} is stiff for its step of {turn.dt:.2g} s and turns "
                f"by {turn.total:.2g} rad in all, up to {turn.largest:.2g} rad in a step: "
                f"{simulation.scheme.title} changes its spin, or what drives it, by about "
                f"{share:.0%}, and forces along it are wrong, even in sign; use "
                f"{remedies(simulation.scheme, "model='rigid'", step)}"
            )
            yield self.caution(name, share, BOUND, says)
