"""`import shellmb` is light, and what it offers is what editors and mypy are told."""

import ast
import importlib.util
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import shellmb as sm
from shellmb.api.runs import run
from shellmb.api.studies import study

STUB = Path(sm.__file__).with_name("__init__.pyi")


def test_import_loads_nothing_heavy() -> None:
    """Kind: a module at the top of the package that needs a library, which costs every start."""
    code = "import sys; before = {*sys.modules}; import shellmb; print(*{*sys.modules} - before)"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, text=True)
    loaded = set(found.stdout.split())
    ours = {name for name in loaded if name.partition(".")[0] == "shellmb"}
    assert ours == {"shellmb"}
    # each of Python's own costs, too, so few are enough
    others = {name.partition(".")[0] for name in loaded - ours}
    assert others <= sys.stdlib_module_names and len(loaded) < 90


def test_the_stub_lists_what_is_found() -> None:
    body = ast.parse(STUB.read_text()).body
    told = {
        alias.name
        for node in body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
        # others are for annotations
        if alias.name in ("*", alias.asname)
    }
    told |= {node.name for node in body if isinstance(node, ast.FunctionDef)}
    assert told - {"*"} | set(sm.scene.__all__) | {"__version__"} == set(dir(sm))
    for name in dir(sm):
        assert getattr(sm, name) is not None


@pytest.mark.parametrize("function", [run, study], ids=lambda f: f.__name__)
def test_the_stub_has_the_options_as_they_are_described(function) -> None:
    """Options are fields of dataclasses, which a type checker would not see in `**options`."""
    parts: list[str] = []
    for p in inspect.signature(function).parameters.values():
        if p.kind is p.KEYWORD_ONLY and "*" not in parts:
            parts.append("*")
        default = "" if p.default is p.empty else f" = {p.default!r}"
        parts.append(f"{p.name}: {p.annotation}{default}")
    returned = inspect.signature(function).return_annotation
    wanted = f"def {function.__name__}({', '.join(parts)}) -> {returned}: ..."
    (found,) = (
        node
        for node in ast.parse(STUB.read_text()).body
        if isinstance(node, ast.FunctionDef) and node.name == function.__name__
    )
    assert ast.unparse(found) == ast.unparse(ast.parse(wanted)), f"write into {STUB}:\n{wanted}"


def test_functions_stay_functions_whatever_modules_are_imported() -> None:
    """A package `shellmb.run` would take the place of the function once something imports it."""
    import shellmb.accuracy.studies.sweep
    import shellmb.running.execute
    import shellmb.running.natural_modes.vibration  # noqa: F401

    for name in ("run", "modes", "study"):
        assert inspect.isfunction(getattr(sm, name))
        spec = importlib.util.find_spec(f"shellmb.{name}")
        # git leaves an empty folder of a package that it has moved; there is no code in it
        assert spec is None or spec.loader is None


def test_what_is_not_there_is_an_attribute_error() -> None:
    assert not hasattr(sm, "shel")
    assert not hasattr(sm, "_shell")
