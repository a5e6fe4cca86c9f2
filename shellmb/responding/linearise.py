"""Linear systems of scenes about rest, an equilibrium, a steady rotation, or a state of a run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import SceneError, warn
from shellmb.options.described import options_of, takes
from shellmb.options.response import LinearOptions, take
from shellmb.options.run import ELEMENTS, Options
from shellmb.responding.system import LinearSystem
from shellmb.scene import Scene
from shellmb.scene.values.validate import show

if TYPE_CHECKING:
    from shellmb.api.record import Run
    from shellmb.rotating.linearised import Linearised


@takes(*options_of(LinearOptions), *options_of(Options, *ELEMENTS))
def linearise(
    scene: Scene | Run | str,
    at: Literal["rest", "equilibrium"] | float | None = None,
    *,
    state: Run | Path | str | None = None,
    constraints: Literal["eliminated", "kept"] = "eliminated",
    parameters: Mapping[str, Any] | None = None,
    **options: Any,
) -> LinearSystem:
    """Linear system of a scene about a state, with named inputs and outputs, in one process.

    Args:
        scene: A scene, the name of a bundled one, or the path of a Python file; or a run, whose
            last state is meant then.
        at: State: `"rest"` is the reference without loads, `"equilibrium"` the static one under
            the loads, a number the time of a state [s], up to which the scene is run. None: rest,
            or the last state of the run that is given.
        state: Directory of a run of the scene, whose state is meant.
        constraints: Whether constraints are eliminated, or kept with their multipliers.
        parameters: Values of the parameters of a scene that is named.
        **options: Rotation, and choices that replace the scene's, as `shellmb modes` has them.

    Raises:
        SceneError: If the scene or the state is impossible, or there are several ranks.
        ConvergenceError: If there is no such state.
    """
    wanted, chosen = asked("linearise", scene, parameters, options | {"at": at, "state": state})
    if constraints not in ("eliminated", "kept"):
        raise SceneError(
            f"linearise: constraints is {show(constraints)}; it must be 'eliminated' or 'kept'"
        )
    return about_state(wanted, chosen, constraints)


def asked(
    what: str,
    scene: Scene | Run | str,
    parameters: Mapping[str, Any] | None,
    options: dict[str, Any],
) -> tuple[Scene, LinearOptions]:
    """Scene that is linearised, and the state.

    Args:
        what: Who asks, for errors.
        scene: As of `linearise`.
        parameters: As of `linearise`.
        options: Those of the state, and of elements.

    Raises:
        SceneError: If they make no sense, or there are several ranks.
    """
    from mpi4py import MPI

    from shellmb.api.record import Run
    from shellmb.api.requested import requested
    from shellmb.running.request import scene_of_run

    if MPI.COMM_WORLD.size > 1:
        raise SceneError(
            f"{what}: there are {MPI.COMM_WORLD.size} ranks; it must be called in one process"
        )
    if isinstance(scene, Run):
        if options["state"] is not None:
            raise SceneError(f"{what}: the scene is a run, and a state is given, too; give one")
        options["state"], made_here = scene, scene.computed is not None
        scene = scene.scene if made_here else scene_of_run(scene.directory, what)[0]
    if isinstance(options["state"], Run):
        options["state"] = options["state"].directory
    chosen = take(LinearOptions, options)
    chosen.check(what)
    return requested(scene, parameters, **options).scene, chosen


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
    except SceneError as error:
        raise SceneError(str(error).replace("modes: ", "linearise: ", 1)) from None


Made = tuple["Linearised", Mapping[str, Any], str]


def _steady(scene: Scene, chosen: LinearOptions) -> Made:
    """Rest, an equilibrium or a steady rotation; inputs; and what it is."""
    from mpi4py import MPI

    from shellmb.responding.inputs import with_inputs
    from shellmb.rotating.axis import Axis, check_steady, find_axis
    from shellmb.rotating.state import MovingState, check_state
    from shellmb.rotating.steady import SteadyRotation
    from shellmb.vibration import equilibrium

    comm, loaded, rate = MPI.COMM_SELF, chosen.at == "equilibrium", chosen.rate
    changed, inputs = with_inputs(scene)
    if loaded and rate is None:
        check_state(scene, "")
        still = equilibrium(scene, comm)
        still.run()
        moving = MovingState(changed, still.arrays(), still.state(), comm, 0.0)
        return moving, inputs, "the static equilibrium"
    line = Axis((0.0, 0.0, 1.0))
    if rate:
        line = find_axis(scene, chosen.axis, chosen.about)
        check_steady(scene, line, loaded)
    steady = SteadyRotation(changed, line, comm, loaded)
    steady.go(rate or 0.0)
    said = f"a steady rotation at {rate:g} rad/s about {show(line.axis)}" if rate else "rest"
    return steady, inputs, said


def _of_run(scene: Scene, chosen: LinearOptions) -> Made:
    """State of a run; inputs; and what it is."""
    from mpi4py import MPI

    from shellmb.responding.inputs import with_inputs
    from shellmb.rotating.state import MovingState, check_state
    from shellmb.running.resuming.reached import state_of_run

    comm, run = MPI.COMM_SELF, None if chosen.state is None else Path(chosen.state)
    time = float(chosen.at) if chosen.timed else None  # type: ignore[arg-type]
    meant = state_of_run(scene, run, time, comm)
    check_state(scene, meant.scheme)
    changed, inputs = with_inputs(scene)
    frame = chosen.rate, chosen.axis, chosen.about
    state = MovingState(changed, *meant.reach(comm), comm, *frame)
    seen = f"in a frame that turns by {state.rate:g} rad/s" if state.rate else "in space"
    return state, inputs, f"the state at t = {state.time:g}, {seen}"


def _system_of(
    scene: Scene, state: Linearised, inputs: Mapping[str, Any], about: str, constraints: str
) -> LinearSystem:
    """System of a state with numbers to add to its inputs."""
    from shellmb.responding.inputs import AXES, columns
    from shellmb.responding.outputs import outputs
    from shellmb.responding.reduction import scipy_matrix, unknowns_of

    matrices = state.columns()
    seen = outputs(state, scene, scipy_matrix(matrices[0]), joints=about == "rest")
    rows = np.zeros((2, len(seen), state.system.size))
    for k, one in enumerate(seen.values()):
        rows[one.order, k] = one.row
    carried = np.zeros((2, len(seen), len(inputs)))
    for axis, moved in zip(AXES, _translations(state), strict=True):
        carried[..., list(inputs).index(f"base.{axis}")] = rows @ moved
    unknowns = unknowns_of(state, matrices, *columns(state, dict(inputs)), (rows[0], rows[1]))
    kept = constraints == "kept"
    found = unknowns.kept() if kept else unknowns.free()
    of = found.M, found.C, found.K, found.F, found.Y, found.D, carried
    said = f"scene '{scene.name}' about {about}"
    system = LinearSystem(*of, tuple(inputs), tuple(seen), said, kept, state.shift)
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
    from shellmb.rotating.modes import NEUTRAL
    from shellmb.rotating.state import STEADY, MovingState

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
