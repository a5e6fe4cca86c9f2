"""A run killed at any moment leaves a directory that `shellmb resume` continues to the same end.

Equal means bit for bit, as the documentation promises for serial runs with Newton's full method.
"""

import csv
import json
import random
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from shellmb.running.resume import resume
from shellmb.running.saved import read_saved

HERE = Path(__file__).parent
SCENE = HERE.parent / "run" / "scene_small.py"
# what was going on when the process died
KINDS = ["step", "array", "array", "open", "rename", "remove"]


def _write(folder: Path, *moments: int) -> list[int]:
    """Run once for each moment; the signals that ended the runs."""
    command = [sys.executable, HERE / "writer.py", SCENE, folder, *moments]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return list(map(int, done.stdout.splitlines()[-1].split()))


def _rows(out: Path) -> list[dict[str, str]]:
    """The history without its wall times, whatever was cut off at the end."""
    with (out / "history.csv").open() as file:
        return [{k: v for k, v in row.items() if k != "wall_s"} for row in csv.DictReader(file)]


def _state(out: Path) -> dict[str, np.ndarray]:
    from mpi4py import MPI

    return read_saved(out, MPI.COMM_WORLD).arrays


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[tuple[str, int]]]:
    """A folder of runs: 0, which nobody kills, and one for each kind, killed when it came."""
    folder = tmp_path_factory.mktemp("runs")
    assert _write(folder, 0) == [0]
    kinds = (folder / "0.kinds").read_text().split()
    # the first state is there when it has its name; before that nothing has been computed
    begun = kinds.index("rename", kinds.index("array")) + 1
    choose = random.Random(2002)
    moments: list[int] = []
    for kind in KINDS:
        possible = [k + 1 for k, other in enumerate(kinds) if other == kind and k + 1 > begun]
        moments.append(choose.choice([k for k in possible if k not in moments]))
    killed = _write(folder, *moments, begun - 2)
    assert killed == [signal.SIGKILL] * (len(KINDS) + 1)
    return folder, [*zip(KINDS, moments, strict=True), ("too early", begun - 2)]


@pytest.mark.parametrize("number", range(len(KINDS)), ids=[f"{k}-{n}" for n, k in enumerate(KINDS)])
def test_killed_run_goes_on_to_the_same_end(number: int, runs, worst) -> None:
    folder, killed = runs
    whole, out = folder / "0", folder / str(killed[number][1])
    result = resume(out, pictures=False, scene_file=str(SCENE))
    assert result.simulation.step == 6
    assert _rows(out) == _rows(whole)
    expected, found = _state(whole), _state(out)
    assert expected.keys() == found.keys()
    difference = max(float(np.abs(found[k] - expected[k]).max()) for k in expected)
    # below the smallest number there is, but for zero
    worst("difference of the end from that of the run that was not killed", difference, 1e-300)
    files = [sorted(p.name for p in (d / "fields").iterdir()) for d in (whole, out)]
    assert files[0] == files[1]
    for name in files[0]:
        assert (whole / "fields" / name).read_bytes() == (out / "fields" / name).read_bytes()
    said = json.loads((out / "summary.json").read_text())
    assert said["failed"] is None and said["steps"] == 6


def test_killed_before_the_first_state_a_run_begins_again(runs) -> None:
    """Nothing has been computed yet."""
    folder, killed = runs
    out = folder / str(killed[-1][1])
    assert (out / "request.json").is_file()
    assert not (out / "state" / "state.json").exists()
    resume(out, pictures=False, scene_file=str(SCENE))
    expected, found = _state(folder / "0"), _state(out)
    assert all(np.array_equal(found[k], expected[k]) for k in expected)
