"""States that scenes are linearised about, and their linear systems."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.api.responding.channels import columns, outputs, with_inputs, without_commands
from shellmb.api.responding.reduction import Unknowns, scipy_matrix
from shellmb.api.responding.system import GROUND, LinearSystem
from shellmb.arrays import Floats
from shellmb.errors import ConvergenceError, SceneError, warn
from shellmb.options.linear import LinearOptions
from shellmb.running.natural_modes.vibration import equilibrium
from shellmb.running.resuming.resume import state_of_run
from shellmb.running.rotating.axis import Axis, check_steady, find_axis
from shellmb.running.rotating.linearised import Linearised, SteadyRotation
from shellmb.running.rotating.quadratic import NEUTRAL
from shellmb.running.rotating.state import STEADY, MovingState, check_state
from shellmb.scene import Scene
from shellmb.scene.values.validate import show


def about_state(
    scene: Scene, chosen: LinearOptions, constraints: str = "eliminated"
) -> LinearSystem:
    """Linear system of a scene.

    Args:
        scene: The scene.
        chosen: The state.
        constraints: As of `linearise`.

    Raises:
        SceneError: If there is no such state, or nothing is linear about it.
        ConvergenceError: As `linearise`.
    """
    made = _of_run if chosen.timed or chosen.state is not None else _steady
    try:
        return _system_of(scene, *made(scene, chosen), constraints)
    except (SceneError, ConvergenceError) as error:
        said = re.sub("^(modes|matrices|resume): ", "linearise: ", str(error))
        if isinstance(error, ConvergenceError):
            raise error.reworded(said) from error
        if said.startswith("statics: nothing holds"):
            said += "; or give at=0.0 in place of 'equilibrium', if the scene begins in balance"
        raise SceneError(said) from None


Made = tuple[Linearised, Mapping[str, Any], str]


def _steady(scene: Scene, chosen: LinearOptions) -> Made:
    """Rest, an equilibrium or a steady rotation; inputs; and what it is."""
    comm, loaded, rate = MPI.COMM_SELF, chosen.at == "equilibrium", chosen.rate
    changed, inputs = with_inputs(scene)
    if loaded and not rate:
        held = without_commands(scene)
        check_state(held, "")
        still = equilibrium(held, comm)
        still.run()
        moving = MovingState(changed, *still.saved(), comm, 0.0)
        return moving, inputs, "the static equilibrium"
    line = Axis((0.0, 0.0, 1.0))
    if rate:
        line = find_axis(scene, chosen.axis, chosen.about)
        check_steady(scene, line, loaded)
    steady = SteadyRotation(changed, line, comm, loaded)
    if rate:
        steady.go(rate)
        return steady, inputs, f"a steady rotation at {rate:g} rad/s about {show(line.axis)}"
    # as natural modes, about the reference, in balance or not
    steady.rate = 0.0
    steady.turn(0.0)
    steady.system.follow()
    return steady, inputs, "rest"


def _of_run(scene: Scene, chosen: LinearOptions) -> Made:
    """State of a run; inputs; and what it is."""
    comm, run = MPI.COMM_SELF, None if chosen.state is None else Path(chosen.state)
    time = float(chosen.at) if chosen.timed else None  # type: ignore[arg-type]
    meant = state_of_run(scene, run, time, comm)
    check_state(without_commands(scene), meant.scheme)
    arrays, counters = meant.reach(comm)
    changed, inputs = with_inputs(scene, counters["control"])
    frame = {"rate": chosen.rate, "axis": chosen.axis, "about": chosen.about}
    state = MovingState(changed, arrays, counters, comm, **frame)  # type: ignore[arg-type]
    seen = f"in a frame that turns by {state.rate:g} rad/s" if state.rate else "in space"
    return state, inputs, f"the state at t = {state.time:g}, {seen}"


def _system_of(
    scene: Scene, state: Linearised, inputs: Mapping[str, Any], about: str, constraints: str
) -> LinearSystem:
    """System of a state with numbers to add to its inputs."""
    branches = state.branches(columns=True)
    matrices, times = (*state.matrices(columns=True), *branches.values()), tuple(branches)
    rest = isinstance(state, SteadyRotation) and not state.rate
    seen = outputs(state, scene, scipy_matrix(matrices[0]), joints=rest, times=times)
    rows = np.zeros((len(matrices), len(seen), state.system.size))
    for k, one in enumerate(seen.values()):
        for order, row in one.items():
            rows[order, k] = row
    carried = np.zeros((2, len(seen), len(inputs)))
    for name, moved in zip(GROUND, _translations(state), strict=True):
        carried[..., list(inputs).index(name)] = rows[:2] @ moved
    unknowns = Unknowns(state, matrices, *columns(state, dict(inputs)), tuple(rows))
    kept = constraints == "kept"
    found = unknowns.kept() if kept else unknowns.free()
    (K, C, M, *relaxing), driven = found.A, (found.F, found.Y, found.D, carried)
    said = f"scene '{scene.name}' about {about}"
    names = tuple(inputs), tuple(seen)
    of = M, C, K, *driven, *names
    system = LinearSystem(*of, said, kept, state.shift, times, tuple(relaxing))
    _doubt(state, system)
    return system


def _translations(state: Linearised) -> Floats:
    """Unit translations of everything along the axes, shape (3, unknowns)."""
    found = np.zeros((3, state.system.size))
    for body, numbers in zip(state.model.bodies, state.system.numbering.by_field, strict=True):
        if "u" in body.mixed.dofs and body.mixed.parts["u"][1] == 3:
            for k, moved in enumerate(found):
                moved[numbers[body.mixed.dofs["u"].reshape(-1, 3)[:, k]]] = 1.0
    return found


def _doubt(state: Linearised, system: LinearSystem) -> None:
    """Warn of a state that moves on while it vibrates."""
    if not isinstance(state, MovingState):
        return
    sizes = np.abs(system.poles(10))
    drift = state.unsteady.drift(min(sizes[sizes > NEUTRAL * state.shift], default=state.shift))
    if drift > STEADY:
        warn(
            f"linearise: the state at t = {state.time:g} is no steady motion: it moves by "
            f"{drift:.2g} of the scene's length while its slowest mode turns by one radian; the "
            "system holds for much shorter times only"
        )
