"""The runs of an example: made, gone on with, or read where they are finished."""

from __future__ import annotations

import gc
import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from mpi4py import MPI

import pandas as pd

from shellmb.errors import ConvergenceError, SceneError
from shellmb.figures.example import FinishedRun, Run
from shellmb.observers.history import read_history
from shellmb.observers.progress import ProgressReport
from shellmb.run.execute import execute
from shellmb.run.request import REQUEST, Options, Request, read_request
from shellmb.run.resume import resume
from shellmb.run.standard import HISTORY, STATE, SUMMARY
from shellmb.scene import Scene

State = Literal["new", "stopped", "finished"]

# what a summary says of a run that the user stopped
INTERRUPTED = "KeyboardInterrupt"
# a time this near to the end, relative to it, is the end
END = 1e-9


def request_of(run: Run) -> Request:
    """How a run is asked for on the command line.

    Args:
        run: The run.
    """
    return Request(run.demo, {k: _text(v) for k, v in run.settings.items()}, Options(**run.options))


def _text(value: Any) -> str:
    return ",".join(map(str, value)) if isinstance(value, list | tuple) else str(value)


def finish(run: Run, directory: Path, comm: MPI.Comm = MPI.COMM_WORLD) -> FinishedRun:
    """Make a run, or go on with it, or read it if it is finished.

    Args:
        run: The run.
        directory: Its directory.
        comm: Communicator; the call is collective.

    Raises:
        SceneError: If the directory holds another run, or the run is impossible.
        ConvergenceError: If the run fails and is not expected to.
    """
    request = request_of(run)
    scene, module = request.build()
    state = comm.bcast(_state(run, request, directory) if comm.rank == 0 else None)
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
    gc.collect()
    comm.Barrier()
    return read_run(run.name, scene, directory)


def _state(run: Run, request: Request, directory: Path) -> State | SceneError:
    """What there is of a run; errors are given back, for all ranks."""
    if not directory.exists() or not any(directory.iterdir()):
        return "new"
    if not (directory / REQUEST).is_file() or read_request(directory) != request:
        return SceneError(
            f"figures: {directory} is not of the run '{run.name}' as it is defined now; remove it, "
            "or give another directory by --from"
        )
    if not (directory / SUMMARY).is_file():
        if (directory / STATE / "state.json").is_file():
            return "stopped"
        # killed before its first state was written: nothing is lost
        shutil.rmtree(directory)
        return "new"
    return "finished" if _ended(run, json.loads((directory / SUMMARY).read_text())) else "stopped"


def _ended(run: Run, summary: Mapping[str, Any]) -> bool:
    if summary["failed"] is not None:
        return run.expected_failure is not None and summary["failed"] != INTERRUPTED
    return bool(summary["t"] >= summary["t_end"] * (1 - END))


def read_run(name: str, scene: Scene, directory: Path) -> FinishedRun:
    """A run from its files.

    Args:
        name: Its name.
        scene: The scene that was run.
        directory: The run directory.
    """
    summary = json.loads((directory / SUMMARY).read_text())
    history = pd.DataFrame(read_history(directory / HISTORY))
    return FinishedRun(name, scene, history, summary, directory)
