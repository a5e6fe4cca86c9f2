"""Responses of scenes: `sm.response`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from shellmb.api.responding.curves import check_response
from shellmb.api.responding.linearise import scene_and_state
from shellmb.api.responding.response import Response, find
from shellmb.api.responding.system import LinearSystem
from shellmb.errors import SceneError
from shellmb.options.described import options_of, take, takes
from shellmb.options.response import LinearOptions, ResponseOptions
from shellmb.options.run import ELEMENTS, Options
from shellmb.scene import Scene

if TYPE_CHECKING:
    from shellmb.api.record import Run


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
