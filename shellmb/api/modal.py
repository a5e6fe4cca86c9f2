"""Natural modes of a scene, and those over the rate at which it turns: `sm.modes`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

from shellmb.api.modeshapes import ModeShapes
from shellmb.api.record import Run
from shellmb.api.resolve_scene import requested
from shellmb.api.rotating import RotatingModes, StateModes
from shellmb.errors import SceneError
from shellmb.options.accuracy import AccuracyOptions, take_accuracy
from shellmb.options.described import options_of, take, takes
from shellmb.options.modes import ModesOptions
from shellmb.options.run import ELEMENTS, Options
from shellmb.scene import Scene

if TYPE_CHECKING:
    from mpi4py import MPI


@overload
def modes(
    scene: Run, out: Path | str | None = None, count: int = 6, **options: Any
) -> StateModes: ...
@overload
def modes(
    scene: Scene | str,
    out: Path | str | None = None,
    count: int = 6,
    *,
    state: Run | Path | str,
    **options: Any,
) -> StateModes: ...
@overload
def modes(
    scene: Scene | str, out: Path | str | None = None, count: int = 6, *, at: float, **options: Any
) -> StateModes: ...
@overload
def modes(
    scene: Scene | str,
    out: Path | str | None = None,
    count: int = 6,
    loaded: bool = False,
    *,
    rates: Sequence[float],
    **options: Any,
) -> RotatingModes: ...
@overload
def modes(
    scene: Scene | str,
    out: Path | str | None = None,
    count: int = 6,
    loaded: bool = False,
    *,
    rates: None = None,
    **options: Any,
) -> ModeShapes: ...
@takes(
    *options_of(ModesOptions),
    *options_of(Options, *ELEMENTS, "errors"),
    *options_of(AccuracyOptions),
)
def modes(
    scene: Scene | Run | str,
    out: Path | str | None = None,
    count: int = 6,
    loaded: bool = False,
    *,
    parameters: Mapping[str, Any] | None = None,
    pictures: bool | None = None,
    comm: MPI.Comm | None = None,
    **options: Any,
) -> ModeShapes | RotatingModes | StateModes:
    """Natural frequencies and modes of a scene, rigid-body modes included, or buckling modes.

    Args:
        scene: A scene, the name of a bundled one, or the path of a Python file; or a run, whose
            last state is meant then.
        out: Directory to write, new or empty; None: a temporary one.
        count: Number of modes.
        loaded: Whether about the static equilibrium under the scene's loads.
        parameters: Values of the parameters of a scene that is named.
        pictures: Whether the modes are drawn; None: where `out` is given.
        comm: Communicator; None: all ranks.
        **options: What modes are about, and choices that replace the scene's.

    Raises:
        SceneError: If a body has no mass, or the scene is impossible.
        ConvergenceError: If the static state or the modes do not converge.
    """
    from shellmb.api.folders import placed
    from shellmb.running.natural_modes.run import find_modes
    from shellmb.running.request import scene_of_run

    if isinstance(scene, Run):
        if options.get("state") is not None:
            raise SceneError("modes: the scene is a run, and a state is given, too; give one")
        options["state"], made_here = scene, scene.computed is not None
        scene = scene.scene if made_here else scene_of_run(scene.directory, "modes")[0]
    chosen, accuracy = take(ModesOptions, options, loaded=loaded), take_accuracy(options)
    if accuracy is not None or options.get("errors"):
        chosen.check_errors()
    wanted = requested(scene, parameters, **options)
    chosen.check()
    place = placed(out, comm)
    directory, world = place.directory, place.comm
    measure = wanted.module.mode_results if wanted.module is not None else None
    draw = out is not None if pictures is None else pictures
    how: Any = {"comm": world, "pictures": draw}
    frame = (chosen.axis, chosen.about)
    made: ModeShapes | RotatingModes | StateModes
    if accuracy is not None:
        from shellmb.accuracy.request.directory import run_to_accuracy
        from shellmb.accuracy.request.search import Running
        from shellmb.accuracy.request.target import wanted_of

        of = replace(wanted_of(accuracy), modes=True, loaded=loaded, count=count)
        running = Running(world, request=wanted.request, mode_results=measure)
        run_to_accuracy(wanted.scene, of, directory, running, draw)
        made = ModeShapes(directory)
    elif chosen.buckling:
        from shellmb.running.natural_modes.run import find_buckling

        made = ModeShapes(directory, find_buckling(wanted.scene, directory, count, **how))
    elif chosen.moving:
        from shellmb.running.rotating.files import find_state_modes

        state: Any = chosen.state
        run = state.directory if isinstance(state, Run) else state
        steady = (run, count, chosen.rates, *frame)
        about = find_state_modes(wanted.scene, directory, *steady, at=chosen.at, **how)
        made = StateModes(directory, about)
    elif chosen.rates is None:
        found, summary = find_modes(wanted.scene, directory, count, loaded, results=measure, **how)
        if wanted.scene.errors:
            from shellmb.accuracy.modes import add_mode_errors

            add_mode_errors(wanted.scene, found, summary, directory, loaded, measure)
        made = ModeShapes(directory, found)
    else:
        from shellmb.running.rotating.files import find_campbell

        over, _ = find_campbell(
            wanted.scene, directory, chosen.rates, count, loaded, *frame, results=measure, **how
        )
        made = RotatingModes(directory, over)
    world.Barrier()
    return place.held_by(made)
