"""Natural modes of a scene, and those over the rate at which it turns: `sm.modes`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

from shellmb.api.modeshapes import ModeShapes
from shellmb.api.record import Run
from shellmb.api.requested import requested
from shellmb.api.rotating import RotatingModes, StateModes
from shellmb.errors import SceneError
from shellmb.options.accuracy import AccuracyOptions, take_accuracy
from shellmb.options.described import options_of, takes
from shellmb.options.run import ELEMENTS, NATURAL, Options
from shellmb.scene import Scene

if TYPE_CHECKING:
    from mpi4py import MPI


@overload
def modes(
    scene: Scene | str,
    out: Path | str | None = None,
    count: int = 6,
    loaded: bool = False,
    *,
    rates: None = None,
    buckling: bool = False,
    parameters: Mapping[str, Any] | None = None,
    pictures: bool | None = None,
    comm: MPI.Comm | None = None,
    **elements: Any,
) -> ModeShapes: ...


@overload
def modes(
    scene: Scene | str,
    out: Path | str | None = None,
    count: int = 6,
    loaded: bool = False,
    *,
    rates: Sequence[float],
    axis: Sequence[float] | None = None,
    about: Sequence[float] | None = None,
    parameters: Mapping[str, Any] | None = None,
    pictures: bool | None = None,
    comm: MPI.Comm | None = None,
    **elements: Any,
) -> RotatingModes: ...


@overload
def modes(
    scene: Scene | str,
    out: Path | str | None = None,
    count: int = 6,
    *,
    state: Run | Path | str,
    at: float | None = None,
    rates: Sequence[float] | None = None,
    axis: Sequence[float] | None = None,
    about: Sequence[float] | None = None,
    parameters: Mapping[str, Any] | None = None,
    pictures: bool | None = None,
    comm: MPI.Comm | None = None,
    **elements: Any,
) -> StateModes: ...


@overload
def modes(
    scene: Scene | str,
    out: Path | str | None = None,
    count: int = 6,
    *,
    at: float,
    rates: Sequence[float] | None = None,
    axis: Sequence[float] | None = None,
    about: Sequence[float] | None = None,
    parameters: Mapping[str, Any] | None = None,
    pictures: bool | None = None,
    comm: MPI.Comm | None = None,
    **elements: Any,
) -> StateModes: ...


@overload
def modes(
    scene: Run,
    out: Path | str | None = None,
    count: int = 6,
    *,
    at: float | None = None,
    rates: Sequence[float] | None = None,
    axis: Sequence[float] | None = None,
    about: Sequence[float] | None = None,
    pictures: bool | None = None,
    comm: MPI.Comm | None = None,
) -> StateModes: ...


@takes(*options_of(Options, *ELEMENTS, "errors"), *options_of(AccuracyOptions))
def modes(
    scene: Scene | Run | str,
    out: Path | str | None = None,
    count: int = 6,
    loaded: bool = False,
    *,
    rates: Sequence[float] | None = None,
    axis: Sequence[float] | None = None,
    about: Sequence[float] | None = None,
    state: Run | Path | str | None = None,
    at: float | None = None,
    buckling: bool = False,
    parameters: Mapping[str, Any] | None = None,
    pictures: bool | None = None,
    comm: MPI.Comm | None = None,
    **elements: Any,
) -> ModeShapes | RotatingModes | StateModes:
    """Natural frequencies and modes of a scene, rigid-body modes included, or buckling modes.

    Args:
        scene: A scene, the name of a bundled one, or the path of a Python file; or a run, whose
            last state is meant then.
        out: Directory to write, new or empty; None: a temporary one.
        count: Number of modes.
        loaded: Whether about the static equilibrium under the scene's loads.
        rates: Rates of a steady rotation, ascending, rad/s: complex modes about each; None: about
            rest, without damping.
        axis: Direction of the axis of rotation; None: that about which the scene turns.
        about: A point of that axis.
        state: A run of the scene, or its directory: complex modes about its last state, frozen in
            time, in a frame that turns as the state does, or with the one rate of `rates`.
        at: Time of that state, s, up to which the scene is run as it is, from where the run is or
            from the start; without a run the scene itself.
        buckling: Whether load factors of linear buckling under the scene's loads are found.
        parameters: Values of the parameters of a scene that is named.
        pictures: Whether the modes are drawn; None: where `out` is given.
        comm: Communicator; None: all ranks.
        **elements: Choices that replace the scene's, as `shellmb modes` has them.

    Raises:
        SceneError: If a body has no mass, or the scene is impossible.
        ConvergenceError: If the static state or the modes do not converge.
    """
    from mpi4py import MPI

    from shellmb.api.folders import gone_with, place
    from shellmb.running.modes import find_modes
    from shellmb.running.request import scene_of_run

    if isinstance(scene, Run):
        if state is not None:
            raise SceneError("modes: the scene is a run, and a state is given, too; give one")
        state, made_here = scene, scene.computed is not None
        scene = scene.scene if made_here else scene_of_run(scene.directory, "modes")[0]
    accuracy = take_accuracy(elements)
    if elements.get("errors") and not (rates is None and state is None and at is None):
        raise SceneError(NATURAL)
    if accuracy is not None and (buckling or any(v is not None for v in (rates, state, at))):
        raise SceneError(NATURAL)
    wanted = requested(scene, parameters, **elements)
    world = MPI.COMM_WORLD if comm is None else comm
    directory, temporary = place(out, world)
    measure = wanted.module.mode_results if wanted.module is not None else None
    draw = out is not None if pictures is None else pictures
    made: ModeShapes | RotatingModes | StateModes
    if accuracy is not None:
        from shellmb.accuracy.request.place import run_to_accuracy
        from shellmb.accuracy.request.search import Running
        from shellmb.accuracy.request.wanted import wanted_of

        of = replace(wanted_of(accuracy), modes=True, loaded=loaded, count=count)
        how = Running(world, request=wanted.request, mode_results=measure)
        run_to_accuracy(wanted.scene, of, directory, how, draw)
        made = ModeShapes(directory)
    elif buckling:
        from shellmb.running.modes import find_buckling

        if loaded or any(item is not None for item in (rates, axis, about, state, at)):
            raise SceneError(
                "modes: buckling is about the reference; loaded, rates, axis, about, state and at "
                "must be left out"
            )
        buckled = find_buckling(wanted.scene, directory, count, comm=world, pictures=draw)
        made = ModeShapes(directory, buckled)
    elif state is not None or at is not None:
        frame = (rates, axis, about)
        made = _about(wanted.scene, directory, state, at, count, loaded, frame, draw, world)
    elif rates is None:
        if axis is not None or about is not None:
            raise SceneError("modes: axis and about are given without rates; give rates, too")
        found, summary = find_modes(
            wanted.scene, directory, count, loaded, results=measure, comm=world, pictures=draw
        )
        if wanted.scene.errors:
            from shellmb.accuracy.modes import add_mode_errors

            add_mode_errors(wanted.scene, found, summary, directory, loaded, measure)
        made = ModeShapes(directory, found)
    else:
        from shellmb.rotating.files import find_campbell

        steady = (rates, count, loaded, axis, about)
        over, _ = find_campbell(
            wanted.scene, directory, *steady, results=measure, comm=world, pictures=draw
        )
        made = RotatingModes(directory, over)
    world.Barrier()
    if temporary:
        gone_with(made, directory, world.rank)
    return made


def _about(
    scene: Scene,
    directory: Path,
    state: Run | Path | str | None,
    at: float | None,
    count: int,
    loaded: bool,
    frame: tuple[Sequence[float] | None, Sequence[float] | None, Sequence[float] | None],
    pictures: bool,
    comm: MPI.Comm,
) -> StateModes:
    """Modes about a state of a run."""
    from shellmb.rotating.files import find_state_modes

    if loaded:
        raise SceneError("modes: loaded is given with a state, whose loads act; leave it out")
    run = state.directory if isinstance(state, Run) else state
    found = find_state_modes(
        scene, directory, run, count, *frame, at=at, comm=comm, pictures=pictures
    )
    comm.Barrier()
    return StateModes(directory, found)
