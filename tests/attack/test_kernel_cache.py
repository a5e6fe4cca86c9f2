"""Kernels that a killed process left half compiled, and processes that compile the same ones."""

import logging
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

from mpi4py import MPI

import basix.ufl
import numpy as np
import pytest
import ufl
from dolfinx import fem, jit, mesh

from shellmb.kernels import JIT_OPTIONS, compiled, compiled_expression, kernel_name, module_name
from shellmb.locks import FileLock


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache of the test's own."""
    monkeypatch.setitem(JIT_OPTIONS, "cache_dir", str(tmp_path))
    assert jit.get_options(JIT_OPTIONS)["cache_dir"] == tmp_path
    return tmp_path


@pytest.fixture(scope="module")
def line() -> mesh.Mesh:
    return mesh.create_unit_interval(MPI.COMM_SELF, 2)


def make_form(line: mesh.Mesh):
    space = fem.functionspace(line, basix.ufl.element("Lagrange", "interval", 1))
    return fem.Function(space) ** 2 * ufl.dx


def make_expression(line: mesh.Mesh):
    space = fem.functionspace(line, basix.ufl.element("Lagrange", "interval", 1))
    return fem.Function(space) ** 2, np.array([[0.25], [0.5]])


KINDS = {
    "form": (make_form, compiled),
    "expression": (make_expression, lambda pair: compiled_expression(*pair)),
}


@pytest.mark.parametrize("kind", KINDS)
def test_empty_file_of_a_killed_process_is_removed_at_once(kind, cache, line, caplog) -> None:
    make, compile_ = KINDS[kind]
    item = make(line)
    left = cache / ("expressions" if kind == "expression" else "") / f"{module_name(item)}.c"
    left.parent.mkdir(exist_ok=True)
    left.touch()
    begin = time.perf_counter()
    compile_(item)
    assert time.perf_counter() - begin < 60, "DOLFINx waits for 600 s"
    assert left.with_suffix(".c.cached").exists()
    assert "a killed process left unfinished" in caplog.text
    assert not list(cache.rglob("*.lock"))


@pytest.mark.parametrize("kind", KINDS)
def test_names_are_those_of_ffcx(kind, cache, line) -> None:
    """Locks by other names would guard nothing."""
    make, compile_ = KINDS[kind]
    item = make(line)
    compile_(item)
    assert [path.stem for path in cache.rglob("*.c")] == [module_name(item)]


def test_kernel_name_is_that_of_the_lock(line) -> None:
    form = make_form(line)
    assert kernel_name(compiled(form)) == module_name(form)


HOLD = """
import sys, time
from pathlib import Path
from shellmb.locks import FileLock
lock = FileLock(Path(sys.argv[1]))
assert lock.acquire()
print("held", flush=True)
time.sleep(600)
"""


@pytest.fixture
def compiling():
    """Starts a process that holds a lock as one that is compiling; it is killed at the end."""
    started = []

    def start(path: Path) -> int:
        command = [sys.executable, "-c", HOLD, str(path)]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        started.append(process)
        assert process.stdout is not None and process.stdout.readline() == "held\n"
        return process.pid

    yield start
    for process in started:
        process.kill()
        process.communicate()


def test_waiting_for_a_living_process_is_announced_and_ends_with_it(
    cache, line, caplog, compiling
) -> None:
    form = make_form(line)
    source = cache / f"{module_name(form)}.c"
    source.touch()
    other = compiling(source.with_suffix(".lock"))

    def kill_when_announced() -> None:
        while "waiting for" not in caplog.text:
            time.sleep(0.05)
        assert source.exists(), "the file of a living process is left alone"
        os.kill(other, signal.SIGKILL)

    with caplog.at_level(logging.WARNING):
        killer = threading.Thread(target=kill_when_announced)
        killer.start()
        compiled(form)
        killer.join()
    assert f"waiting for process {other} on " in caplog.text
    assert "a killed process left unfinished" in caplog.text


def test_interrupted_compiling_leaves_nothing(cache, line, monkeypatch) -> None:
    """Ctrl-C is no Exception, so FFCx leaves its empty file."""
    import ffcx.codegeneration.jit as ffcx_jit

    def interrupted(*args, **kwargs):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(ffcx_jit, "_compile_objects", interrupted)
        compiled(make_form(line))
    assert not [p for p in cache.iterdir() if p.suffix in (".c", ".lock")]


def test_lock_of_a_removed_file_is_nobodys(tmp_path) -> None:
    first, second = FileLock(tmp_path / "lock"), FileLock(tmp_path / "lock")
    assert first.acquire() and not second.acquire()
    assert second.owner == f"process {os.getpid()} on {os.uname().nodename}"
    (tmp_path / "lock").unlink()
    # two would hold locks of different files under one name
    assert second.acquire()
    first.release()
    assert (tmp_path / "lock").exists()
    second.release()
    assert not (tmp_path / "lock").exists()
