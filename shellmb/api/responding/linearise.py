"""Linear systems of scenes about states, and their responses: `sm.linearise`, `sm.response`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from shellmb.api.responding.curves import check_response
from shellmb.api.responding.response import Response, find
from shellmb.api.responding.system import LinearSystem
from shellmb.errors import SceneError
from shellmb.options.described import options_of, take, takes
from shellmb.options.linear import LinearOptions, ResponseOptions
from shellmb.options.run import ELEMENTS, Options
from shellmb.scene import Scene
from shellmb.scene.values.validate import show

if TYPE_CHECKING:
    from shellmb.api.record import Run


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
    if constraints not in ("eliminated", "kept"):
        raise SceneError(
            f"linearise: constraints is {show(constraints)}; it must be 'eliminated' or 'kept'"
        )
    from shellmb.api.responding.states import about_state

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
        from mpi4py import MPI

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
        from shellmb.api.responding.states import about_state

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
    from shellmb.accuracy.companions import Change
    from shellmb.accuracy.estimates import mesh_error
    from shellmb.api.responding.states import about_state

    there = find(about_state(Change(mesh=2).apply(scene), about), chosen).numbers
    return {name: mesh_error(abs(value - there[name])).error for name, value in numbers.items()}
