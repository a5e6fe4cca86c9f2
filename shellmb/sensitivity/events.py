"""Times that move with parameters: of events, at which steps beside the run end, and of corners.

In a step of the run that an event has cut, the margin `g` of its condition is zero at the end. So
it is at both sides, whose steps then have other lengths:

    g(u(h); s, p, h) = 0,       h' = -g' at the same length / (dg/dh)

The next step ends where that of the run does: rows behind an event are at fixed times. Both steps
are found from three solutions, with the length of the run, a longer and a shorter one: derivatives
are linear in the change of the length. The square of it, which counts where the state at the start
depends on the parameter, drops out; the cube is that of a small unit.

A step takes loads at a few instants, and motions at its end. Where a function of time has a corner
just there, as a ramp that begins then, a later corner gives another slope than an earlier one.
Differences of both sides are the mean of both slopes, so the run warns of corners.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import ConvergenceError, SceneError
from shellmb.scene import Scene
from shellmb.scene.checks.schemes import functions_of_time
from shellmb.scene.control.signals import Signal, Switched
from shellmb.scene.lookup import listed
from shellmb.sensitivity.parameters import Parameter
from shellmb.sensitivity.perturbed_run import PerturbedRun
from shellmb.simulate.simulation import Simulation
from shellmb.simulate.stepsize import LEAST, near

# scenes at both sides of a parameter
type Sides = tuple[PerturbedRun, PerturbedRun]
# change of a step's length, in parts of it
UNIT = 2e-4
# largest difference of a step's length between the run and a side, in parts of it
MOST = 0.5
# relative difference of two rates of time that are one, and round-off of times, in steps
SAME, ROUND_OFF = 1e-3, 1e-9
# part by which slopes on both sides may differ from their mean: what is smooth leaves the distance
# of both sides
BENT = 0.02
# part of it beyond which the mean is round-off of the slopes: a function that is even has none
EVEN = 10.0
# change of a function between both sides, of its value, that is round-off
SMALL = 1e-12


@dataclass(frozen=True)
class Ends:
    """Both sides at the ends of a step whose length depends on the parameter.

    Args:
        until: By how much later than the run the upper side ends, s.
        found: Derivatives of the unknowns.
        states: States of the upper side and of the lower one.
        said: Warnings about events whose time does not move.
    """

    until: float
    found: Floats
    states: tuple[Floats, Floats]
    said: Sequence[str] = ()


def check_begun(run: Simulation, sides: Sides, name: str) -> None:
    """Refuse a condition that is true at the start on one side only.

    Args:
        run: The run, in its first step.
        sides: Both sides of a parameter.
        name: The parameter.

    Raises:
        SceneError: If there is one; names the event.
    """
    for side in sides:
        for own, its in zip(run.control.watches, side.simulation.control.watches, strict=True):
            if own.times != its.times:
                raise SceneError(
                    f"sensitivities: event '{own.event.name}' is true at the start on one side of "
                    f"'{name}' only, so that nothing has a derivative by it; begin where the "
                    "condition is clearly true or false"
                )


def ends(run: Simulation, sides: Sides, name: str, solve: Callable[[float], Floats]) -> Ends:
    """Find the ends of a step of the run that begins or ends with events; collective.

    Args:
        run: The run, which has solved the step.
        sides: Both sides of a parameter.
        name: The parameter.
        solve: Finds derivatives of the unknowns where the upper side ends later than the run by a
            time [s], and the lower one earlier.

    Raises:
        ConvergenceError: If the length of the step changes by half of it.
    """
    step, crossed = run.solved, run.control.crossed
    since, unit = sides[0].since, UNIT * step.dt
    here, longer, shorter = (
        _ahead(sides, solve(since + change), crossed) for change in (0.0, unit, -unit)
    )
    # change of what is found there for each unit
    slopes = [0.5 * (a - b) for a, b in zip(longer, shorter, strict=True)]
    until, said = 0.0, list[str]()
    if crossed:
        until, said = _time(run, since, here[-1], np.subtract(*slopes[-1]) / (2 * unit))
    moved = until - since
    if abs(moved) > MOST * step.dt:
        raise ConvergenceError(
            f"sensitivities: the step from t = {step.t:g} begins or ends with an event, and its "
            f"length of {step.dt:.3g} s changes by {abs(moved):.3g} s within the distance of the "
            f"differences of '{name}'; choose another dt, a smaller size of it by scales=... "
            "(--scale), or a condition that the motion does not touch so slowly"
        )
    found, *states, _ = (h + moved / unit * s for h, s in zip(here, slopes, strict=True))
    return Ends(until, found, (states[0], states[1]), said)


def _ahead(sides: Sides, found: Floats, crossed: Sequence[int]) -> list[Floats]:
    """Derivatives, states of both sides that follow from them, and margins of events there."""
    margins = [side.margins()[crossed] if crossed else np.zeros(0) for side in sides]
    return [found.copy(), *(side.ahead() for side in sides), np.array(margins)]


def _time(run: Simulation, since: float, margins: Floats, rates: Floats) -> tuple[float, list[str]]:
    """By how much later than the run the upper side ends at its events, s, and what to say."""
    watches = [run.control.watches[k] for k in run.control.crossed]
    names = [watch.event.name for watch in watches]
    end = run.solved.t + run.solved.dt
    fixed = [run.control.next, *run.landing.times]
    if any(abs(end - t) <= near(end, run.size.nominal) for t in fixed):
        return 0.0, [_held(name, end, "a step has to end at this time") for name in names]
    with np.errstate(divide="ignore", invalid="ignore"):
        over, until = margins.mean(axis=0) / rates, since - np.subtract(*margins) / (2 * rates)
    # by how much later than its condition an event may have been found
    late = 2 * LEAST * run.size.dt + np.array([watch.tolerance for watch in watches])
    moves = (rates > 0) & (over <= late)
    there = zip(names, moves, strict=True)
    said = [_held(name, end, "its condition jumps there") for name, moved in there if not moved]
    if not moves.any():
        return 0.0, said
    first = float(until[moves][np.argmax(over[moves])])
    if np.abs(until[moves] - first).max() > SAME * abs(first) + ROUND_OFF * run.solved.dt:
        said.append(
            f"events {listed(names)} happen at once at t = {end:g}, and one after the other with "
            "other parameters; derivatives after it are those of one side at best"
        )
    return first, said


def _held(name: str, t: float, why: str) -> str:
    return (
        f"event '{name}' at t = {t:g}: {why}; derivatives after it are those with the event at "
        "this time"
    )


class Corners:
    """Looks for corners of the functions of time of a run and of a scene on each side of it.

    Args:
        run: The run.
        parameter: The parameter.
        sides: The scenes at its larger and its smaller value.
    """

    def __init__(self, run: Simulation, parameter: Parameter, sides: tuple[Scene, Scene]) -> None:
        self._name, self._loads = parameter.name, len(run.scene.loads)
        scenes = (run.scene, *sides)
        every = zip(*(map(_given, functions_of_time(scene)) for scene in scenes), strict=True)
        self._functions = [(k, fs) for k, fs in enumerate(every) if None not in fs]
        stages = (forms for of in run.problem.forms.values() for forms in of.values())
        samples = (sample for forms in stages for sample in forms.samples)
        self._instants = sorted({tau for sample in samples for tau, _ in sample.instants})

    def met(self, t: float, dt: float) -> Iterator[str]:
        """Sentences on corners that a step meets.

        Args:
            t: Its start, s.
            dt: Its length, s.
        """
        for item in list(self._functions):
            k, functions = item
            for tau in self._instants if k < self._loads else (1.0,):
                if _bends(*(float(f(t + tau * dt)) for f in functions)):
                    self._functions.remove(item)
                    what = f"load {k + 1}" if k < self._loads else "a prescribed motion"
                    yield (
                        f"the function of time of {what} has a corner at t = {t + tau * dt:g}, "
                        f"which a step meets and '{self._name}' moves: derivatives after it are "
                        "means of two that differ; move the corner a little, or take another dt"
                    )
                    break


def _given(function: Any) -> Callable[[float], Any] | None:
    """The function of time that a load or a motion is given by; None: another one."""
    if isinstance(function, Switched):
        function = function.time
    return function if callable(function) and not isinstance(function, Signal) else None


def _bends(here: float, above: float, below: float) -> bool:
    """Decide whether values at both sides of one do not mirror each other."""
    slope, bent = abs(above - below), abs(above + below - 2 * here)
    small = SMALL * max(abs(here), abs(above), abs(below))
    return BENT * slope < bent < EVEN * slope and slope > small
