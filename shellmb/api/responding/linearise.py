"""Linear systems of scenes about rest, an equilibrium, a steady rotation, or a state of a run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from shellmb.api.responding.system import LinearSystem
from shellmb.errors import SceneError
from shellmb.options.described import options_of, take, takes
from shellmb.options.response import LinearOptions
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
    from shellmb.api.resolve_scene import refuse_ranks, requested

    refuse_ranks(what)
    scene = scene_of(scene, options, what)
    chosen = take(LinearOptions, options)
    chosen.check(what)
    return requested(scene, parameters, **options).scene, chosen
