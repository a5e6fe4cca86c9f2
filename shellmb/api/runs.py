"""Runs from Python: `sm.run`, `sm.resume`, `sm.load`, and the directories that they are in."""

from __future__ import annotations

import atexit
import shutil
import tempfile
import weakref
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from shellmb.api.modeshapes import CAMPBELL, TABLE, ModeShapes, RotatingModes, StateModes
from shellmb.api.record import Run
from shellmb.errors import SceneError
from shellmb.files.locks import HELD
from shellmb.options.described import options_of, read, takes
from shellmb.options.run import ACCURACY, AccuracyOptions, Options, take_accuracy
from shellmb.running.loader import SceneModule, demos, given
from shellmb.running.request import Request, read_request
from shellmb.scene import Scene

if TYPE_CHECKING:
    from mpi4py import MPI

    from shellmb.api.sensitivity.record import Sensitivities
    from shellmb.running.execute import RunResult
    from shellmb.simulate.simulation import Observer


def path_of(given: Any) -> Path:
    """A directory that is given by its path, or by what stands for it, as a run does.

    Args:
        given: A path, or something with a `directory`.
    """
    return Path(getattr(given, "directory", given))


@dataclass(frozen=True)
class Place:
    """Directory of a run.

    Args:
        directory: It.
        comm: Communicator of the run.
        temporary: Whether it goes with what holds it.
    """

    directory: Path
    comm: MPI.Comm
    temporary: bool

    def held_by[T](self, found: T) -> T:
        """Return what was found; a temporary directory goes when no rank uses it any more.

        A run is read when it is requested, on each rank by itself: the last one removes it.

        Args:
            found: The run.
        """
        if self.temporary:
            weakref.finalize(found, _let_go, self.directory, self.comm.rank)
        return found


def placed(out: Path | str | None, comm: MPI.Comm | None) -> Place:
    """Directory of a run; collective.

    Args:
        out: As given; None: a temporary one.
        comm: Communicator; None: all ranks.
    """
    from mpi4py import MPI

    world = MPI.COMM_WORLD if comm is None else comm
    if out is not None:
        return Place(path_of(out), world, False)
    made = None
    if world.rank == 0:
        made = Path(tempfile.mkdtemp(prefix="shellmb-"))
        for rank in range(world.size):
            (made / HELD.format(rank=rank)).touch()
    directory = Path(world.bcast(made), "run")
    # also where the run fails, and nobody holds it
    atexit.register(_let_go, directory, world.rank)
    return Place(directory, world, True)


def _let_go(directory: Path, rank: int) -> None:
    """Let go of a temporary directory; without any rank that holds it, it is removed."""
    (directory.parent / HELD.format(rank=rank)).unlink(missing_ok=True)
    if not any(directory.parent.glob(HELD.format(rank="*"))):
        shutil.rmtree(directory.parent, ignore_errors=True)


@dataclass(frozen=True)
class Requested:
    """A scene as it is to be run.

    Args:
        scene: The scene.
        module: The module that defines it.
        request: How it can be built again; None for a scene that was given as it is.
    """

    scene: Scene
    module: SceneModule
    request: Request | None = None

    def run(
        self,
        directory: Path,
        comm: MPI.Comm,
        pictures: bool,
        target: AccuracyOptions | None = None,
        begin: Callable[[], None] = lambda: None,
        **how: Any,
    ) -> Run | ModeShapes:
        """Run it, or finer and finer levels of it until an error is met.

        Args:
            directory: Directory to write.
            comm: Communicator.
            pictures: Whether pictures are drawn.
            target: The error, which may be of natural modes; None: it is run once, with errors if
                the scene wants them.
            begin: Called when all that this takes is loaded.
            **how: Observers; of levels also `tell` and `modes` as in `Running`.
        """
        how |= {"comm": comm, "request": self.request, "results": self.module.results}
        if target is None:
            from shellmb.running.execute import execute

            begin()
            return _ended(execute(self.scene, directory, pictures=pictures, **how), pictures)
        from shellmb.accuracy.request.directory import run_to_accuracy
        from shellmb.accuracy.request.search import Running

        begin()
        running = Running(mode_results=self.module.mode_results, **how)
        outcome = run_to_accuracy(self.scene, target, directory, running, pictures)
        # the last level is the run, or the modes, of the directory
        modes = (directory / TABLE).is_file()
        return ModeShapes(directory) if modes else Run(directory, outcome.run)


def _ended(computed: RunResult, pictures: bool) -> Run:
    """A run at its end, with its errors if its scene wants them; collective."""
    if computed.scene.errors:
        from shellmb.accuracy.errors import add_errors

        add_errors(computed, pictures)
    computed.simulation.model.comm.Barrier()
    assert computed.out is not None
    return Run(computed.out, computed)


def requested(
    scene: Scene | str, parameters: Mapping[str, Any] | None, **options: Any
) -> Requested:
    """The scene that a call requests.

    Args:
        scene: A scene, or its name or file.
        parameters: Values of the parameters of a scene that is named.
        options: Of `Options`, what replaces choices of the scene; None: nothing.

    Raises:
        SceneError: If anything about it is wrong.
    """
    chosen = Options(**read(Options, options))
    if isinstance(scene, Scene):
        module = given(scene, parameters or {})
        return Requested(chosen.apply(scene), module)
    if not isinstance(scene, str):
        raise SceneError(
            f"scene is a {type(scene).__name__}; it must be a Scene, the name of a bundled one, or "
            "the path of a Python file"
        )
    request = Request(scene, as_text(parameters or {}), chosen)
    return Requested(*request.build(), request)


def refuse_ranks(what: str) -> None:
    """Refuse several ranks.

    Args:
        what: What is called, for the error.

    Raises:
        SceneError: If there are several.
    """
    from mpi4py import MPI

    if (ranks := MPI.COMM_WORLD.size) > 1:
        raise SceneError(f"{what}: there are {ranks} ranks; it must be called in one process")


def as_text(parameters: Mapping[str, Any]) -> dict[str, str]:
    """Values of parameters as on a command line.

    Args:
        parameters: Values by name.
    """
    return {
        name: ",".join(map(str, value)) if isinstance(value, list | tuple) else str(value)
        for name, value in parameters.items()
    }


# what a directory of sensitivities has
SENSITIVITIES = "sensitivities.json"


@takes(*options_of(Options), *options_of(AccuracyOptions))
def run(
    scene: Scene | str,
    out: Path | str | None = None,
    *,
    parameters: Mapping[str, Any] | None = None,
    observers: Sequence[Observer] = (),
    pictures: bool | None = None,
    progress: bool | None = None,
    comm: MPI.Comm | None = None,
    **options: Any,
) -> Run:
    """Run a scene.

    Args:
        scene: A scene, the name of a bundled one (`scenes()`), or the path of a Python file.
        out: Run directory, new or empty; None: a temporary one, deleted with the run.
        parameters: Values of the parameters of a bundled scene or a file.
        observers: Further observers; what they measure becomes columns of the history.
        pictures: Whether to draw pictures at the end; None: if `out` is given.
        progress: Whether stderr shows progress: a bar with the time that is left; None: on a
            terminal and in a notebook.
        comm: Communicator; None: all ranks.
        **options: Choices that replace the scene's, as `shellmb run` has them.

    Returns:
        The run, the same on all ranks.

    Raises:
        SceneError: If the scene is impossible, or `out` cannot be written or holds a run.
        ConvergenceError: If a step fails at the smallest step size; what was computed is in `out`.
        RunError: If the disk is full, or the scene's function of results raises.
    """
    accuracy = take_accuracy(options)
    wanted = requested(scene, parameters, **options)
    place = placed(out, comm)
    from shellmb.observers.progress import ProgressReport, is_watched

    shown = is_watched() if progress is None else progress
    report = ProgressReport()
    if shown:
        observers = [*observers, report]
    draw = out is not None if pictures is None else pictures
    if accuracy is None:
        with report.building(wanted.scene.name, place.comm.rank) if shown else nullcontext():
            found: Any = wanted.run(place.directory, place.comm, draw, observers=observers)
        return place.held_by(found)
    from shellmb.accuracy.request.levels import UnknownQuantity, frequency_number

    how: dict[str, Any] = {"observers": observers, "modes": False}
    if shown and place.comm.rank == 0:
        how["tell"] = print
    try:
        found = wanted.run(place.directory, place.comm, draw, accuracy, **how)
        return place.held_by(found)
    except UnknownQuantity as error:
        if frequency_number(accuracy.of) is None:
            raise
        raise SceneError(
            f"{error}; natural frequencies come from modes(scene, accuracy=..., of='{accuracy.of}')"
        ) from None


@takes()
def resume(
    out: Path | str,
    scene: Scene | str | None = None,
    *,
    trust: bool = False,
    observers: Sequence[Observer] = (),
    pictures: bool = True,
    comm: MPI.Comm | None = None,
) -> Run | ModeShapes:
    """Continue a run from its last saved state, or the levels of a request with ``accuracy``.

    Args:
        out: Its directory.
        scene: The scene, if it was given as one; or its file, if it has one.
        trust: Whether the file that the directory names as its scene may be executed.
        observers: The same additional observers as in the run.
        pictures: Whether pictures are drawn at the end.
        comm: Communicator, of as many ranks as the run's; None: all ranks.

    Returns:
        The run; of a request for modes these.

    Raises:
        SceneError: If there is no such run, its state is damaged or of another scene.
        ConvergenceError: If it fails again.
        RunError: If it cannot be written.
    """
    from mpi4py import MPI

    if not (scene is None or isinstance(scene, str | Scene)):
        raise SceneError(
            f"resume: scene is a {type(scene).__name__}; it must be the Scene of the run, or the "
            "path of its Python file"
        )
    world = MPI.COMM_WORLD if comm is None else comm
    return resumed(path_of(out), scene, trust, world, pictures, observers=observers)


def resumed(
    out: Path,
    scene: Scene | str | None,
    trust: bool,
    comm: MPI.Comm,
    pictures: bool,
    begin: Callable[[], None] = lambda: None,
    **how: Any,
) -> Run | ModeShapes:
    """Continue a run, or the levels of a request.

    Args:
        out: The directory.
        scene: The scene, or its file.
        trust: Whether the file that the directory names as its scene may be executed.
        comm: Communicator.
        pictures: Whether pictures are drawn.
        begin: Called when all that this takes is loaded.
        **how: Observers; of levels also `tell`.
    """
    made, file = (scene, None) if isinstance(scene, Scene) else (None, scene)
    if (out / ACCURACY).is_file():
        from shellmb.accuracy.request.directory import wanted_in

        if made is None:
            request = read_request(out).trusted(file, trust)
            again = Requested(*request.build(), request)
        else:
            again = requested(made, None)
        return again.run(out, comm, pictures, wanted_in(out), begin, **how)
    from shellmb.running.resume import resume as go_on

    begin()
    how |= {"comm": comm, "pictures": pictures, "trust": trust}
    return _ended(go_on(out, scene=made, scene_file=file, **how), pictures)


@takes()
def load(directory: Path | str) -> Run | ModeShapes | RotatingModes | Sensitivities:
    """Read a run, modes or sensitivities from a directory, without executing anything in it.

    Args:
        directory: It.

    Raises:
        SceneError: If it holds none of them, or is damaged.
    """
    folder = path_of(directory)
    if (folder / SENSITIVITIES).is_file():
        from shellmb.api.sensitivity.record import Sensitivities

        return Sensitivities(folder)
    if (folder / CAMPBELL).is_file():
        return RotatingModes(folder)
    if not (folder / TABLE).is_file():
        return Run(folder)
    found = ModeShapes(folder)
    # only those about a state of a run tell how far it moves meanwhile
    return StateModes(folder) if "drift" in found.summary else found


def scenes() -> dict[str, str]:
    """Names of the bundled scenes, each with a one-line description."""
    return demos()


def load_scene(scene: str, **parameters: Any) -> Scene:
    """Load a scene by its bundled name or from a Python file, to change and run it.

    Args:
        scene: Name of a bundled scene, or path of a Python file.
        parameters: Values of its parameters.

    Raises:
        SceneError: If there is no such scene, or it is impossible.
    """
    return requested(scene, parameters).scene
