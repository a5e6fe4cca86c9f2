"""Programs on several ranks, one after the other in the same processes.

Imports take longer than most of the programs, so processes are started once in a session and are
told by a socket what to do next: who waits for a socket takes no time of a processor, in contrast
to who waits for MPI. After a failure the processes are ended, and the next program gets new ones.
"""

from __future__ import annotations

import contextlib
import gc
import json
import os
import runpy
import select
import signal
import socket
import subprocess
import sys
import tempfile
import time
import traceback
from pathlib import Path
from typing import Any, NamedTuple

# of a rank that said nothing more
DEAD = {"code": None, "out": "", "err": "a rank ended before its program did\n"}


class Outcome(NamedTuple):
    """What a program on several ranks left.

    Attributes:
        code: Its exit code; none if it raised or did not end on all ranks, which are lost then.
        out: What it printed, of all ranks.
        err: What it printed as errors, of all ranks.
    """

    code: int | None
    out: str
    err: str


class Ranks:
    """Processes under `mpiexec` that run one program after the other.

    Args:
        size: Number of ranks.
    """

    def __init__(self, size: int) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="ranks-")
        address = str(Path(self._folder.name) / "socket")
        with socket.socket(socket.AF_UNIX) as listener:
            listener.bind(address)
            listener.listen(size)
            listener.settimeout(120)
            mpiexec = str(Path(sys.executable).parent / "mpiexec")
            self._process = subprocess.Popen(
                [mpiexec, "-n", str(size), sys.executable, __file__, address],
                stdin=subprocess.DEVNULL,
                start_new_session=True,
            )
            self._connections = [listener.accept()[0] for _ in range(size)]
        self._files = [connection.makefile("rw") for connection in self._connections]

    def run(self, arguments: list[str], folder: Path, timeout: float) -> Outcome:
        """Run a program on all ranks.

        Args:
            arguments: As of Python: `-c` and a source, or a file, and its own arguments.
            folder: The working directory.
            timeout: How long it may take, s.
        """
        task = json.dumps({"arguments": arguments, "folder": str(folder)})
        for file in self._files:
            file.write(task + "\n")
            file.flush()
        end = time.monotonic() + timeout
        answers: dict[int, dict[str, Any]] = {}
        while len(answers) < len(self._files) and time.monotonic() < end:
            waiting = [c for n, c in enumerate(self._connections) if n not in answers]
            for connection in select.select(waiting, [], [], end - time.monotonic())[0]:
                number = self._connections.index(connection)
                line = self._files[number].readline()
                answers[number] = json.loads(line) if line else DEAD
                if answers[number]["code"] != 0:  # others may wait for it for ever
                    end = min(end, time.monotonic() + 10.0)
        told = [answers[number] for number in sorted(answers)]
        codes = [answer["code"] for answer in told]
        whole = len(told) == len(self._files) and None not in codes
        out, err = ("".join(answer[name] for answer in told) for name in ("out", "err"))
        return Outcome(max(codes) if whole else None, out, err)

    def end(self, patience: float = 60.0) -> None:
        """End all processes.

        Args:
            patience: How long they may take to do so themselves, s.
        """
        for file, connection in zip(self._files, self._connections, strict=True):
            with contextlib.suppress(OSError):
                file.close()
            connection.close()
        try:
            self._process.wait(patience)
        except subprocess.TimeoutExpired:
            # the whole group: killing mpiexec alone would leave its ranks behind
            os.killpg(self._process.pid, signal.SIGTERM)
            self._process.wait()
        self._folder.cleanup()


def perform(arguments: list[str]) -> int | None:
    """Run a program as Python would, and return its exit code; none where it raised."""
    path = list(sys.path)
    try:
        if arguments[0] == "-c":
            sys.argv = ["-c", *arguments[2:]]
            sys.path.insert(0, "")
            exec(compile(arguments[1], "<string>", "exec"), {"__name__": "__main__"})
        else:
            sys.argv = arguments
            sys.path.insert(0, str(Path(arguments[0]).parent))
            runpy.run_path(arguments[0], run_name="__main__")
    except SystemExit as exit_:
        return exit_.code if isinstance(exit_.code, int) else int(exit_.code is not None)
    except BaseException:
        traceback.print_exc()
        return None
    finally:
        sys.path[:] = path
    return 0


def serve(address: str) -> None:
    """Run what comes along a socket until it closes, with outputs in files of each rank."""
    from mpi4py import MPI

    with (
        socket.socket(socket.AF_UNIX) as connection,
        tempfile.TemporaryFile("w+") as out,
        tempfile.TemporaryFile("w+") as err,
    ):
        connection.connect(address)
        file = connection.makefile("rw")
        os.dup2(out.fileno(), 1)
        os.dup2(err.fileno(), 2)
        while line := file.readline():
            task = json.loads(line)
            os.chdir(task["folder"])
            code = perform(task["arguments"])
            sys.stdout.flush()
            sys.stderr.flush()
            answer: dict[str, Any] = {"code": code}
            for name, printed in (("out", out), ("err", err)):
                printed.seek(0)
                answer[name] = printed.read()
                printed.seek(0)
                printed.truncate()
            file.write(json.dumps(answer) + "\n")
            file.flush()
            if code is None:
                break
            # destructors of PETSc's objects are collective
            gc.collect()
            MPI.COMM_WORLD.Barrier()


if __name__ == "__main__":
    sys.path.pop(0)  # the folder of this file, whose names are no modules of programs
    serve(sys.argv[1])
