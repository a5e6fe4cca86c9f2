"""Names of DOLFINx, UFL, FFCx and Basix that we use are found, and this version has them."""

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

FILE = Path(__file__).parents[1] / ".ci" / "names.py"


@pytest.fixture(scope="module")
def names() -> ModuleType:
    spec = importlib.util.spec_from_file_location("names", FILE)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_they_are_found(names: ModuleType) -> None:
    """Imported, as an attribute of a module, under another name."""
    found = names.used()
    assert {"dolfinx.fem.Function", "ufl.dot", "basix.ufl.element"} <= {*found}
    assert not [name for name in found if name.split(".")[0] not in names.PACKAGES]


def test_this_version_has_them(
    names: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["names.py"])
    assert names.main() == 0, capsys.readouterr().out


def test_what_another_version_lacks_is_said(
    names: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    lacking = ["ufl.dot", "ufl.constantvalue.dot", "basix.gone"]
    monkeypatch.setattr(names, "used", lambda: lacking)
    monkeypatch.setattr("sys.argv", ["names.py"])
    assert names.main() == 1
    head, moved, removed = capsys.readouterr().out.splitlines()
    assert "1 of 3 names are there" in head
    assert moved.startswith("ufl.constantvalue.dot: moved to ufl") and removed.endswith("removed")
