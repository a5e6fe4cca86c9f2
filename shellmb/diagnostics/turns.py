"""Steps turn bodies by more than the scheme can follow.

A stiff body spins under a scheme that stiff fibres do not follow.

Under ED the state j leaves the circle on which a fibre moves that does not stretch: eq. (31) works
against the stiff strain. The body loses spin, or takes it from what drives it, and the force along
the fibre is wrong, even in sign, while energy and linear momentum are balanced to round-off.

How stiff a body is for a step `h` tells the number `y = h c/r` of its wave speed `c` and its radius
of gyration `r` about the axis. Measured in a free plate (`schemes.base.Rotations`): of what a body
loses that does not stretch at all, the part `y^2/(y^2 + 40)`: 0.9 with y = 20, 0.28 with y = 4,
0.01 with y = 0.6.
"""

import numpy as np

from shellmb.diagnostics.base import Cautions, Watch, remedies, said_of
from shellmb.model.frames.beam import BeamModel
from shellmb.model.shells.shell import ShellModel
from shellmb.simulate.simulation import Simulation


class LargeTurns(Watch):
    """Watches the angle of all bodies in a step against what the scheme says of itself."""

    name = "turning"

    def cautions(self, simulation: Simulation) -> Cautions:
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


# as of a drift that shows (`balances.OTHERS`)
BOUND = 1e-2


class StiffSpin(Watch):
    """Says what shells and beams lose of their spin, as far as the scheme says that they do."""

    name = "stiff spin"

    def start(self, simulation: Simulation) -> None:
        """Let rotations follow it, by the wave speeds of the bodies."""
        self._loss = simulation.scheme.rotations.stiff_loss
        self.idle = self._loss == 0
        turns = self.sources.rotations.turns
        for name, body in simulation.model.meshed.items():
            if name in turns and not self.idle:
                turns[name].speed = _wave_speed(body)

    def cautions(self, simulation: Simulation) -> Cautions:
        """A sentence for each body that spins and is stiff."""
        for name, turn in self.sources.rotations.turns.items():
            dissipated = self._loss * turn.stiff
            if dissipated <= BOUND:
                continue
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


def _wave_speed(body: ShellModel | BeamModel) -> float:
    """Speed of longitudinal waves, m/s; infinite where nothing stretches, 0 without mass."""
    stiffness, mass = body.stretching
    if not mass > 0:
        return 0.0
    return float(np.sqrt(stiffness / mass)) if body.described.stretching else np.inf
