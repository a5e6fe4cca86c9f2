"""Go on with a run where it stopped, and states of it, the last one or that of any time."""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mpi4py import MPI

from shellmb.errors import SceneError, of_first
from shellmb.observers.files.checkpoint import Arrays, Saved
from shellmb.running.directory import claimed
from shellmb.running.execute import RunResult, execute, take_up
from shellmb.running.request import REQUEST, Request, read_request
from shellmb.running.results import Results
from shellmb.running.saved import has_begun, read_saved
from shellmb.running.standard import StandardObservers
from shellmb.scene import Scene
from shellmb.scene.fingerprint import Difference, differences, fingerprint
from shellmb.simulate.simulation import Observer, Simulation

# fields of a scene that say how its equations are solved, and not what they are
NUMERICAL = ("solver", "step_control", "errors")
# but with an error or without, the size of steps follows from other states
CONTROLLED = "step_control.step_error"
# so many differences are named
NAMED = 5

_log = logging.getLogger(__name__)


def resume(
    out: Path | str,
    observers: Sequence[Observer] = (),
    *,
    comm: MPI.Comm = MPI.COMM_WORLD,
    pictures: bool = True,
    scene: Scene | None = None,
    scene_file: str | None = None,
    trust: bool = False,
    results: Results | None = None,
) -> RunResult:
    """Go on with a run from its last state; serially it ends bit for bit as if never stopped.

    Args:
        out: The run directory.
        observers: The same additional observers as in the run.
        comm: Communicator; with another number of ranks than the run's, the run ends as if never
            stopped to round-off.
        pictures: Whether pictures are drawn.
        scene: The scene, for runs that were not started by `shellmb run`.
        scene_file: The path of the scene's file, where the run was started from one.
        trust: Whether the file that the run directory names may be executed, without its path.
        results: Gives the `results` of the summary; None: the module that the scene is from.

    Raises:
        SceneError: If the directory holds no run, another run is writing it, its scene is a file
            that was not given, or the state is damaged or of another scene.
        ConvergenceError: If the run fails again.
        RunError: If it cannot be written, or a function of the user's raises.
    """
    directory, request = Path(out), None
    if scene is None:
        request = read_request(directory).trusted(scene_file, trust)
        scene, module = request.build()
        results = module.results
    if not comm.bcast(directory.is_dir()):
        raise SceneError(f"resume: there is no directory {directory}; give the directory of a run")
    with claimed(directory, comm, new=False):
        # killed before its first state a run has computed nothing: it begins again
        saved = None
        said: list[str] = []
        if of_first(comm, lambda: has_begun(directory)) or request is None:
            saved = read_saved(directory, comm, spread=True)
            said += _same_scene(scene, saved.scene, request)
        if request is not None:
            said += _same_request(directory, request, saved is not None)
        for line in said if comm.rank == 0 else []:
            _log.warning("resume: %s", line)
        return execute(
            scene,
            directory,
            observers,
            comm=comm,
            pictures=pictures,
            request=request,
            results=results,
            saved=saved,
            new=False,
        )


def _same_scene(scene: Scene, then: dict[str, Any], request: Request | None) -> list[str]:
    """Refuse other physics; lines that say what else has changed."""
    found = differences(then, fingerprint(scene))
    numerical = [d for d in found if d[0].split(".")[0] in NUMERICAL]
    physical = [d for d in found if d not in numerical or (d[0] == CONTROLLED and "null" in d)]
    if physical:
        edited = "" if request is None or request.unchanged else f"; {REQUEST} was edited"
        raise SceneError(
            f"resume: the state is not of the scene '{scene.name}' as it is now: "
            f"{_in_words(physical)}{edited}; undo the changes, or start the run again"
        )
    return [f"other numerical settings: {_in_words(numerical)}"] if numerical else []


def _same_request(directory: Path, request: Request, begun: bool) -> list[str]:
    """Lines that say that the same scene is requested in other words."""
    lines = []
    if not request.unchanged:
        file = directory / REQUEST
        if not begun:
            raise SceneError(
                f"resume: {file} was edited, and there is no state that says what was run; start "
                "the run again in another directory"
            )
        lines.append(f"{file} was edited, and still means the same scene")
    if begun and not request.same_file():
        lines.append(f"{request.scene} was edited, and still defines the same scene")
    return lines


def _in_words(found: list[Difference]) -> str:
    named = [f"{path} was {was}, is {now}" for path, was, now in found[:NAMED]]
    more = len(found) - NAMED
    return ", ".join([*named, f"and {more} more"] if more > 0 else named)


# fields of a scene that say how a run gets to a state, which is the same state without them
HOW = frozenset("scheme alpha dt t_end start assemble solver step_control initial events".split())

# of a time: nearer than this the saved state is the one that is requested
SAME_TIME = 1e-9


@dataclass(frozen=True)
class StateOfRun:
    """A state of a run that there is, or that the run passes.

    Args:
        scene: The scene of the run.
        saved: The last state of the run; None: nothing has been run.
        at: Time of the state, s; None: that of the saved one.
    """

    scene: Scene
    saved: Saved | None
    at: float | None

    @property
    def scheme(self) -> str:
        """Scheme of the run."""
        then = {} if self.saved is None else self.saved.scene
        return str(then.get("scheme", self.scene.scheme))

    @property
    def begin(self) -> float | None:
        """Time from which the scene is run, s; None: it is not, the state is the saved one."""
        if self.at is None:
            return None
        last = 0.0 if self.saved is None else float(self.saved.simulation["t"])
        if self.saved is not None and abs(self.at - last) <= SAME_TIME * abs(last):
            return None
        return last if self.at > last else 0.0

    def reach(self, comm: MPI.Comm) -> tuple[Arrays, Mapping[str, Any]]:
        """The state, as `Simulation.arrays` and `Simulation.state` give it.

        Between two times of the run the last step is shorter; all others are those of the run.

        Args:
            comm: Communicator; the call is collective.

        Raises:
            SceneError: If an event ends the run before.
            ConvergenceError: If a step fails.
        """
        begin = self.begin
        if begin is None:
            assert self.saved is not None
            return self.saved.arrays, self.saved.simulation
        assert self.at is not None
        simulation = Simulation(self.scene, comm)
        # events read what these measure
        named = StandardObservers(None, ()).named
        if begin and self.saved is not None:
            take_up(simulation, named, self.saved)
        simulation.t_end = self.at
        simulation.run(list(named.values()))
        if simulation.control.ended is not None and simulation.t < self.at:
            raise SceneError(f"at is {self.at:g}; an event ends the run at t = {simulation.t:g}")
        return simulation.saved()


def state_of_run(scene: Scene, run: Path | None, at: float | None, comm: MPI.Comm) -> StateOfRun:
    """State that is meant, before anything is built.

    Args:
        scene: The scene.
        run: Directory of a run of it; None: the scene itself is run.
        at: Time of the state, s; None: the last one of the run.
        comm: Communicator, of as many ranks as the run's.

    Raises:
        SceneError: If there is no such state, or it is of another scene.
    """
    saved = None if run is None else read_saved(run, comm)
    if saved is not None:
        _check_same(scene, saved, run, HOW, "with its parameters and mesh")
    found = StateOfRun(scene, saved, at)
    if at is not None and found.begin is not None:
        _check_passed(found, at, run)
    elif saved is not None:
        _check_whole(saved, run)
    return found


def _check_same(
    scene: Scene, saved: Saved, run: Path | None, free: frozenset[str], requested: str
) -> None:
    """Check that a run was one of this scene, but for some fields."""
    found = differences(saved.scene, fingerprint(scene))
    others = [d for d in found if _field(d[0]) not in free]
    if others:
        path, was, now = others[0]
        raise SceneError(
            f"the state in {run} is of another scene: {path} was {was}, is {now}"
            + (f", and {len(others) - 1} more" if others[1:] else "")
            + f"; give the scene of the run, {requested}"
        )


def _check_whole(saved: Saved, run: Path | None) -> None:
    """Loads of a static run are whole at its end only."""
    t, end = float(saved.simulation["t"]), saved.scene.get("t_end")
    if (
        saved.scene.get("scheme") == "static"
        and isinstance(end, int | float)
        and t < end * (1 - SAME_TIME)
    ):
        raise SceneError(
            f"the static run in {run} is at {t:g} of {end:g}; its loads are not whole yet, "
            "let it finish first"
        )


def _check_passed(state: StateOfRun, at: float, run: Path | None) -> None:
    """Check that a run passes a time."""
    scene, end = state.scene, state.scene.t_end
    if scene.static:
        raise SceneError(
            f"at is {at:g}, and the scene is static; its loads are whole at the end only, "
            "leave it out"
        )
    if not 0 <= at <= end * (1 + SAME_TIME):
        raise SceneError(f"at is {at:g}; the run goes from 0 to {end:g} s")
    if state.saved is not None:
        kept = frozenset({"t_end"})
        _check_same(scene, state.saved, run, kept, "whose steps are taken again")


def _field(path: str) -> str:
    """The field of a scene that a path of its fingerprint begins with."""
    return path.partition(".")[0].partition("[")[0].removesuffix("'s code")
