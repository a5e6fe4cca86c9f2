"""What a killed process left half compiled, and processes that compile the same."""

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

from shellmb.locks import FileLock
from shellmb.native.compiling import compiler
from shellmb.native.expressions import compiled_expression
from shellmb.native.kernels import JIT_OPTIONS, compiled, kernel_name, module_name

pytestmark = pytest.mark.usefixtures("compiled_forms")


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


def compile_expression(pair):
    return compiled_expression(*pair)


KINDS = {"form": (make_form, compiled), "expression": (make_expression, compile_expression)}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("half", ["", "#include <ufcx"])
def test_half_written_code_of_a_killed_process_is_written_anew(kind, half, cache, line) -> None:
    make, compile_ = KINDS[kind]
    item = make(line)
    (cache / f"{module_name(item)}.c").write_text(half)
    made = compile_(item)
    if kind == "form":
        assert fem.assemble_scalar(made) == 0.0
    else:
        assert not made.eval(line, np.arange(2, dtype=np.int32)).any()
    assert (cache / f"{module_name(item)}.so").exists()
    assert not list(cache.rglob("*.lock"))


def test_an_expression_has_the_values_that_dolfinx_finds(line) -> None:
    space = fem.functionspace(line, basix.ufl.element("Lagrange", "interval", 2))
    u, c = fem.Function(space), fem.Constant(line, 3.0)
    u.interpolate(lambda x: np.exp(x[0]))
    # a coefficient that drops out, and one by another function before it
    other, points = fem.Function(space), np.array([[0.25], [0.5]])
    other.interpolate(lambda x: x[0] ** 2)
    value = ufl.as_vector([u.dx(0) * c, other, ufl.variable(u) ** 2])
    cells = np.arange(2, dtype=np.int32)
    exact = fem.Expression(value, points, jit_options=JIT_OPTIONS).eval(line, cells)
    found = compiled_expression(value, points).eval(line, cells)
    # -O2 and -O1 may fuse other products
    np.testing.assert_allclose(found, exact, rtol=1e-14)


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


@pytest.mark.parametrize("kind", KINDS)
def test_waiting_for_a_living_process_is_announced_and_ends_with_it(
    kind, cache, line, caplog, compiling
) -> None:
    make, compile_ = KINDS[kind]
    item = make(line)
    source = cache / f"{module_name(item)}.c"
    source.touch()
    other = compiling(source.with_suffix(".lock"))

    def kill_when_announced() -> None:
        while "waiting for" not in caplog.text:
            time.sleep(0.05)
        assert source.read_text() == "", "the file of a living process is left alone"
        os.kill(other, signal.SIGKILL)

    with caplog.at_level(logging.WARNING):
        killer = threading.Thread(target=kill_when_announced)
        killer.start()
        compile_(item)
        killer.join()
    assert f"waiting for process {other} on " in caplog.text
    assert source.read_text() != ""
    assert not list(cache.rglob("*.lock"))


def test_a_file_system_without_locks_is_told_and_enough(cache, line, caplog, monkeypatch) -> None:
    def refused(*_):
        raise OSError("no locks available")

    monkeypatch.setattr("fcntl.flock", refused)
    assert fem.assemble_scalar(compiled(make_form(line))) == 0.0
    assert "cannot be locked (no locks available)" in caplog.text


@pytest.mark.parametrize("kind", KINDS)
def test_interrupted_compiling_leaves_nothing(kind, cache, line, monkeypatch) -> None:
    """Ctrl-C is no Exception."""
    make, compile_ = KINDS[kind]

    def interrupted(*args, **kwargs):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(compiler, "code", interrupted)
        compile_(make(line))
    assert not [p for p in cache.rglob("*") if p.suffix in (".c", ".lock", ".so")]


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
