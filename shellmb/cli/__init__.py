"""The command line: `shellmb`."""

import gc
import importlib
import os
import signal
import sys
from typing import Any

# one thread unless the user says otherwise, before NumPy loads its BLAS: the matrices are small,
# and under mpiexec threads of several ranks would fight for the cores
os.environ.setdefault("OMP_NUM_THREADS", "1")
# plugins of pydantic are no part of it, and looking for them reads what is installed: 0.1 s
os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")

from shellmb.errors import Stopped
from shellmb.guarding import open_closed
from shellmb.stopping import EXIT, STOPPING

open_closed()
# what a command makes lives on, most of it, and is looked through in vain: a tenth of a start
gc.set_threshold(100_000, 20)

__all__ = ["app"]


class _Program:
    """The program: its commands are loaded when it is called, and signals are heeded before."""

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        """Run a command and end the process."""
        with STOPPING.caught():
            try:
                return self.commands(*arguments, **options)
            except (Stopped, SystemExit) as end:
                number = STOPPING.requested
                # a command that was stopped has said so; Typer ends with 130 outside of commands
                if number is None or getattr(end, "code", 130) != 130:
                    raise
                name = signal.Signals(number).name
                print(f"error: stopped by {name}: nothing is left of it", file=sys.stderr)
                raise SystemExit(EXIT + number) from None

    def __getattr__(self, name: str) -> Any:
        return getattr(self.commands, name)

    @property
    def commands(self) -> Any:
        """The commands, an application of Typer."""
        return importlib.import_module("shellmb.cli.main").app


app = _Program()
