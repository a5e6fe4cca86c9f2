"""Linear systems of scenes about states, and their responses: `sm.linearise`, `sm.response`."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from mpi4py import MPI

import numpy as np

from shellmb.api.responding.channels import columns, outputs, unfit, with_inputs, without_commands
from shellmb.api.responding.curves import check_response
from shellmb.api.responding.reduction import Unknowns, scipy_matrix
from shellmb.api.responding.response import Response, find
from shellmb.api.responding.system import GROUND, LinearSystem
from shellmb.arrays import Floats
from shellmb.errors import ConvergenceError, SceneError, warn
from shellmb.options.described import options_of, take, takes
from shellmb.options.linear import LinearOptions, ResponseOptions
from shellmb.options.run import ELEMENTS, Options
from shellmb.running.natural_modes.vibration import equilibrium
from shellmb.running.resume import state_of_run
from shellmb.running.rotating.axis import Axis, check_steady, find_axis
from shellmb.running.rotating.linearised import Linearised, SteadyRotation
from shellmb.running.rotating.state import STEADY, MovingState, check_state
from shellmb.scene import Scene
from shellmb.scene.values.validate import show

if TYPE_CHECKING:
    from shellmb.api.record import Run


Made = tuple[Linearised, Mapping[str, Any], str]


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
    wanted, chosen = scene_and_state(
        "linearise", scene, parameters, options | {"at": at, "state": state}
    )

    return about_state(wanted, chosen, constraints)


def scene_and_state(
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
    from shellmb.api.record import scene_of
    from shellmb.api.runs import refuse_ranks, requested

    refuse_ranks(what)
    scene = scene_of(scene, options, what)
    chosen = take(LinearOptions, options)
    chosen.check(what)
    return requested(scene, parameters, **options).scene, chosen


@takes(
    *options_of(ResponseOptions),
    *options_of(LinearOptions),
    *options_of(Options, *ELEMENTS, "errors"),
)
def response(
    scene: Scene | Run | LinearSystem | str,
    out: Path | str | None = None,
    *,
    state: Run | Path | str | None = None,
    parameters: Mapping[str, Any] | None = None,
    pictures: bool = True,
    **options: Any,
) -> Response:
    """Response of a scene that is linearised: harmonic, random, and to spectra of shocks.

    Args:
        scene: A scene, the name of a bundled one, or the path of a Python file; a run, whose last
            state is meant; or a linear system.
        out: Directory to write, new or empty; None: none.
        state: Directory of a run of the scene, whose state is meant.
        parameters: Values of the parameters of a scene that is named.
        pictures: Whether plots are drawn where a directory is written.
        **options: What responds to what, what it is linearised about, and choices that replace
            the scene's, as `shellmb modes` has them.

    Raises:
        SceneError: If the scene, the state, an input or an output is impossible.
        ConvergenceError: If there is no such state.
    """
    chosen = take(ResponseOptions, options)
    check_response(chosen)
    if out is not None:
        from shellmb.running.directory import refuse_used

        refuse_used(Path(out), MPI.COMM_SELF)
    if isinstance(scene, LinearSystem):
        extra = [name for name, value in options.items() if value]
        if extra or state is not None or parameters:
            raise SceneError(
                f"response: {', '.join(extra) or 'state or parameters'} is given with a linear "
                "system, which has its state; leave it out, or give the scene"
            )
        found = find(scene, chosen)
    else:
        wanted, about = scene_and_state("response", scene, parameters, options | {"state": state})
        if wanted.errors and (about.state is not None or about.timed):
            raise SceneError(
                "response: errors are estimated about rest, equilibria and steady rotations; leave "
                "out errors, or the state of a run"
            )

        found = find(about_state(wanted, about), chosen)
        if wanted.errors:
            found = replace(found, errors=_errors(wanted, about, chosen, found.numbers))
    if out is not None:
        found.save(out, pictures)
    return found


def _errors(
    scene: Scene, about: LinearOptions, chosen: ResponseOptions, numbers: dict[str, float]
) -> dict[str, float]:
    """Errors of numbers by the mesh, from the response on a finer one."""
    from shellmb.accuracy.estimates import mesh_error
    from shellmb.accuracy.family import Change

    there = find(about_state(Change(mesh=2).apply(scene), about), chosen).numbers
    return {name: mesh_error(abs(value - there[name])).error for name, value in numbers.items()}


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
        raise SceneError(said) from None


def _steady(scene: Scene, chosen: LinearOptions) -> Made:
    """Rest, an equilibrium or a steady rotation; inputs; and what it is."""
    comm, loaded, rate = MPI.COMM_SELF, chosen.at == "equilibrium", chosen.rate
    changed, inputs = with_inputs(scene)
    if loaded and not rate:
        held = without_commands(scene)
        check_state(held, "")
        still = equilibrium(held, comm)
        moving = MovingState(changed, still.arrays, still.counters, comm, 0.0)
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
    unseen = {probe.name: why for probe in scene.probes if (why := unfit(state, probe))}
    for name, why in unseen.items():
        warn(f"linearise: probe '{name}' is left out, as {why}")
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
    system = LinearSystem(*of, said, kept, state.shift, times, tuple(relaxing), unseen)
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
    drift = state.unsteady.drift(min(sizes[sizes > 0], default=state.shift))
    if drift > STEADY:
        warn(
            f"linearise: the state at t = {state.time:g} is no steady motion: it moves by "
            f"{drift:.2g} of the scene's length while its slowest mode turns by one radian; the "
            "system holds for much shorter times only"
        )
