"""Warnings about step control by error."""

import numpy as np

from shellmb.diagnostics.base import Cautions, Watch
from shellmb.simulate.simulation import Simulation
from shellmb.simulate.stepsize.control import ErrorSize

# a motion smaller than so many step errors is not known to a tenth of it
KNOWN = 10.0
# errors that add up to more step errors than these are said: the error was found to be up to 1.6
# times the sum, so that what is missed by more than three of them is
ADDED = 2.0


class StepErrors(Watch):
    """Watches for steps that could not be small enough, and motions too small to be controlled."""

    name = "step error"
    remembered = ("_largest",)

    def start(self, simulation: Simulation) -> None:
        """See whether steps follow their error."""
        self.idle = not isinstance(simulation.size, ErrorSize)

    def accepted(self, simulation: Simulation) -> None:
        """Take how far bodies are from where they were described, relative to their size."""
        for body in simulation.model.bodies:
            for part in body.parts:
                if part.name in body.kinematic and part.name in ("u", "w"):
                    values = simulation.problem.levels[body.name].q.x.array
                    moved = np.max(np.abs(values[body.mixed.dofs[part.name]]), initial=0.0)
                    self._note(self.name, float(moved) / part.scale, simulation.t)

    def cautions(self, simulation: Simulation) -> Cautions:
        """A sentence for each."""
        size = simulation.size
        if not isinstance(size, ErrorSize) or size.settings.step_error is None:
            return
        wanted = size.settings.step_error
        if size.coarse:
            why = (
                f"the solver's tolerance of {simulation.scene.solver.tolerance:g} hides smaller "
                "errors: use a larger step_error, or a smaller tolerance of the solver"
                if size.noise > wanted
                else f"no step may be below min_dt = {size.smallest:.2g} s: use a smaller one, or "
                "a larger step_error"
            )
            says = (
                f"{size.coarse} steps are off by up to {size.worst:.2g}, more than step_error="
                f"{wanted:g}; {why}"
            )
            yield self.caution(None, size.worst, wanted, says)
        yield from self._added(simulation, size)
        reach, _ = self._worst(simulation, self.name)
        if simulation.step and reach < KNOWN * wanted:
            says = (
                f"all bodies move by less than {reach:.1e} of their size: step_error={wanted:g}, "
                "which is relative to it, says little about their motion; use one of "
                f"about {1e-2 * reach:.0e}"
            )
            yield self.caution(None, reach, KNOWN * wanted, says)

    def _added(self, simulation: Simulation, size: ErrorSize) -> Cautions:
        """The step error is for each radian of the motion: what that makes of all of it."""
        allowed = size.settings.step_error
        if allowed is None or size.total <= ADDED * allowed:
            return
        found, scheme = size.total, simulation.scheme
        slows = scheme.rotations.slows
        behind = (
            f", and spinning bodies lag by up to {size.lag:.1e} more, because each step slows them"
            if slows
            else ""
        )
        wanted = f"{allowed**2 / found:.0e}"
        if slows:
            wanted += f", of {allowed**2 / (found + size.lag):.0e} where something spins"
        radians = "a radian" if size.radians == 1 else f"{size.radians:.1f} radians"
        says = (
            f"the errors of {simulation.step} steps may add up to {found:.1e} of the size of "
            f"bodies{behind}: step_error={allowed:g} is for {radians} of motion; for "
            f"errors of {allowed:g} in all use one of {wanted}"
        )
        yield self.caution(None, found, ADDED * allowed, says)
