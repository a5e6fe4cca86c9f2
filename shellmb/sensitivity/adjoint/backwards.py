"""There and back: a run, and the sweep backwards through its steps."""

import gc
from collections.abc import Sequence
from typing import TYPE_CHECKING

from mpi4py import MPI

import numpy as np

from shellmb.errors import unsaid
from shellmb.observers.probes import linear, spot_of
from shellmb.running.execute import RunResult, execute
from shellmb.running.results import Results
from shellmb.scene import Probe, Scene
from shellmb.sensitivity.adjoint.elementwise import ElementField, by_element, changes
from shellmb.sensitivity.adjoint.objective import Objective, evaluated, names_of, slopes
from shellmb.sensitivity.adjoint.steps import State, Steps, copied, put, starts
from shellmb.sensitivity.adjoint.sweep import Sweep, weighed
from shellmb.sensitivity.adjoint.transposed import Covector
from shellmb.sensitivity.adjoint.utilisations import Utilisations, Watch
from shellmb.sensitivity.events import Corners
from shellmb.sensitivity.parameters import Parameter
from shellmb.sensitivity.perturbed_run import PerturbedRun, check_alike
from shellmb.simulate.simulation import Simulation

if TYPE_CHECKING:
    import pandas as pd

# what is found: the number, derivatives by parameters and by fields, and the run
Swept = tuple[float, dict[str, float], dict[tuple[str, str], "pd.DataFrame"], RunResult]


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


def there_and_back(
    scene: Scene,
    objective: Objective,
    places: Sequence[ElementField],
    both: Sequence[tuple[Parameter, Scene, Scene]],
    states: int | None,
    comm: MPI.Comm,
    results: Results | None,
    said: list[str],
) -> Swept:
    """Run a scene, and differentiate a number by going back over its steps; collective.

    Args:
        scene: The scene, in which `places` are functions of the position.
        objective: The number.
        places: Parameters that are numbers in each element.
        both: Parameters with the scenes above and below them.
        states: Number of states that are kept at most; None: all steps are.
        comm: Communicator.
        results: Gives the results of the run.
        said: Receives warnings about unreliable derivatives.
    """
    steps, watch = Steps(states), Watch(places)
    run = execute(scene, None, [steps, watch], comm=comm, pictures=False, results=results)
    simulation = run.simulation
    history = {name: run.column(name) for name in ("t", *names_of(simulation.scene))}
    value = evaluated(objective, history)
    slope = slopes(objective, history, value, said)
    shells = simulation.model.shells
    branches = simulation.problem.branches.get
    found = [(p.body, changes(shells[p.body], p.name, branches(p.body))) for p in places]
    used = Utilisations(simulation, watch, slope)
    sweep = Sweep(simulation, found, bool(both), used.forms)
    readings = {p.name: Reading(simulation, p) for p in simulation.scene.probes}
    for step in steps.backwards(simulation):
        for name, reading in readings.items():
            reading.add(sweep.covector, float(slope[name][step.number + 1]))
        used.take(step.number + 1, sweep.by_fields)
        sweep.back(step, *steps.times[step.number])
    for name, reading in readings.items():
        reading.add(sweep.covector, float(slope[name][0]))
    used.take(0, sweep.by_fields)
    put(steps.first, starts(simulation.problem))
    used.add_start(sweep.covector)
    return (
        value,
        {
            p.name: _by_parameter(simulation, sweep, said, steps.first, used, p, *scenes)
            for p, *scenes in both
        },
        {
            (p.body, p.name): by_element(shells[p.body], p.name, derivative)
            for p, derivative in zip(places, sweep.by_fields, strict=True)
        },
        run,
    )


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
