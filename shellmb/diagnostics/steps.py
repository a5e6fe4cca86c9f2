"""Steps that are too long for what happens in them, or could not be as small as wanted.

Functions of time, and laws of motors, that jump within steps or vary faster than they resolve.

All schemes average what acts by Gauss' three points of a step. A jump counts from the next of these
points on: the impulse is off by up to a quarter of a step, and the run is of first order. Three
points in each half of the step show by how much. Motions that are given must not jump at all, at
ends of steps neither: no force can do that, and what the step makes of it depends on its length.

Steps turn bodies by more than the scheme can follow.

A stiff body spins under a scheme that stiff fibres do not follow.

Under ED the state j leaves the circle on which a fibre moves that does not stretch: eq. (31) works
against the stiff strain. The body loses spin, or takes it from what drives it, and the force along
the fibre is wrong, even in sign, while energy and linear momentum are balanced to round-off.

How stiff a body is for a step `h` tells the number `y = h c/r` of its wave speed `c` and its radius
of gyration `r` about the axis. Measured in a free plate (`schemes.base.Rotations`): of what a body
loses that does not stretch at all, the part `y^2/(y^2 + 40)`: 0.9 with y = 20, 0.28 with y = 4,
0.01 with y = 0.6.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from shellmb.arrays import Floats
from shellmb.diagnostics.base import Cautions, RunWarning, Watch, remedies, said_of
from shellmb.model.frames.beam import BeamModel
from shellmb.model.joints.coordinates import COLUMN
from shellmb.model.massless import LawValues
from shellmb.model.shells.shell import ShellModel
from shellmb.scene.control.signals import Signal
from shellmb.scene.lookup import said
from shellmb.schemes.base import GAUSS_TIMES, GAUSS_WEIGHTS
from shellmb.simulate.simulation import Simulation
from shellmb.simulate.stepsize import ErrorSize

# a motion smaller than so many step errors is not known to a tenth of it
KNOWN = 10.0
# errors that add up to more step errors than these are said: the error was found to be up to 1.6
# times the sum, so that what is missed by more than three of them is
ADDED = 2.0


# as of a drift that shows (`balances.OTHERS`)
BOUND = 1e-2

# part of an impulse that is said where it is off; of what is smooth in steps it is below 1e-5
MISSED = 1e-3
# points of a step, and what the mean over both halves is more than that over the whole
POINTS = np.concatenate([GAUSS_TIMES, GAUSS_TIMES / 2, 0.5 + GAUSS_TIMES / 2])
MORE = np.concatenate([-GAUSS_WEIGHTS, GAUSS_WEIGHTS / 2, GAUSS_WEIGHTS / 2])
# states at which laws are evaluated together
TOGETHER = 512
# points of a step at which a motion is looked at, and the parabola through the middle ones at ends
MOTION = np.array([0.0, *GAUSS_TIMES, 1.0])
ENDS = np.linalg.solve(np.vander(GAUSS_TIMES).T, np.vander([0.0, 1.0], 3).T).T
# part of the change in a step by which a motion is off that parabola if it jumps: half or more of a
# jump, 0.15 at most of a corner
LEAPS = 0.3
# parts of the whole motion, and of its size or a radian's or the scene's, below which a change is
# none, or round-off
SMALL, ROUND_OFF = 1e-3, 1e-12


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
        if size.total > ADDED * wanted:
            yield self._added(simulation, size, wanted)
        reach, _ = self._worst(simulation, self.name)
        if simulation.step and reach < KNOWN * wanted:
            says = (
                f"all bodies move by less than {reach:.1e} of their size: step_error={wanted:g}, "
                "which is relative to it, says little about their motion; use one of "
                f"about {1e-2 * reach:.0e}"
            )
            yield self.caution(None, reach, KNOWN * wanted, says)

    def _added(self, simulation: Simulation, size: ErrorSize, allowed: float) -> RunWarning:
        """The step error is for each radian of the motion: what that makes of all of it."""
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
        return self.caution(None, found, ADDED * allowed, says)


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


class Unresolved(Watch):
    """Looks at the end of a run at what acted between the points of its steps."""

    name = "unresolved in time"

    def cautions(self, simulation: Simulation) -> Cautions:
        """A sentence for each load and motor that steps do not resolve."""
        (t,) = self.columns("t")
        if not simulation.scheme.dynamic or len(t) < 2:
            return
        yield from self._jumps(simulation, t)
        # loads may share a function
        of_time = {id(load.time): (load, load.time) for load in simulation.scene.loads if load.time}
        for load, function in of_time.values():
            # they have no name of their own
            on = f" on '{load.body}'" if getattr(load, "body", None) else ""
            yield from self._caution(f"{said(load)}{on}", t, _factors(simulation, function, t))
        for group in simulation.model.mechanism.element_groups:
            if law := group.by_law(TOGETHER):
                for item in group.items:
                    column = f"{item.coordinate.joint}.{COLUMN[item.coordinate.kind]}"
                    values = _along(law, t, self.columns(column)[0])
                    yield from self._caution(said(item.element), t, values)

    def _jumps(self, simulation: Simulation, t: Floats) -> Cautions:
        """Say which motions that are given jump.

        Args:
            simulation: The run.
            t: Ends of steps, shape (n + 1,), s.
        """
        scene, at = simulation.scene, t[:-1, None] + np.diff(t)[:, None] * MOTION
        given = [(f"{said(part)}: {name}", value) for part, name, value in scene.prescribed]
        related: tuple[Any, ...] = (*scene.joints, *scene.couplings)
        given += [(said(part), value) for part in related for value in part.given]
        for who, value in given:
            # what is commanded is known in the run only
            if not callable(value) or isinstance(value, Signal):
                continue
            values = np.reshape([np.ravel(value(float(each))) for each in at.flat], (*at.shape, -1))
            change = np.ptp(values, axis=1)
            off = np.abs(values[:, ::4] - ENDS @ values[:, 1:4]).max(axis=1)
            size = max(np.abs(values).max(), min(1.0, simulation.model.length))
            least = max(SMALL * np.ptp(values, axis=(0, 1)).max(), ROUND_OFF * size)
            jumps = np.where((off > LEAPS * change) & (change > least), change, 0.0).max(axis=1)
            worst = int(np.argmax(jumps))
            if jumps[worst] > 0:
                says = (
                    f"{who} jumps by {jumps[worst]:.3g} from t = {t[worst]:.6g} to "
                    f"{t[worst + 1]:.6g}, which no force can do: velocities and forces behind it "
                    "depend on the step; let it change over several steps, as by Ramp"
                )
                yield self.caution(None, float(jumps[worst]), 0.0, says)

    def _caution(self, who: str, t: Floats, values: Floats) -> Cautions:
        """Say what is missed of an impulse, if it is much.

        Args:
            who: What acts.
            t: Ends of steps, shape (n + 1,), s.
            values: What acts at the points of steps, shape (n, points).
        """
        dt = np.diff(t)
        missed, size = np.abs(values @ MORE) * dt, np.abs(values[:, :3]) @ GAUSS_WEIGHTS * dt
        share = float(np.sum(missed) / max(np.sum(size), 1e-300))
        if not share > MISSED:
            return
        worst = int(np.argmax(missed))
        says = (
            f"{who} jumps within steps, or varies faster than they resolve, most from t = "
            f"{t[worst]:.6g} to {t[worst + 1]:.6g}: its impulse is off by about {share:.1%}, and "
            "the run is of first order, whatever the scheme; let a step end at each jump with "
            "StepControl(times=...), or use smaller steps"
        )
        yield self.caution(None, share, MISSED, says)


def _factors(simulation: Simulation, function: Callable[[float], float], t: Floats) -> Floats:
    """Values of a function of time at the points of all steps, shape (n, points)."""
    at = t[:-1, None] + np.diff(t)[:, None] * POINTS
    values = [simulation.problem.start_factor(float(each), function) for each in at.flat]
    return np.reshape(values, at.shape)


def _along(law: LawValues, t: Floats, x: Floats) -> Floats:
    """Values of a law at the points of all steps, along the way between their ends; collective.

    Args:
        law: The law.
        t: Ends of steps, shape (n + 1,), s.
        x: Coordinate there.
    """
    dt, change = np.diff(t)[:, None], np.diff(x)[:, None]
    rates = np.broadcast_to(change / dt, (len(dt), len(POINTS)))
    states = x[:-1, None] + change * POINTS, rates, t[:-1, None] + dt * POINTS
    return law(*(each.ravel() for each in states)).reshape(len(dt), -1)
