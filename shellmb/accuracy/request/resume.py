"""Go on with a request that was stopped."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from mpi4py import MPI

from shellmb.accuracy.request.directory import run_to_accuracy, wanted_in
from shellmb.accuracy.request.search import Outcome, Running
from shellmb.running.request import read_request
from shellmb.scene import Scene
from shellmb.simulate.simulation import Observer


def resume_request(
    out: Path,
    scene: Scene | None,
    file: str | None,
    trust: bool,
    comm: MPI.Comm,
    pictures: bool = True,
    tell: Callable[[str], None] = lambda text: None,
    observers: Sequence[Observer] = (),
) -> Outcome:
    """Go on with a request from its levels.

    Args:
        out: Its directory.
        scene: The scene, if it was given as one.
        file: The scene's file, if it has one.
        trust: Whether the file that the directory names may be executed.
        comm: Communicator.
        pictures: Whether pictures are drawn at the end.
        tell: Callback for progress messages.
        observers: More observers of the levels' runs.

    Raises:
        SceneError: If the directory holds no such request, or one of another scene.
        ConvergenceError: If the first level fails again.
    """
    results, mode_results, request = None, None, None
    if scene is None:
        request = read_request(out).trusted(file, trust)
        scene, module = request.build()
        results, mode_results = module.results, module.mode_results
    wanted = wanted_in(out)
    assert wanted is not None
    how = Running(comm, results, request, observers, tell, mode_results)
    return run_to_accuracy(scene, wanted, out, how, pictures)
