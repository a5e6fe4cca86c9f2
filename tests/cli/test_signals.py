"""Signals from the first moment on: the process ends with one line, whatever is being loaded."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from shellmb.guarding import held
from shellmb.running.request import Request

# a signal comes while a module is looked for: of the commands, of DOLFINx, of PETSc
CODE = """
import os, sys
module, number = sys.argv[1], int(sys.argv[2])
def hook(event, arguments):
    if event == "import" and arguments[0] == module and sent:
        os.kill(os.getpid(), sent.pop())
sent = [number]
from shellmb.cli import app
sys.addaudithook(hook)
app(sys.argv[3:])
"""
RUN = ("run", "sudden_load", "--no-pictures", "--out", "one")


@pytest.mark.parametrize(
    ("module", "name", "arguments"),
    [
        ("typer", "SIGINT", RUN),
        ("shellmb.cli.failures", "SIGTERM", RUN),
        ("petsc4py.lib", "SIGINT", RUN),
        ("basix._basixcpp", "SIGTERM", RUN),
        ("dolfinx.cpp", "SIGINT", RUN),
        ("dolfinx.la", "SIGTERM", RUN),
        ("slepc4py", "SIGINT", (*RUN, "--accuracy", "1e-2")),
        ("dolfinx.la", "SIGTERM", ("resume", "begun")),
    ],
)
def test_a_signal_while_modules_are_loaded(
    module: str, name: str, arguments: tuple[str, ...], tmp_path: Path
) -> None:
    # what there is of a run that was killed before its first state
    (tmp_path / "begun").mkdir()
    request = json.dumps(Request("sudden_load").to_dict())
    (tmp_path / "begun" / "request.json").write_text(request)
    number = getattr(signal, name)
    command = [sys.executable, "-c", CODE, module, str(int(number)), *arguments]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=240)
    assert done.returncode == 128 + number
    assert done.stderr == f"error: stopped by {name}: nothing is left of it\n"
    assert not (tmp_path / "one").exists()


@pytest.mark.slow
@pytest.mark.parametrize("delay", [0.5 + 0.05 * k for k in range(40)])
def test_a_signal_at_any_time(delay: float, tmp_path: Path) -> None:
    # whatever the process does then; before 0.5 s it may be Python that starts
    number = (signal.SIGINT, signal.SIGTERM)[int(delay / 0.05) % 2]
    command = [sys.executable, "-m", "shellmb.cli", "run", "sudden_load", "--no-pictures"]
    started = subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True)
    time.sleep(delay)
    started.send_signal(number)
    said = started.communicate(timeout=240)[1]
    assert started.returncode == 128 + number
    assert said.splitlines()[-1].startswith(f"error: stopped by {number.name}: ")
    assert "Traceback" not in said


def test_signals_are_held_while_native_code_is_loaded() -> None:
    came = []
    before = signal.signal(signal.SIGTERM, lambda number, frame: came.append(number))
    try:
        with held():
            with held():
                os.kill(os.getpid(), signal.SIGTERM)
            assert not came
        assert came == [signal.SIGTERM]
    finally:
        signal.signal(signal.SIGTERM, before)
    # Ctrl-C of a program of the user's own, too
    with pytest.raises(KeyboardInterrupt), held():
        os.kill(os.getpid(), signal.SIGINT)
        came.append("behind it")
    assert came[-1] == "behind it"
