"""The static equilibrium under a scene's loads, which modes and linear systems are about."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from mpi4py import MPI

from shellmb.arrays import Floats
from shellmb.errors import ConvergenceError, UnheldError
from shellmb.model.body import TimeFunction
from shellmb.model.model import Model
from shellmb.preprocessing.checked_model import checked_model
from shellmb.running.rotating.linearised import as_given, check_closed
from shellmb.scene import Scene
from shellmb.scene.schemes import SIMPLEST
from shellmb.simulate.eigenmodes import shift_below
from shellmb.simulate.simulation import Simulation
from shellmb.simulate.start.consistent import Relaxation


@dataclass(frozen=True)
class Equilibrium:
    """State of bodies that loads do not move.

    Args:
        model: The bodies with their masses; multipliers have the unit that they have in the state.
        arrays: Local arrays, by `NAME/q`.
        counters: Its time and what else a restart needs, as of `Simulation.saved`.
        factor: Factor of each load by its function of time.
    """

    model: Model
    arrays: Mapping[str, Floats]
    counters: Mapping[str, Any]
    factor: Callable[[TimeFunction | None], float]


def equilibrium(scene: Scene, comm: MPI.Comm) -> Equilibrium:
    """Equilibrium that a scene's loads lead to in statics, or its bodies by coming to rest.

    Args:
        scene: The scene; its scheme does not matter.
        comm: Communicator.

    Raises:
        SceneError: If nothing holds a motion, not even the loads.
        ConvergenceError: If no equilibrium is found.
    """
    try:
        static = Simulation(scene.with_options(scheme="static"), comm)
    except UnheldError as unheld:
        try:
            return _at_rest(scene, comm)
        except ConvergenceError:
            raise unheld from None
    model, _ = checked_model(scene.with_options(scheme=SIMPLEST), comm, static.model.force)
    static.run()
    return Equilibrium(model, *static.saved(), partial(static.problem.start_factor, static.t))


def _at_rest(scene: Scene, comm: MPI.Comm) -> Equilibrium:
    """Equilibrium in which bodies come to rest that only their loads hold, as pendulums do."""
    model, _ = checked_model(scene.with_options(scheme=SIMPLEST), comm)
    levels = as_given(model)
    if not scene.assemble:
        check_closed(model, levels)
    t = scene.t_end
    Relaxation(model, levels, 1 / math.sqrt(-shift_below(model, True)), time=t).equilibrium()
    arrays = {f"{name}/q": own.q.x.array for name, own in levels.items()}
    counters = {"t": t, "switches": model.mechanism.switches.state()}
    return Equilibrium(model, arrays, counters, lambda of: 1.0 if of is None else float(of(t)))
