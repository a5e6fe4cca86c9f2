"""Common to all tests: one thread per process, clean-up between tests, and `mpirun`."""

import gc
import importlib.util
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

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


def listed(file: Path, items: list[pytest.Item]) -> tuple[list[pytest.Item], list[str]]:
    """Tests that a list names, and names in it that no test has.

    Args:
        file: A name a line: a folder, a file, a test or one variant of it, as pytest has them;
            `but N of NAME` leaves out as many of them, evenly from the first to the last.
        items: All tests.
    """
    lines = [line.strip() for line in file.read_text().splitlines()]
    left_out = {}
    for line in (line for line in lines if line and not line.startswith("#")):
        count, _, name = line.partition(" of ")
        if count.startswith("but "):
            left_out[name] = int(count.removeprefix("but "))
        else:
            left_out[line] = 0
    found: dict[str, list[pytest.Item]] = {name: [] for name in left_out}
    for item in items:
        path, _, test = item.nodeid.partition("::")
        folders = {str(folder) for folder in Path(path).parents}
        for name in folders | {path, f"{path}::{test.partition('[')[0]}", item.nodeid}:
            if name in found:
                found[name].append(item)
    named = []
    for name, some in found.items():
        count = min(left_out[name], len(some))
        stay = {n * (len(some) - 1) // max(count - 1, 1) for n in range(count)}
        named += [item for n, item in enumerate(some) if n not in stay]
    return named, [name for name, some in found.items() if not some]


def of_faults() -> set[str]:
    """Tests that a fault of `tests/mutations` names: they run every day, whatever lists say."""
    from tests.mutations.test_mutations import FAULTS

    return {test for fault in FAULTS for test in fault.tests}


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark what takes long as slow, and other variants and evidence for CI, by lists.

    Who names files runs what they leave to CI, too.
    """
    lists = {mark: Path(__file__).with_name(f"{mark}.txt") for mark in ("slow", "ci")}
    if not all(file.exists() for file in lists.values()):
        return  # a copy of this file elsewhere, as in `tests/test_margins.py`
    everything = config.args == config.getini("testpaths")
    if not everything and config.option.markexpr == "not slow and not ci":
        del lists["ci"]
    needed = of_faults()
    rest = [i for i in items if not {i.nodeid, i.nodeid.partition("[")[0]} & needed]
    for mark, file in lists.items():
        quick = [item for item in rest if item.get_closest_marker("slow") is None]
        named, unknown = listed(file, quick)
        for item in named:
            item.add_marker(mark)
        if unknown and everything:
            raise pytest.UsageError(f"{file}: there are no such tests: {sorted(unknown)}")


def pytest_collection_finish(session: pytest.Session) -> None:
    """What is there before the tests stays: to look through it took a twentieth of all time."""
    gc.collect()
    gc.freeze()
    # forms are trees of many small objects, few of which are garbage
    gc.set_threshold(5000, 10, 10)


@pytest.fixture(autouse=True, scope="module")
def _keep_what_stays() -> Iterator[None]:
    """What is there behind a file is kept by caches: later collections need not look through it.

    Behind two thousand tests each collection of everything took 3 s, and a quarter of all time.
    """
    yield
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


@pytest.fixture(scope="session")
def _ranks() -> Iterator[dict[int, Any]]:
    """Processes on several ranks that wait for programs, by their number."""
    kept: dict[int, Any] = {}
    yield kept
    for ranks in kept.values():
        ranks.end()


@pytest.fixture
def mpirun(tmp_path: Path, _ranks: dict[int, Any]) -> Callable[..., str]:
    """Run Python under the `mpiexec` of this environment and return what it printed.

    `mpirun(2, "-m", "shellmb.cli", "list")` or `mpirun(2, "-c", source)`; the working directory
    is the test's `tmp_path` and the test fails, showing both outputs, on a nonzero exit code.
    Sources and files run one after the other in the same processes (`tests/ranks.py`), which saves
    their imports; modules, and what changes something for the whole process (`alone`), have their
    own. Let one rank print: the output of several is mixed within lines.
    """

    def run_here(ranks: int, command: list[str], timeout: float) -> str:
        from tests.ranks import Ranks

        if ranks not in _ranks:
            _ranks[ranks] = Ranks(ranks)
        outcome = _ranks[ranks].run(command, tmp_path, timeout)
        if outcome.code is None:
            _ranks.pop(ranks).end(patience=0.0)  # some may wait for others for ever
        if outcome.code != 0:
            pytest.fail(f"exit code {outcome.code}: {command}\n{outcome.out}\n{outcome.err}")
        return str(outcome.out)

    def run(ranks: int, *args: str | Path, timeout: float = 300.0, alone: bool = False) -> str:
        if args[0] != "-m" and not alone:
            return run_here(ranks, list(map(str, args)), timeout)
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
