"""Programs of benchmarks in processes of their own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from shellmb.errors import ShellmbError

ROOT = Path(__file__).parents[3]
# by these `mpiexec` tells a process that it is one of its own
OF_MPIEXEC = ("PMI", "HYDI_", "MPI_LOCAL", "OMPI_")


def last_line(what: str, module: str, *arguments: str, **environment: str) -> str:
    """Last line that a module prints as a program.

    Args:
        what: What it does, for the error.
        module: Its name.
        *arguments: Its arguments.
        **environment: Variables that it has beside those of this process.

    Raises:
        ShellmbError: If the process fails; says the last line of its errors.
    """
    alone = {k: v for k, v in os.environ.items() if not k.startswith(OF_MPIEXEC)}
    command = [sys.executable, "-m", module, *arguments]
    done = subprocess.run(
        command, capture_output=True, text=True, env=alone | environment, cwd=ROOT
    )
    if done.returncode != 0:
        last = (done.stderr.strip().splitlines() or ["it said nothing"])[-1]
        raise ShellmbError(f"bench: {what} failed: {last}")
    return done.stdout.splitlines()[-1]
