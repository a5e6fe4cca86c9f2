"""Go on with a run where it stopped."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mpi4py import MPI

from shellmb.errors import SceneError
from shellmb.running.directory import claimed
from shellmb.running.execute import RunResult, execute
from shellmb.running.loader import SceneModule
from shellmb.running.request import REQUEST, Request, StoredRequest, read_request
from shellmb.running.results import Results
from shellmb.running.resuming.saved import has_begun, read_saved
from shellmb.scene import Scene
from shellmb.scene.fingerprint import Difference, differences, fingerprint
from shellmb.simulate.simulation import Observer

# fields of a scene that say how its equations are solved, and not what they are
NUMERICAL = ("solver", "step_control", "errors")
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
    directory = Path(out)
    module: SceneModule | None = None
    request: Request | None = None
    stored: StoredRequest | None = None
    if scene is None:
        stored = read_request(directory)
        request = stored.trusted(scene_file, trust)
        scene, module = request.build()
    if not comm.bcast(directory.is_dir()):
        raise SceneError(f"resume: there is no directory {directory}; give the directory of a run")
    with claimed(directory, comm, new=False):
        # killed before its first state a run has computed nothing: it begins again
        saved = None
        said: list[str] = []
        if has_begun(directory, comm) or request is None:
            saved = read_saved(directory, comm, spread=True)
            said += _same_scene(scene, saved.scene, stored)
        if stored is not None and request is not None:
            said += _same_request(directory, stored, request, saved is not None)
        for line in said if comm.rank == 0 else []:
            _log.warning("resume: %s", line)
        if module is not None:
            results = module.results
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


def _same_scene(scene: Scene, then: dict[str, Any], stored: StoredRequest | None) -> list[str]:
    """Refuse other physics; lines that say what else has changed."""
    found = differences(then, fingerprint(scene))
    numerical = [d for d in found if d[0].split(".")[0] in NUMERICAL]
    physical = [d for d in found if d not in numerical]
    if physical:
        edited = "" if stored is None or stored.unchanged else f"; {REQUEST} was edited"
        raise SceneError(
            f"resume: the state is not of the scene '{scene.name}' as it is now: "
            f"{_in_words(physical)}{edited}; undo the changes, or start the run again"
        )
    return [f"other numerical settings: {_in_words(numerical)}"] if numerical else []


def _same_request(
    directory: Path, stored: StoredRequest, request: Request, begun: bool
) -> list[str]:
    """Lines that say that the same scene is requested in other words."""
    lines = []
    if not stored.unchanged:
        file = directory / REQUEST
        if not begun:
            raise SceneError(
                f"resume: {file} was edited, and there is no state that says what was run; start "
                "the run again in another directory"
            )
        lines.append(f"{file} was edited, and still means the same scene")
    if begun and not stored.same_file(request):
        lines.append(f"{request.scene} was edited, and still defines the same scene")
    return lines


def _in_words(found: list[Difference]) -> str:
    named = [f"{path} was {was}, is {now}" for path, was, now in found[:NAMED]]
    more = len(found) - NAMED
    return ", ".join([*named, f"and {more} more"] if more > 0 else named)
