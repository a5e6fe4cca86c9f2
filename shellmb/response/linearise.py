"""Linear systems of scenes about rest, an equilibrium, a steady rotation, or a state of a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import SceneError, warn
from shellmb.options.described import options_of, takes
from shellmb.options.run import ELEMENTS, Options
from shellmb.response.system import LinearSystem
from shellmb.scene import Scene
from shellmb.scene.values.validate import show

if TYPE_CHECKING:
    from shellmb.api.record import Run
    from shellmb.rotating.linearised import Linearised


@takes(*options_of(Options, *ELEMENTS))
def linearise(
    scene: Scene | Run | str,
    at: Literal["rest", "equilibrium"] | float | None = None,
    *,
    state: Run | Path | str | None = None,
    rate: float | None = None,
    axis: Sequence[float] | None = None,
    about: Sequence[float] | None = None,
    constraints: Literal["eliminated", "kept"] = "eliminated",
    parameters: Mapping[str, Any] | None = None,
    **elements: Any,
) -> LinearSystem:
    """Linear system of a scene about a state, with named inputs and outputs, in one process.

    Args:
        scene: A scene, the name of a bundled one, or the path of a Python file; or a run, whose
            last state is meant then.
        at: State: `"rest"` is the reference without loads, `"equilibrium"` the static one under
            the loads, a number the time of a state [s], up to which the scene is run. None: rest,
            or the last state of the run that is given.
        state: Directory of a run of the scene.
        rate: Rate of a steady rotation [rad/s]; of a state of a run that of its frame, in whose
            axes inputs and outputs are. None: no rotation, or the state's own.
        axis: Direction of its axis; None: that about which the scene turns.
        about: A point of the axis [m].
        constraints: Whether constraints are eliminated, or kept with their multipliers.
        parameters: Values of the parameters of a scene that is named.
        **elements: Choices that replace the scene's, as `shellmb modes` has them.

    Raises:
        SceneError: If the scene or the state is impossible, or there are several ranks.
        ConvergenceError: If there is no such state.
    """
    from mpi4py import MPI

    from shellmb.api.record import Run
    from shellmb.api.requested import requested
    from shellmb.running.request import scene_of_run

    if MPI.COMM_WORLD.size > 1:
        raise SceneError(
            f"linearise: there are {MPI.COMM_WORLD.size} ranks; it must be called in one process"
        )
    if isinstance(scene, Run):
        if state is not None:
            raise SceneError("linearise: the scene is a run, and a state is given, too; give one")
        state, made_here = scene, scene.computed is not None
        scene = scene.scene if made_here else scene_of_run(scene.directory, "linearise")[0]
    directory = state.directory if isinstance(state, Run) else state
    time = at if isinstance(at, int | float) and not isinstance(at, bool) else None
    if time is None and at not in (None, "rest", "equilibrium"):
        raise SceneError(f"linearise: at is {show(at)}; it must be 'rest', 'equilibrium' or a time")
    if directory is not None and isinstance(at, str):
        raise SceneError(f"linearise: at is {show(at)} and a state is given; give one of them")
    if constraints not in ("eliminated", "kept"):
        raise SceneError(
            f"linearise: constraints is {show(constraints)}; it must be 'eliminated' or 'kept'"
        )
    wanted = requested(scene, parameters, **elements).scene
    frame = (rate, axis, about)
    try:
        if time is not None or directory is not None:
            return system_of(wanted, *_of_run(wanted, directory, time, frame), constraints)
        return system_of(wanted, *_steady(wanted, at == "equilibrium", frame), constraints)
    except SceneError as error:
        raise SceneError(str(error).replace("modes: ", "linearise: ", 1)) from None


Made = tuple["Linearised", Mapping[str, Any], str]


def _steady(scene: Scene, loaded: bool, frame: tuple[Any, Any, Any]) -> Made:
    """Rest, an equilibrium or a steady rotation; inputs; and what it is."""
    from mpi4py import MPI

    from shellmb.response.inputs import with_inputs
    from shellmb.rotating.axis import Axis, check_steady, find_axis
    from shellmb.rotating.state import MovingState, check_state
    from shellmb.rotating.steady import SteadyRotation
    from shellmb.vibration import equilibrium

    (rate, axis, about), comm = frame, MPI.COMM_SELF
    if rate is None and (axis is not None or about is not None):
        raise SceneError("linearise: axis and about are given without rate; give rate, too")
    changed, inputs = with_inputs(scene)
    if loaded and rate is None:
        check_state(scene, "")
        simulation = equilibrium(scene, comm)
        simulation.run()
        now = simulation.arrays(), simulation.state()
        return MovingState(changed, *now, comm, 0.0), inputs, "the static equilibrium"
    line = Axis((0.0, 0.0, 1.0))
    if rate:
        line = find_axis(scene, axis, about)
        check_steady(scene, line, loaded)
    steady = SteadyRotation(changed, line, comm, loaded)
    steady.go(rate or 0.0)
    said = f"a steady rotation at {rate:g} rad/s about {show(line.axis)}" if rate else "rest"
    return steady, inputs, said


def _of_run(
    scene: Scene, run: Path | str | None, time: float | None, frame: tuple[Any, Any, Any]
) -> Made:
    """State of a run; inputs; and what it is."""
    from mpi4py import MPI

    from shellmb.response.inputs import with_inputs
    from shellmb.rotating.state import MovingState, check_state
    from shellmb.running.resuming.reached import state_of_run

    comm = MPI.COMM_SELF
    meant = state_of_run(scene, None if run is None else Path(run), time, comm)
    check_state(scene, meant.scheme)
    changed, inputs = with_inputs(scene)
    state = MovingState(changed, *meant.reach(comm), comm, *frame)
    seen = f"in a frame that turns by {state.rate:g} rad/s" if state.rate else "in space"
    return state, inputs, f"the state at t = {state.time:g}, {seen}"


def system_of(
    scene: Scene,
    state: Linearised,
    inputs: Mapping[str, Any],
    about: str,
    constraints: str = "eliminated",
) -> LinearSystem:
    """System of a state.

    Args:
        scene: The scene.
        state: Its state, with numbers to add to its inputs.
        inputs: These, by name.
        about: What the state is.
        constraints: As of `linearise`.
    """
    from shellmb.response.inputs import AXES, columns
    from shellmb.response.outputs import outputs
    from shellmb.response.reduction import scipy_matrix, unknowns_of

    matrices = state.columns()
    at_rest = about == "rest"
    seen = outputs(state, scene, scipy_matrix(matrices[0]), stressed=not at_rest)
    rows = np.zeros((2, len(seen), state.system.size))
    for k, one in enumerate(seen.values()):
        rows[one.order, k] = one.row
    carried = np.zeros((2, len(seen), len(inputs)))
    for axis, moved in zip(AXES, _translations(state), strict=True):
        carried[..., list(inputs).index(f"base.{axis}")] = rows @ moved
    unknowns = unknowns_of(state, matrices, *columns(state, dict(inputs)), (rows[0], rows[1]))
    found = unknowns.free() if constraints == "eliminated" else unknowns.kept()
    system = LinearSystem(
        found.M,
        found.C,
        found.K,
        found.F,
        found.Y,
        found.D,
        carried,
        tuple(inputs),
        tuple(seen),
        f"scene '{scene.name}' about {about}",
        constraints == "kept",
        state.shift,
    )
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
    slowest = float(np.min(sizes[sizes > NEUTRAL * state.shift], initial=state.shift))
    drift = state.unsteady.drift(slowest)
    if drift > STEADY:
        warn(
            f"linearise: the state at t = {state.time:g} is no steady motion: it moves by "
            f"{drift:.2g} of the scene's length while its slowest mode turns by one radian; the "
            "system holds for much shorter times only"
        )
