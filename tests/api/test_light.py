"""`import shellmb` is light, and what it offers is what editors and mypy are told."""

import ast
import importlib.util
import inspect
import subprocess
import sys
import time
from pathlib import Path

import shellmb as sm

STUB = Path(sm.__file__).with_name("__init__.pyi")


def test_import_takes_no_time() -> None:
    """0.3 s are asked for; the start of Python itself does not count, the least of some does."""
    code = "import time; t = time.perf_counter(); import shellmb; print(time.perf_counter() - t)"
    times = []
    for _ in range(3):
        result = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)
        times.append(float(result.stdout))
        if times[-1] < 0.3:
            break
        time.sleep(1)
    assert min(times) < 0.3


def test_the_stub_lists_what_is_found() -> None:
    told = {
        alias.asname or alias.name
        for node in ast.parse(STUB.read_text()).body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert told - {"*"} | set(sm.scene.__all__) | {"__version__"} == set(dir(sm))
    for name in dir(sm):
        assert getattr(sm, name) is not None


def test_functions_stay_functions_whatever_modules_are_imported() -> None:
    """A package `shellmb.run` would take the place of the function once something imports it."""
    import shellmb.running.execute
    import shellmb.studies.sweep
    import shellmb.vibration  # noqa: F401

    for name in ("run", "modes", "study"):
        assert inspect.isfunction(getattr(sm, name))
        assert importlib.util.find_spec(f"shellmb.{name}") is None


def test_what_is_not_there_is_an_attribute_error() -> None:
    assert not hasattr(sm, "shel")
    assert not hasattr(sm, "_shell")
