"""Runs a scene as `shellmb run` does, and dies by SIGKILL at a given moment; again and again.

    python writer.py SCENE.py FOLDER MOMENT ...

For each moment a process of its own writes the run directory `FOLDER/MOMENT`, with a state after
every step. Moments are numbered from 1: each file of the run that is opened, renamed or removed,
each array of a state, each solved step. What kind they are is noted in `FOLDER/MOMENT.kinds`, one a
line; moment 0 never comes. The last line printed is the signals that ended the processes.
"""

import os
import signal
import sys
from functools import partial
from pathlib import Path
from typing import Any

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import numpy as np

import shellmb.running.standard as standard
from shellmb.observers.files.checkpoint import Checkpoint
from shellmb.options.run import Options
from shellmb.running.execute import execute
from shellmb.running.request import Request
from shellmb.simulate.simulation import BaseObserver, Simulation

EVENTS = {"open": "open", "os.rename": "rename", "os.remove": "remove"}


class Moments:
    """Counts moments and kills the process at one of them.

    Args:
        out: The run directory.
        last: The moment; 0: never.
    """

    def __init__(self, out: Path, last: int) -> None:
        self._out, self._last, self._count = str(out) + os.sep, last, 0
        self._kinds = os.open(f"{out}.kinds", os.O_WRONLY | os.O_CREAT)

    def __call__(self, kind: str) -> None:
        self._count += 1
        os.write(self._kinds, f"{kind}\n".encode())
        if self._count == self._last:
            os.kill(os.getpid(), signal.SIGKILL)

    def audit(self, event: str, arguments: tuple[Any, ...]) -> None:
        """What Python reports of files."""
        if event in EVENTS and str(arguments[0]).startswith(self._out):
            self(EVENTS[event])


class Steps(BaseObserver):
    """Every solved step is a moment, too: nothing of it is written yet."""

    def __init__(self, moments: Moments) -> None:
        self._moments = moments

    def solved(self, simulation: Simulation) -> None:
        self._moments("step")


def write(scene: str, out: Path, moment: int) -> None:
    """The whole run, if nothing kills it."""
    moments = Moments(out, moment)
    write_array = np.lib.format.write_array

    def counted(*args: Any, **kwargs: Any) -> None:
        moments("array")
        write_array(*args, **kwargs)

    np.lib.format.write_array = counted  # type: ignore[assignment]
    sys.addaudithook(moments.audit)
    # factors are not saved, so only Newton's full method continues bit for bit
    request = Request(scene, {"steps": "6"}, Options(newton="full"))
    built, module = request.build()
    observers = [Steps(moments)]
    execute(built, out, observers, pictures=False, request=request, results=module.results)


def main(scene: str, folder: str, *moments: str) -> None:
    standard.Checkpoint = partial(Checkpoint, interval=0.0)  # type: ignore[misc,assignment]
    signals = []
    for moment in map(int, moments):
        child = os.fork()
        if child == 0:
            write(scene, Path(folder, str(moment)), moment)
            sys.stdout.flush()
            os._exit(0)
        signals.append(os.WTERMSIG(os.waitpid(child, 0)[1]))
    print(*signals, flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
