"""Common to all tests: one thread per process, clean-up between tests, and `mpirun`."""

import gc
import importlib.util
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

# before numpy is imported by any test: threads of BLAS would fight with the other worker
os.environ.setdefault("OMP_NUM_THREADS", "1")

# `tests.bench`, `tests.scenes` and `demos.paper` are of the checkout; last, since a copy of the
# package may stand before it (`tests/mutations`)
sys.path.append(str(Path(__file__).parents[1]))

# byte code is kept, also where the environment says otherwise: workers and the processes that tests
# start would each compile all of their Python anew, which takes longer than to import it
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False


# a shell lets what it starts in the background ignore Ctrl-C, which tests send to themselves
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--margins", metavar="DIR", help="how near bounds are met; tests/margins.py")


def pytest_configure(config: pytest.Config) -> None:
    try:
        installed = importlib.util.find_spec("shellmb.forms") is not None
    except ModuleNotFoundError:
        installed = False
    if not installed:
        raise pytest.UsageError(
            "shellmb.forms cannot be imported: the package is not installed in this environment; "
            "use `uv run pytest`, or install it with `uv pip install -e .`"
        )
    if folder := config.getoption("--margins"):
        here = Path(__file__).with_name("margins.py")
        spec = importlib.util.spec_from_file_location("margins", here)
        assert spec is not None and spec.loader is not None
        margins = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(margins)
        kept = margins.Margins(Path(folder))
        kept.start()
        config.pluginmanager.register(kept)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark what mostly compiles as slow; see `tests/heavy.txt`."""
    file = Path(__file__).with_name("heavy.txt")
    if not file.exists():  # a copy of this file elsewhere, as in `tests/test_margins.py`
        return
    lines = (line.strip() for line in file.read_text().splitlines())
    heavy = {line for line in lines if line and not line.startswith("#")}
    for item in items:
        if item.nodeid in heavy:
            item.add_marker(pytest.mark.slow)
    if config.args == config.getini("testpaths"):
        unknown = heavy - {item.nodeid for item in items}
        if unknown:
            raise pytest.UsageError(f"{file}: there are no such tests: {sorted(unknown)}")


def pytest_collection_finish(session: pytest.Session) -> None:
    """What is there before the tests stays: to look through it took a twentieth of all time."""
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True)
def _collect_garbage() -> Iterator[None]:
    """Free PETSc objects on all ranks at the same place: their destructors are collective.

    On one rank Python chooses the time: to look through all objects after each test took a third
    of the time of short ones.
    """
    yield
    if "mpi4py.MPI" in sys.modules and (comm := sys.modules["mpi4py.MPI"].COMM_WORLD).size > 1:
        gc.collect()
        comm.Barrier()


@pytest.fixture
def mpirun(tmp_path: Path) -> Callable[..., str]:
    """Run Python under the `mpiexec` of this environment and return what it printed.

    `mpirun(2, "-m", "shellmb.cli", "list")` or `mpirun(2, "-c", source)`; the working directory
    is the test's `tmp_path` and the test fails, showing both outputs, on a nonzero exit code.
    Let one rank print: the output of several is mixed within lines.
    """

    def run(ranks: int, *args: str | Path, timeout: float = 300.0) -> str:
        mpiexec = Path(sys.executable).parent / "mpiexec"
        command = [str(mpiexec), "-n", str(ranks), sys.executable, *map(str, args)]
        process = subprocess.Popen(
            command,
            cwd=tmp_path,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        try:
            out, err = process.communicate(timeout=timeout)
        except subprocess.TimeoutExpired:
            # the whole group: killing mpiexec alone would leave its ranks behind
            os.killpg(process.pid, signal.SIGTERM)
            out, err = process.communicate()
            pytest.fail(f"no end after {timeout:g} s: {command}\n{out}\n{err}")
        if process.returncode != 0:
            pytest.fail(f"exit code {process.returncode}: {command}\n{out}\n{err}")
        return out

    return run
