"""Natural modes of a scene, and those over the rate at which it turns: `sm.modes`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from shellmb.api.modeshapes import ModeShapes, RotatingModes, StateModes
from shellmb.api.record import Run, scene_of
from shellmb.api.runs import Requested, placed, requested
from shellmb.errors import TooFewModesError
from shellmb.options.described import options_of, take, takes
from shellmb.options.linear import ModesOptions
from shellmb.options.run import ELEMENTS, AccuracyOptions, Options, take_accuracy
from shellmb.scene import Scene

if TYPE_CHECKING:
    from mpi4py import MPI


# modes that are found if no number is given
MOST = 6


@takes(
    *options_of(ModesOptions),
    *options_of(Options, *ELEMENTS, "errors"),
    *options_of(AccuracyOptions),
)
def modes(
    scene: Scene | Run | str,
    out: Path | str | None = None,
    count: int | None = None,
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
        count: Number of modes; None: six, or as many as there are.
        loaded: Whether about the static equilibrium under the scene's loads.
        parameters: Values of the parameters of a scene that is named.
        pictures: Whether the modes are drawn; None: where `out` is given.
        comm: Communicator; None: all ranks.
        **options: What modes are about, and choices that replace the scene's.

    Raises:
        SceneError: If a body has no mass, or the scene is impossible.
        ConvergenceError: If the static state or the modes do not converge.
    """
    scene = scene_of(scene, options, "modes")
    chosen, accuracy = take(ModesOptions, options, loaded=loaded), take_accuracy(options)
    chosen.check(accuracy is not None or bool(options.get("errors")))
    wanted = requested(scene, parameters, **options)
    place = placed(out, comm)
    draw = out is not None if pictures is None else pictures
    made = write_modes(wanted, chosen, accuracy, count, place.directory, place.comm, draw)
    place.comm.Barrier()
    return place.held_by(made)


def at_most[T](count: int, find: Callable[[int], T]) -> T:
    """Result for so many modes, or for as many as there are."""
    try:
        return find(count)
    except TooFewModesError as error:
        if error.there == 0:
            raise
        return find(error.there)


def write_modes(
    wanted: Requested,
    chosen: ModesOptions,
    accuracy: AccuracyOptions | None,
    count: int | None,
    directory: Path,
    comm: MPI.Comm,
    pictures: bool,
    **more: Any,
) -> ModeShapes | RotatingModes | StateModes:
    """Find modes of the kind that options say, and write them.

    Args:
        wanted: The scene.
        chosen: What they are about.
        accuracy: The error that finer and finer meshes have to meet; None: there is none.
        count: Number of modes; None: up to `MOST`.
        directory: Directory to write.
        comm: Communicator.
        pictures: Whether they are drawn.
        **more: To an accuracy also `begin` and `tell`, as `Requested.run` has them.
    """
    if count is None:
        given = wanted, chosen, accuracy
        return at_most(MOST, lambda n: write_modes(*given, n, directory, comm, pictures, **more))
    if accuracy is not None:
        of = replace(accuracy, modes=True, loaded=chosen.loaded, count=count)
        found: Any = wanted.run(directory, comm, pictures, of, **more)
        return found
    from shellmb.running.natural_modes.run import find_buckling, find_modes, write_found
    from shellmb.running.rotating.files import find_campbell, find_state_modes

    scene, measure = wanted.scene, wanted.module.mode_results
    kind: type[ModeShapes | RotatingModes] = ModeShapes
    if chosen.buckling:
        find, measure = partial(find_buckling, count=count), None
    elif chosen.moving:
        find, measure = partial(find_state_modes, count=count, chosen=chosen), None
        kind = StateModes
    elif chosen.rates is not None:
        find, kind = partial(find_campbell, count=count, chosen=chosen), RotatingModes
    else:
        find = partial(find_modes, count=count, loaded=chosen.loaded)
    how: dict[str, Any] = {"results": measure, "comm": comm, "pictures": pictures}
    computed, summary = write_found(find, scene, directory, **how)
    if scene.errors:
        from shellmb.accuracy.modes import mode_errors

        errors = mode_errors(scene, computed, summary["results"], chosen.loaded, measure)
        errors.write(summary, directory, comm)
    return kind(directory, computed)
