"""Sweeps: the table, what is run again, what fails."""

import importlib.util
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

import shellmb as sm

FILE = Path(__file__).with_name("scene_cases.py")


@pytest.fixture(scope="module")
def cases():
    """The module under a name by which other processes find it, too."""
    sys.path.insert(0, str(FILE.parent))
    try:
        yield importlib.import_module("scene_cases")
    finally:
        sys.path.remove(str(FILE.parent))


class Counted(ThreadPoolExecutor):
    """One thread, which counts what it is given: PETSc runs one simulation at a time."""

    def __init__(self):
        super().__init__(1)
        self.count = 0

    def submit(self, *args, **kwargs):
        self.count += 1
        return super().submit(*args, **kwargs)


def test_a_sweep_goes_on_where_it_was(cases, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(FILE.parent))
    values = {"force": [1.0, 2.0], "thickness": [2e-3, 1e-3]}
    # in processes of their own, as by default
    table = sm.sweep(cases.strip, values, out=tmp_path / "out", measure=cases.tip)
    assert table["force"].tolist() == [1.0, 1.0, 2.0, 2.0] and not any(table["failed"])
    # F L^3/3EI of a beam, for nu = 0; shear adds (h/L)^2 of it, 4e-6
    exact = 4 * table["force"] / (cases.YOUNG * cases.WIDTH * table["thickness"] ** 3)
    assert (table["tip"] / exact - 1).abs().max() < 1e-3
    assert sm.load(table["directory"][3]).summary["steps"] == 1
    # one value more: only its cases are run
    with Counted() as executor:
        values["force"].append(-1.0)
        more = sm.sweep(cases.strip, values, executor, out=tmp_path / "out", measure=cases.tip)
        assert executor.count == 2
    assert more.iloc[:4].equals(table) and len(more) == 6
    # nothing at all
    with Counted() as executor:
        again = sm.sweep(cases.strip, values, executor, out=tmp_path / "out", measure=cases.tip)
        assert executor.count == 0
    assert again.equals(more)
    # a case that was stopped half-way is run again
    (Path(more["directory"][5]) / "case.json").unlink()
    with Counted() as executor:
        again = sm.sweep(cases.strip, values, executor, out=tmp_path / "out", measure=cases.tip)
        assert executor.count == 1
    assert again["tip"].equals(more["tip"])
    with pytest.raises(sm.SceneError, match=r"other code or choices \(options\)"):
        sm.sweep(
            cases.strip, values, out=tmp_path / "out", measure=cases.tip, options={"mesh": "8x2"}
        )


def test_a_case_that_fails_is_a_row(cases) -> None:
    with Counted() as executor:
        table = sm.sweep(cases.strip, [{"thickness": -1.0}, {}], executor, measure=cases.tip)
    assert "thickness is -1.0; it must be greater than 0" in table["failed"][0]
    assert table["failed"][1] == "" and table["tip"][1] > 0


def test_functions_that_raise_are_rows(cases) -> None:
    """The kind: what is the user's own fails in one case, and the others go on."""
    values = {"force": [0.0, 1.0]}
    with Counted() as executor:
        made = sm.sweep(cases.sometimes, values, executor, measure=cases.tip)
        measured = sm.sweep(cases.strip, values, executor, measure=cases.over_tip)
    assert "the scene function fails: scene_cases.py, line" in made["failed"][0]
    assert "measure fails: scene_cases.py, line" in measured["failed"][0]
    for table in (made, measured):
        assert "ZeroDivisionError" in table["failed"][0]
        assert table["failed"][1] == "" and table["tip"][1] > 0


def test_bad_sweeps(cases) -> None:
    for wrong in (3, [3], None):
        with pytest.raises(sm.SceneError, match="it must be values by parameter, as in"):
            sm.sweep(cases.strip, wrong)
    with pytest.raises(sm.SceneError, match="measure is 3; it must be a function of a run"):
        sm.sweep(cases.strip, {"force": [1.0]}, measure=3)
    with pytest.raises(sm.SceneError, match="parameters has no case"):
        sm.sweep(cases.strip, {})
    with pytest.raises(sm.SceneError, match="no parameter 'forces'; it has 'force', 'thickness'"):
        sm.sweep(cases.strip, {"forces": [1.0]})
    with pytest.raises(sm.SceneError, match="no parameter 'forces'; it has 'force', 'thickness'"):
        sm.sweep("sudden_load", {"forces": [1.0]})
    with pytest.raises(sm.SceneError, match=r"parameters has 1\.0 for 'force'; it must be a list"):
        sm.sweep(cases.strip, {"force": 1.0})
    with pytest.raises(sm.SceneError, match="scene cannot be sent to other processes"):
        sm.sweep(lambda force: cases.strip(force), {"force": [1.0]})
    with pytest.raises(sm.SceneError, match="measure cannot be sent to other processes"):
        sm.sweep(cases.strip, {"force": [1.0]}, measure=lambda run: {})


@pytest.mark.slow
def test_a_script_that_has_no_guard_is_told_of_it(tmp_path) -> None:
    """Each process reads the script, which would begin a sweep there."""
    script = tmp_path / "swept.py"
    script.write_text(
        "import shellmb as sm\ndef scene(a=1): raise ValueError\nsm.sweep(scene, {'a': [1]})\n"
    )
    run = subprocess.run([sys.executable, script], capture_output=True, text=True, check=False)
    assert run.returncode == 1
    assert "call sweep under `if __name__ == '__main__':`" in run.stderr
    # of the parent alone
    assert run.stderr.count("Traceback") == 1
