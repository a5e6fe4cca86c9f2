"""A scene that turns steadily: its relative equilibrium at a rate, and the matrices about it."""

from __future__ import annotations

import math

from mpi4py import MPI

from dolfinx import fem

from shellmb.errors import ConvergenceError, SceneError
from shellmb.model.model import Model
from shellmb.preprocessing.checked_model import checked_model
from shellmb.preprocessing.constraint_analysis.redundancy import largest_gap
from shellmb.running.natural_modes.vibration import in_motion
from shellmb.running.rotating.axis import Axis, held
from shellmb.running.rotating.frame import RotatingFrame
from shellmb.running.rotating.linearised import Linearised
from shellmb.scene import Scene
from shellmb.schemes.base import Levels
from shellmb.simulate.start.start import OPEN

# a step to the next rate that fails is halved this many times
HALVINGS = 8

# Steps of the relaxation at one rate, and how far the last one moves, in scales of the bodies;
# where it moves no less than this before, round-off moves it. It has a longer `tau` where a step
# moves more than a tenth of what the one before did, and no other: forces hold no free motions, and
# their round-off moves bodies by its square.
STEPS, AT_REST, NEARLY = 60, 1e-10, 1e-7
SLOW, GROWTH = 0.1, 4.0


class SteadyRotation(Linearised):
    """A scene in a frame that turns about an axis.

    Args:
        scene: The scene; its scheme and its initial velocities do not matter, and all of it turns
            along (`check_steady`).
        axis: The axis.
        comm: Communicator.
        loaded: Whether its loads act, those of the time `t_end`.

    Raises:
        SceneError: If it cannot be built, or a joint is open.

    Attributes:
        model: Bodies.
        system: Block system, whose functions hold the relative equilibrium.
        rate: Rate of that equilibrium, rad/s.
    """

    def __init__(self, scene: Scene, axis: Axis, comm: MPI.Comm, loaded: bool) -> None:
        still = in_motion(held(scene))
        self.loaded, self.scene = loaded, scene
        model, _ = checked_model(still, comm)
        frames = {body.name: RotatingFrame(body, axis) for body in model.bodies}
        levels = {
            body.name: Levels(fem.Function(body.mixed.space), {}, {}, body.manifold.tangent)
            for body in model.bodies
        }
        _check_closed(model, levels)
        super().__init__(
            model, axis, frames, levels, float(still.t_end or 1.0) if loaded else 0.0, loaded
        )

    def go(self, rate: float) -> None:
        """Find the relative equilibrium at a rate, from that at the last one.

        Args:
            rate: Rate, rad/s.

        Raises:
            ConvergenceError: If there is none, or none is reached.
        """
        begin = 0.0 if math.isnan(self.rate) else self.rate
        done, part = 0.0, 1.0
        kept = {name: levels.q.x.array.copy() for name, levels in self.levels.items()}
        while done < 1.0:
            now = min(1.0, done + part)
            # forces grow with the square of the rate
            square = begin**2 + now * (rate**2 - begin**2)
            self.turn(math.copysign(math.sqrt(square), rate))
            try:
                self._settle()
            except ConvergenceError as error:
                part /= 2
                if part < 0.5**HALVINGS:
                    raise error.reworded(
                        f"modes: no relative equilibrium at {math.sqrt(square):.6g} rad/s: {error}"
                    ) from error
                for name, levels in self.levels.items():
                    levels.q.x.array[:] = kept[name]
                continue
            done = now
            for name, levels in self.levels.items():
                kept[name][:] = levels.q.x.array
        self.rate = rate
        self.turn(rate)

    def _settle(self) -> None:
        """Relax at the rate of the frames."""
        tau, before = self.relaxation.tau, math.inf
        for _ in range(STEPS):
            moved = self.relaxation.step(tau, float(self.loaded))
            if moved < AT_REST or before <= moved < NEARLY:
                return
            tau *= GROWTH if moved > SLOW * before else 1.0
            before = moved
        raise ConvergenceError(f"nothing came to rest in {STEPS} steps")


def _check_closed(model: Model, levels: dict[str, Levels]) -> None:
    q = {name: own.q for name, own in levels.items()}
    gap, name, said = largest_gap(model, q) if model.mechanism.joints else (0.0, "", "")
    if gap > OPEN:
        raise SceneError(
            f"joint '{name}': it is open by {said} in the given positions; move its bodies"
        )
