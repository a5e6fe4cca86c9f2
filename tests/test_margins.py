"""What is said of bounds on round-off: `tests/margins.py`, run on tests of its own."""

import importlib.util
import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent

# used parts of bounds by line, and whether it is a bound on round-off
TESTS = """
import numpy as np
import pytest

TIGHT = 1e-10
SIZE = 3.0

def error():
    return 2e-11

def SMALL():
    return 1e-7

def helper(x):
    return x <= 8 * TIGHT * SIZE

def test_bounds():
    assert error() < TIGHT  # 0.2
    assert abs(-1e-11) < 1e-10 and 5e-10 < 1e-9  # 0.5
    assert helper(1.2e-9)
    assert np.array([1e-12, 4e-12]).max() < 1e-11 * SIZE  # 0.133
    assert all(x < 1e-12 for x in (1e-13, 7e-13))  # 0.7
    assert -1e-10 < -3e-11 < 1e-10  # 0.3
    assert 1.0 + 6e-13 == pytest.approx(1.0, rel=1e-12, abs=0)  # 0.6
    assert [0.0, 1e-9 + 9e-19] == pytest.approx([0.0, 1e-9], rel=1e-9, abs=0)  # 0.9
    assert {"a": 2e-9} == pytest.approx({"a": 0.0}, abs=1e-8)  # 0.2
    assert np.array([1.0 + 4e-9]) == pytest.approx(np.array([1.0]), rel=1e-8)  # 0.4
    np.testing.assert_allclose([100 + 1e-11, 1e-13], [100, 0], rtol=0, atol=2e-11)  # 0.5
    assert np.allclose([1.0 + 8e-13], 1.0, 0, 1e-12)  # 0.8
    assert np.allclose(np.array([1j + 3e-11]), [1j], 0, 1e-10)  # 0.3
    # none of these is one
    assert float("nan") == pytest.approx(float("nan"), rel=1e-9, nan_ok=True)
    assert [float("nan")] == pytest.approx([float("nan")], rel=1e-9, nan_ok=True)
    assert SIZE <= 3.0 + 1e-12
    assert 1e-9 < (1e-3 if SIZE else 1e-8) and 5e-12 < {"a": 1e-12, "b": 1e-6}["b"]
    assert "a" < "b" and (1, 2) < (1, 3)
    assert 4e-9 < 0.1 * SMALL()
    assert 0.5 < 1.0 and 3 < 4
    assert 1.0 == 1.0 and "a" == "a" and (1, 2) < (1, 3)
    assert 1.01 == pytest.approx(1.0, rel=0.02)
    np.testing.assert_allclose([1e-9], [1.1e-9], rtol=0, atol=2e-10)
    assert not np.allclose([2.0], 1.0, 0, 1e-12)
    assert not 1e-9 < 1e-12

def test_that_fails():
    assert 2.0 < 1e-12
"""


def load():
    spec = importlib.util.spec_from_file_location("margins_alone", HERE / "margins.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def written(tmp_path_factory) -> Path:
    """What pytest leaves of these tests."""
    folder = tmp_path_factory.mktemp("margins") / "tests"
    folder.mkdir()
    for name in ("conftest.py", "margins.py"):
        shutil.copy(HERE / name, folder)
    (folder / "test_it.py").write_text(TESTS)
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--margins", "out"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert "1 failed, 1 passed" in done.stdout, done.stdout + done.stderr
    # a failure still says what was compared
    assert "('2.0', '1e-12'), 2.0, 1e-12)" in done.stdout
    return folder / "out"


def test_used_parts_of_bounds(written) -> None:
    (file,) = written.glob("*.json")
    found = json.loads(file.read_text())
    lines = dict(enumerate(TESTS.split("\n"), 1))
    expected = {n: float(x.split("# ")[1]) for n, x in lines.items() if "# 0." in x}
    expected[next(n for n, x in lines.items() if "return x <=" in x)] = 0.5
    used = {int(place.split(":")[1]): values[0] for place, values in found.items()}
    assert used.keys() == expected.keys()
    assert used == pytest.approx(expected, rel=1e-2)
    assert all(place.startswith("test_it.py:") for place in found)
    assert {values[2] for values in found.values()} == {"test_it.py::test_bounds"}


def test_runs_are_merged(tmp_path, capsys) -> None:
    margins = load()
    for name, used in (("a", 0.05), ("b", 0.3), ("c", 0.2)):
        (tmp_path / name).mkdir()
        content = {"x.py:3": [used, 1e-12, f"x.py::test_{name}"], "y.py:4": [0.01, 1e-9, "y"]}
        (tmp_path / name / f"{name}.json").write_text(json.dumps(content))
    assert margins.main([str(tmp_path / "a")]) == 0
    assert margins.main([str(tmp_path / name) for name in "abc"]) == 1
    said = capsys.readouterr().out
    assert "0.3 of 1e-12    x.py:3  test_b" in said and "y.py" not in said
    assert "2 bounds on round-off, 1 of them" in said
    # nothing found is no good news
    assert margins.main([str(tmp_path / "none")]) == 1
