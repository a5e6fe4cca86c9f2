"""The runs of an example: made, gone on with, or read where they are finished."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from mpi4py import MPI

import pandas as pd

from demos.paper.example import FinishedRun, Run
from shellmb.errors import ConvergenceError, SceneError
from shellmb.files.reading import Damaged, read_json
from shellmb.meshes.lifetime import free
from shellmb.observers.history import read_history
from shellmb.observers.progress import ProgressReport
from shellmb.options.run import Options
from shellmb.running.execute import INTERRUPTED, execute
from shellmb.running.request import REQUEST, Request, read_request
from shellmb.running.resume import resume
from shellmb.running.standard import HISTORY, SUMMARY
from shellmb.scene import Scene

State = Literal["new", "stopped", "finished"]

# a time this near to the end, relative to it, is the end
END = 1e-9


def request_of(run: Run) -> Request:
    """Command line that asks for a run."""
    return Request(run.demo, {k: _text(v) for k, v in run.settings.items()}, Options(**run.options))


def _text(value: Any) -> str:
    return ",".join(map(str, value)) if isinstance(value, list | tuple) else str(value)


def finish(run: Run, directory: Path, comm: MPI.Comm = MPI.COMM_WORLD) -> FinishedRun:
    """Make a run, or go on with it, or read it if it is finished.

    Raises:
        SceneError: If the directory holds another run, or the run is impossible.
        ConvergenceError: If the run fails and is not expected to.
    """
    request = request_of(run)
    scene, module = request.build()
    state = comm.bcast(_state_or_error(run, request, directory) if comm.rank == 0 else None)
    if isinstance(state, SceneError):
        raise state
    try:
        if state == "new":
            execute(
                scene,
                directory,
                [ProgressReport()],
                comm=comm,
                pictures=False,
                request=request,
                results=module.results,
            )
        elif state == "stopped":
            resume(directory, [ProgressReport()], comm=comm, pictures=False)
    except ConvergenceError:
        if run.expected_failure is None:
            raise
    free(comm)
    return read_run(run.name, scene, directory)


def _state_or_error(run: Run, request: Request, directory: Path) -> State | SceneError:
    try:
        return _state(run, request, directory)
    except SceneError as error:
        return error


def _state(run: Run, request: Request, directory: Path) -> State:
    """Find what there is of a run."""
    if not directory.exists() or not any(directory.iterdir()):
        return "new"
    # a bundled scene is defined by the package: what is stored of it are its name and settings
    if not (directory / REQUEST).is_file() or read_request(directory) != request:
        raise SceneError(
            f"figures: {directory} is not of the run '{run.name}' as it is defined now; remove it, "
            "or give another directory by --from"
        )
    # killed before its first state was written it is stopped, too: it goes on from the beginning
    if not (directory / SUMMARY).is_file() or not _ended(run, _summary(directory)):
        return "stopped"
    return "finished"


def _summary(directory: Path) -> dict[str, Any]:
    try:
        return read_json(directory / SUMMARY)
    except Damaged as error:
        raise SceneError(
            f"figures: {error}; remove it, and it is made again from the state"
        ) from None


def _ended(run: Run, summary: Mapping[str, Any]) -> bool:
    if summary["failed"] is not None:
        return run.expected_failure is not None and summary["failed"] != INTERRUPTED
    return bool(summary["t"] >= summary["t_end"] * (1 - END))


def read_run(name: str, scene: Scene, directory: Path) -> FinishedRun:
    """A run from its files."""
    summary = _summary(directory)
    history = pd.DataFrame(read_history(directory / HISTORY))
    return FinishedRun(name, scene, history, summary, directory)
