"""A run with the derivatives of one number by many parameters."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import SceneError, unsaid, warn
from shellmb.observers.probes import linear, spot_of
from shellmb.options.described import options_of, takes
from shellmb.options.run import Options
from shellmb.running.execute import RunResult, execute
from shellmb.scene import FromMode, Probe, Scene
from shellmb.scene.schemes import REVERSIBLE
from shellmb.sensitivity.adjoint.elementwise import ElementField, by_element, changes, varying
from shellmb.sensitivity.adjoint.objective import (
    Objective,
    check_objective,
    check_probes,
    evaluated,
    names_of,
    slopes,
)
from shellmb.sensitivity.adjoint.steps import State, Steps, copied, put, starts
from shellmb.sensitivity.adjoint.sweep import Sweep, weighed
from shellmb.sensitivity.adjoint.transposed import Covector
from shellmb.sensitivity.adjoint.utilisations import Utilisations, Watch
from shellmb.sensitivity.events import Corners
from shellmb.sensitivity.parameters import Parameter, differentiated, independent
from shellmb.sensitivity.perturbed_run import PerturbedRun, check_alike
from shellmb.simulate.simulation import Simulation

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Adjoint:
    """A run with the derivatives of one number.

    Args:
        value: The number.
        parameters: Its derivatives by parameters of the scene function, by name.
        fields: Its derivatives by fields: for (shell, parameter of its section) a table with a row
            for each element: middle `x`, `y`, `z` [m], `area` [m^2], `value`, `derivative`.
        run: The run.
        warnings: What the derivatives say against themselves, each a sentence.
    """

    value: float
    parameters: dict[str, float]
    fields: dict[tuple[str, str], pd.DataFrame]
    run: RunResult = field(repr=False)
    warnings: tuple[str, ...]


@takes(*options_of(Options))
def adjoint(
    scene: Callable[..., Scene] | str,
    objective: Objective,
    fields: Sequence[tuple[str, str]] = (),
    parameters: Sequence[str] = (),
    *,
    values: Mapping[str, Any] | None = None,
    scales: Mapping[str, float] | None = None,
    states: int | None = None,
    comm: MPI.Comm | None = None,
    **options: Any,
) -> Adjoint:
    """Run a scene and differentiate one number by many parameters, in one backward sweep.

    The cost is that of the sweep, however many elements there are; a parameter of the scene
    function adds two residuals to each step.

    Args:
        scene: A function that makes the scene, the name of a bundled scene, or the path of a
            Python file.
        objective: The number: a function of the histories of the probes, and of the utilisations
            of reserves, arrays by their names, with the times as "t".
        fields: Parameters of sections that are numbers in each element, each a shell's name and
            "thickness", "angle", "offset", "plies[0].angle" or "plies[0].thickness".
        parameters: Names of parameters of the scene function.
        values: Values of parameters of the scene that replace its defaults.
        scales: Sizes of parameters, where their values do not tell.
        states: Number of states that are kept at most, for less memory: steps between them are
            solved again; without `parameters`. None: all steps are kept.
        comm: Communicator; None: all ranks.
        **options: Choices that replace the scene's, as `shellmb run` has them.

    Returns:
        The number, its derivatives, and the run.

    Raises:
        SceneError: If the scene, a parameter, a field or the objective is impossible, or the scene
            has what cannot go backwards.
        ConvergenceError: If a step fails at the smallest step size.
    """
    made = differentiated(scene, values, **options)
    if not (fields or parameters):
        raise SceneError("adjoint: neither fields nor parameters are named; name at least one")
    if states is not None and not (isinstance(states, int) and states >= 1):
        raise SceneError(f"adjoint: states is {states!r}; it must be 1 or more, or None for all")
    if states is not None and parameters:
        raise SceneError(
            f"adjoint: states is {states}, and parameters are named, for which all steps are kept; "
            "leave out one of both"
        )
    chosen = made.parameters(parameters, scales) if parameters else ()
    places = _places(fields)
    given = made.base()
    _refuse(given, places)
    check_objective(objective, given)
    base = varying(given, places)
    scenes = {p: made.beside(given, p) for p in (c.widened(given) for c in chosen)}
    both = {p: [varying(side, places) for side in sides] for p, sides in scenes.items()}
    doubtful, said = list[str](), dict[Any, str]()
    for p, (above, below) in scenes.items():
        if independent(above, below):
            said[p.name] = p.without_effect(given, above)
    steps, watch = Steps(states), Watch(places)
    how: dict[str, Any] = {"comm": comm or MPI.COMM_WORLD, "results": made.results}
    run = execute(base, None, [steps, watch], pictures=False, **how)
    history = {name: run.column(name) for name in ("t", *names_of(base))}
    value = evaluated(objective, history)
    slope = slopes(objective, history, value, doubtful)
    simulation, shells = run.simulation, run.simulation.model.shells
    branches = simulation.problem.branches.get
    found = [(p.body, changes(shells[p.body], p.name, branches(p.body))) for p in places]
    used = Utilisations(simulation, watch, slope)
    sweep = Sweep(simulation, found, bool(both), used.forms)
    _go_back(simulation, steps, sweep, used, slope)
    by_parameters = {
        p.name: _by_parameter(simulation, sweep, doubtful, steps.first, used, p, *sides)
        for p, sides in both.items()
    }
    by_fields = {
        (p.body, p.name): by_element(shells[p.body], p.name, derivative)
        for p, derivative in zip(places, sweep.by_fields, strict=True)
    }
    for p in scenes:
        if not by_parameters[p.name]:
            said.setdefault(
                p.name,
                f"the objective does not depend on '{p.name}' near {p.value:g}: its derivative is "
                "zero",
            )
    for body, name in places:
        if not by_fields[body, name]["derivative"].any():
            said[body, name] = (
                f"the objective does not depend on '{name}' of shell '{body}': its derivative is "
                "zero in all elements"
            )
    sentences = *dict.fromkeys(doubtful), *said.values()
    for text in sentences:
        warn(f"adjoint: {text}")
    return Adjoint(value, by_parameters, by_fields, run, sentences)


class Reading:
    """Reading of a probe, as a covector of the state.

    Args:
        simulation: The simulation.
        probe: The probe, of a motion, with a component.
    """

    def __init__(self, simulation: Simulation, probe: Probe) -> None:
        (given,) = simulation.scene.bodies_of(probe)
        spot = spot_of(simulation.model, given.name, probe.at, f"probe '{probe.name}'")
        self._key = spot.body, "v" if probe.quantity == "velocity" else "q"
        dofs, shares = linear(spot)
        self._dofs, self._weights = dofs[:, int(probe.component)], shares[0]

    def add(self, covector: Covector, slope: float) -> None:
        """Add a derivative by what is read to the covector of a state."""
        np.add.at(covector[self._key], self._dofs, slope * self._weights)


def _go_back(
    simulation: Simulation,
    steps: Steps,
    sweep: Sweep,
    used: Utilisations,
    slope: Mapping[str, Floats],
) -> None:
    """Sweep from the last step to the state at the start; collective."""
    readings = {p.name: Reading(simulation, p) for p in simulation.scene.probes}

    def read(row: int) -> None:
        for name, reading in readings.items():
            reading.add(sweep.covector, float(slope[name][row]))
        used.take(row, sweep.by_fields)

    for step in steps.backwards(simulation):
        read(step.number + 1)
        sweep.back(step, *steps.times[step.number])
    read(0)
    put(steps.first, starts(simulation.problem))
    used.add_start(sweep.covector)


def _by_parameter(
    run: Simulation,
    sweep: Sweep,
    said: list[str],
    first: State,
    used: Utilisations,
    parameter: Parameter,
    *scenes: Scene,
) -> float:
    """Derivative by a parameter, from scenes above and below it; collective.

    Scenes of one parameter are there at a time: MPI has a few thousand communicators, of which
    each mesh takes some.
    """
    work, ends = [], []
    for scene in scenes:
        with unsaid():
            simulation = Simulation(scene, run.model.comm, run)
        check_alike(run, simulation, parameter.name)
        ends.append(copied(starts(simulation.problem)))
        side = PerturbedRun(simulation, [], forces=False)
        at_start, read = used.beside(side, first)
        work.append(weighed(side, sweep.kept, read) - at_start)
        del simulation, side, read
        gc.collect()
    corners = Corners(run, parameter, (scenes[0], scenes[1]))
    for step in reversed(sweep.kept):
        said += corners.met(step.t, step.dt)
    above, below = ends
    start = sum(float(np.vdot(w, above[key] - below[key])) for key, w in sweep.covector.items())
    return float(run.model.comm.allreduce(start - (work[0] - work[1]))) / parameter.width


def _places(fields: Any) -> tuple[ElementField, ...]:
    """Fields that are differentiated by.

    Raises:
        SceneError: If they are no pairs of names, or one is named twice.
    """
    several = isinstance(fields, Iterable) and not isinstance(fields, str)
    places = list[ElementField]()
    for given in fields if several else [fields]:
        if not isinstance(given, tuple | list) or len(given) != 2:
            raise SceneError(
                f"adjoint: a field is {given!r}; it must be the name of a shell and of a parameter "
                "of its section, such as ('plate', 'thickness')"
            )
        if ElementField(*given) in places:
            raise SceneError(f"adjoint: field {tuple(given)!r} is named twice; name it once")
        places.append(ElementField(*given))
    return tuple(places)


def _refuse(scene: Scene, places: Sequence[ElementField]) -> None:
    """Refuse what has no adjoint here.

    Raises:
        SceneError: If the scene has something that changes at times of its own, or memory.
    """
    name, where = scene.name, "; use `sensitivities`, or compare runs (`sweep`)"
    if isinstance(scene.scheme, str) and scene.scheme not in REVERSIBLE:
        raise SceneError(
            f"adjoint: scheme '{scene.scheme_name}' of scene '{name}' does not go backwards; use "
            + ", ".join(REVERSIBLE)
        )
    check_probes(scene)
    said = {
        "follows a static path": scene.path,
        "has events": scene.all_events,
        "has contact with the faces of a shell": [c for c in scene.contacts if c.obstacle.deforms],
        "has controllers": scene.controllers,
        "has locks": scene.acting_locks,
        "has joints that act in windows": [j for j in scene.joints if j.active is not None],
    }
    for words, there in said.items():
        if there:
            raise SceneError(f"adjoint: scene '{name}' {words}, which cannot go backwards{where}")
    by_fields = {
        "starts from an equilibrium, which depends on its fields; start as given": (
            not scene.static and "equilibrium" in scene.starts
        ),
        "starts from a mode, whose shape depends on its fields; start from a run or a shape": any(
            isinstance(start, FromMode) for start in scene.starts
        ),
        "has joints and initial velocities, which masses distribute; start at rest": (
            scene.initial and scene.joints
        ),
    }
    for words, starting in by_fields.items():
        if places and starting:
            raise SceneError(
                f"adjoint: scene '{name}' {words}, or differentiate by parameters of the scene "
                "function"
            )
