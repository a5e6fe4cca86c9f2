"""Natural modes of a scene, and those over the rate at which it turns: `sm.modes`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple, overload

from shellmb.api.modeshapes import ModeShapes, RotatingModes, StateModes
from shellmb.api.record import Run, scene_of
from shellmb.api.runs import requested
from shellmb.options.described import options_of, take, takes
from shellmb.options.linear import ModesOptions
from shellmb.options.run import ELEMENTS, AccuracyOptions, Options, take_accuracy
from shellmb.scene import Scene

if TYPE_CHECKING:
    from mpi4py import MPI


# directory to write
type Out = Path | str | None


@overload
def modes(scene: Run, out: Out = None, count: int = 6, **options: Any) -> StateModes: ...
@overload
def modes(
    scene: Scene | str, out: Out = None, count: int = 6, *, state: Run | Path | str, **options: Any
) -> StateModes: ...
@overload
def modes(
    scene: Scene | str, out: Out = None, count: int = 6, *, at: float, **options: Any
) -> StateModes: ...
@overload
def modes(
    scene: Scene | str,
    out: Out = None,
    count: int = 6,
    loaded: bool = False,
    *,
    rates: Sequence[float],
    **options: Any,
) -> RotatingModes: ...
@overload
def modes(
    scene: Scene | str, out: Out = None, count: int = 6, loaded: bool = False, **options: Any
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

    scene = scene_of(scene, options, "modes")
    chosen, accuracy = take(ModesOptions, options, loaded=loaded), take_accuracy(options)
    if accuracy is not None or options.get("errors"):
        chosen.check_errors()
    wanted = requested(scene, parameters, **options)
    chosen.check()
    place = placed(out, comm)
    directory, world = place.directory, place.comm
    draw = out is not None if pictures is None else pictures
    made: ModeShapes | RotatingModes | StateModes
    if accuracy is not None:
        from shellmb.accuracy.request.target import wanted_of

        of = replace(wanted_of(accuracy), modes=True, loaded=loaded, count=count)
        wanted.run_to_accuracy(of, directory, world, draw)
        made = ModeShapes(directory)
    else:
        how: Any = {"comm": world, "pictures": draw}
        measure = wanted.module.mode_results
        done = write_modes(wanted.scene, directory, count, chosen, measure, **how)
        made = done.reader(directory, done.found)
    world.Barrier()
    return place.held_by(made)


class WrittenModes(NamedTuple):
    """Modes of one kind that were found and written.

    Args:
        reader: Class that reads their directory.
        found: The modes.
        results: Results that the scene measures on them.
        errors: Frequencies and results with their errors, by name.
    """

    reader: type[ModeShapes | RotatingModes | StateModes]
    found: Any
    results: Mapping[str, float] = MappingProxyType({})
    errors: Mapping[str, Any] = MappingProxyType({})


def write_modes(
    scene: Scene,
    directory: Path,
    count: int,
    chosen: ModesOptions,
    measure: Callable[[Any], dict[str, float]] | None,
    **how: Any,
) -> WrittenModes:
    """Find modes of the kind that options say, and write them.

    Args:
        scene: The scene.
        directory: Directory to write.
        count: Number of modes.
        chosen: What they are about.
        measure: Gives the results that the scene measures on them.
        how: Communicator, and whether pictures are drawn.

    Raises:
        SceneError: If the scene or its state has no such modes.
        ConvergenceError: If the static state or the modes do not converge.
    """
    if chosen.buckling:
        from shellmb.running.natural_modes.run import find_buckling

        return WrittenModes(ModeShapes, find_buckling(scene, directory, count, **how))
    if chosen.moving:
        from shellmb.running.rotating.files import find_state_modes

        return WrittenModes(StateModes, find_state_modes(scene, directory, count, chosen, **how))
    loaded, how = chosen.loaded, how | {"results": measure}
    if chosen.rates is not None:
        from shellmb.running.rotating.files import find_campbell

        over = find_campbell(scene, directory, count, chosen, **how)
        return WrittenModes(RotatingModes, *over)
    from shellmb.running.natural_modes.run import find_modes

    found, summary = find_modes(scene, directory, count, loaded, **how)
    errors: Mapping[str, Any] = {}
    if scene.errors:
        from shellmb.accuracy.modes import add_mode_errors

        errors = add_mode_errors(scene, found, summary, directory, loaded, measure)
    return WrittenModes(ModeShapes, found, summary["results"], errors)
