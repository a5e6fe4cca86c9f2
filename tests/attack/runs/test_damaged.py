"""Run directories with a damaged file: one sentence that says which, or nothing is lost by it."""

import hashlib
import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import shellmb as sm
from shellmb.errors import SceneError
from shellmb.files.writing import add_checksum
from shellmb.observers.files.checkpoint import FORMAT
from shellmb.observers.history import read_history
from shellmb.running.loader import load as load_scene
from shellmb.running.resume import resume
from shellmb.running.saved import ANEW
from shellmb.simulate.simulation import Simulation

SCENE = str(Path(__file__).with_name("scene_pendulum.py"))


def go_on(out: Path) -> Any:
    return resume(out, pictures=False, scene_file=SCENE)


def flip(position: float) -> Callable[[Path], None]:
    """Turns one bit, so far into the file."""

    def spoil(file: Path) -> None:
        content = bytearray(file.read_bytes())
        content[int(position * (len(content) - 1))] ^= 4
        file.write_bytes(content)

    return spoil


SPOIL: dict[str, Callable[[Path], Any]] = {
    "emptied": lambda file: file.write_bytes(b""),
    "cut in half": lambda file: file.write_bytes(file.read_bytes()[: file.stat().st_size // 2]),
    "its last byte cut off": lambda file: file.write_bytes(file.read_bytes()[:-1]),
    "removed": lambda file: file.unlink(),
    **{f"a bit flipped at {p:g}": flip(p) for p in (0, 0.1, 0.3, 0.5, 0.7, 0.9, 1)},
    "another file": lambda file: file.write_bytes(b"\x00\xff\xfe" * 40),
}
# what a run needs; of the others it may lose what it likes
NEEDED = {"request.json", "history.csv", "state/state.json", "state/step-00000002-rank0.npz"}
OTHERS = {"summary.json", "fields/rigid_bodies_0001.vtu", "fields/joints_0000.vtu"}
OTHERS |= {"fields/rigid_bodies.vtu.series"}


def outcome(out: Path) -> tuple[str, list[dict[str, float]]]:
    """What is said, or the history of the whole run without its wall times."""
    try:
        go_on(out)
    except SceneError as error:
        return str(error), []
    rows = read_history(out / "history.csv")
    return "", [{k: v for k, v in row.items() if k != "wall_s"} for row in rows]


@pytest.fixture(scope="module")
def whole(made: Path, tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, float]]:
    """The history when nothing is damaged."""
    out = tmp_path_factory.mktemp("whole") / "run"
    shutil.copytree(made, out)
    said, rows = outcome(out)
    assert not said and len(rows) == 5
    return rows


def same(found: list[dict[str, float]], expected: list[dict[str, float]]) -> bool:
    # NaN is not equal to itself; factors are not kept, so the last digits may differ
    return len(found) == len(expected) and all(
        a[k] == pytest.approx(b[k], rel=1e-9, abs=1e-12, nan_ok=True)
        for a, b in zip(found, expected, strict=True)
        for k in b
    )


@pytest.mark.parametrize("how", SPOIL)
@pytest.mark.parametrize("name", sorted(NEEDED))
def test_a_damaged_file_that_is_needed_is_named(name: str, how: str, run: Path, whole) -> None:
    SPOIL[how](run / name)
    said, rows = outcome(run)
    if said:
        assert said.startswith("resume: ") and "\n" not in said
        # a damaged request may ask for another scene: then that is what is named
        assert Path(name).name in said or (name == "request.json" and "was edited" in said), said
    else:
        # a bit between two numbers, or that of a scene's checksum: it made no difference
        assert name == "request.json" or (name, how) == ("history.csv", "its last byte cut off")
        assert same(rows, whole)


@pytest.mark.parametrize("how", ["emptied", "removed", "a bit flipped at 0.5", "cut in half"])
@pytest.mark.parametrize("name", sorted(OTHERS))
def test_what_is_only_shown_stops_nothing(name: str, how: str, run: Path, whole, caplog) -> None:
    assert (run / name).is_file()
    SPOIL[how](run / name)
    said, rows = outcome(run)
    assert not said
    assert same(rows, whole)
    if name.endswith(".vtu"):
        assert f"lost or damaged in {run / 'fields'}" in caplog.text
        assert Path(name).name in caplog.text
        listed = (run / "fields" / f"{Path(name).stem[:-5]}.vtu.series").read_text()
        assert len(json.loads(listed)["files"]) == 4, "the lost one is left out"


def edit(file: Path, change: Callable[[dict[str, Any]], Any], seal: bool = False) -> None:
    values = json.loads(file.read_text())
    change(values)
    file.write_text(json.dumps(add_checksum(values) if seal else values))


# values that a program could have written, with their checksum: the schema has to find them
IMPOSSIBLE: dict[str, tuple[Callable[[dict[str, Any]], Any], str]] = {
    "a time before the start": (lambda s: s["simulation"].update(t=-5.0), "simulation.t"),
    "a time that is no number": (lambda s: s["simulation"].update(t="0"), "simulation.t"),
    "no time": (lambda s: s["simulation"].pop("t"), "simulation.t"),
    "an infinite time": (lambda s: s["simulation"].update(t=float("inf")), "simulation.t"),
    "a next step that is no number": (
        lambda s: s["simulation"]["size"].update(dt=float("nan")),
        "simulation.size.dt",
    ),
    "a step before the start": (lambda s: s["simulation"].update(step=-1), "simulation.step"),
    "another step": (lambda s: s["simulation"].update(step=1), "does not end where the state is"),
    "arrays elsewhere": (lambda s: s.update(arrays="../../step-00000002"), "arrays"),
    "no ranks": (lambda s: s.update(ranks=0), "ranks"),
    "more rows": (lambda s: s["observers"]["history"].update(rows=7), "history.csv"),
    "no observers": (lambda s: s.update(observers={}), "observers.history"),
    "frames before the start": (
        lambda s: s["observers"]["frames"].update(times=[-1.0]),
        "frames.times",
    ),
}


@pytest.mark.parametrize("case", IMPOSSIBLE)
def test_states_that_are_impossible(case: str, run: Path) -> None:
    change, named = IMPOSSIBLE[case]
    edit(run / "state" / "state.json", change, seal=True)
    said, _ = outcome(run)
    assert named in said and ANEW in said


@pytest.mark.parametrize("value", [np.nan, -np.inf])
def test_numbers_that_are_none_are_refused_whatever_their_checksum(value: float, run: Path) -> None:
    """Of every array that the run has stored, by whoever goes on from it; nothing is run."""
    state, file = run / "state" / "state.json", run / "state" / "step-00000002-rank0.npz"
    with np.load(file) as archive:
        arrays = dict(archive)
    real = {name: a for name, a in arrays.items() if a.dtype.kind == "f" and a.size}
    # positions, velocities, and what is remembered of earlier steps
    assert len(real) > 3
    before = (run / "history.csv").read_bytes()
    start = sm.FromRun(run)
    begun = replace(load_scene(SCENE).module.scene(), start=start)
    for name, array in real.items():
        forged = array.copy()
        forged.flat[-1] = value
        np.savez(file, allow_pickle=False, **(arrays | {name: forged}))
        digest = hashlib.sha256(file.read_bytes()).hexdigest()
        edit(state, lambda s, d=digest: s.update(arrays_sha256=[d]), seal=True)
        wrong = f"{file} is damaged (its array '{name}' has a value that is not finite)"
        said, _ = outcome(run)
        assert said.startswith(f"resume: {wrong}") and said.endswith(ANEW)
        with pytest.raises(SceneError) as refused:
            Simulation(begun)
        assert str(refused.value) == f"start from a run: {wrong}; run it again"
    assert (run / "history.csv").read_bytes() == before
    # as they were, the sums being those of another archive of the same numbers
    np.savez(file, allow_pickle=False, **arrays)
    digest = hashlib.sha256(file.read_bytes()).hexdigest()
    edit(state, lambda s: s.update(arrays_sha256=[digest]), seal=True)
    assert not outcome(run)[0]


def test_an_edited_state_is_refused(run: Path) -> None:
    edit(run / "state" / "state.json", lambda s: s["simulation"].update(t=1e-3))
    with pytest.raises(SceneError, match=r"state.json is damaged or was edited"):
        go_on(run)


def test_a_state_of_another_version_says_so(run: Path) -> None:
    edit(run / "state" / "state.json", lambda s: s.update(format=2))
    reads = rf"has format 2; this version of shellmb reads format {FORMAT}"
    with pytest.raises(SceneError, match=reads):
        go_on(run)


@pytest.mark.parametrize("row", [2, 3])
def test_rows_out_of_order_are_named(row: int, run: Path) -> None:
    file = run / "history.csv"
    lines = file.read_text().splitlines()
    lines[row] = lines[row - 1]
    file.write_text("\n".join(lines) + "\n")
    with pytest.raises(SceneError, match=rf"row {row - 1} does not follow the one before it"):
        go_on(run)


def test_a_missing_state_is_not_taken_for_a_run_that_has_not_begun(run: Path) -> None:
    (run / "state" / "state.json").unlink()
    with pytest.raises(SceneError, match=r"is missing, though the run has made steps"):
        go_on(run)


def test_a_history_that_is_read_elsewhere_is_checked(run: Path) -> None:
    file = run / "history.csv"
    # behind the last comma but one
    file.write_text(file.read_text().rsplit(",", 2)[0])
    with pytest.raises(SceneError, match=r"is no history of a run: row 2 is not whole"):
        read_history(file)


REQUEST = """
import sys
sys.path.insert(0, {root!r})
from pathlib import Path
from mpi4py import MPI
import shellmb as sm
from tests.accuracy.test_request import strip

out = Path({out!r})
asked = dict(accuracy=0.5, of="tip:end", pictures=False)
sm.run(strip(), out, **asked)
MPI.COMM_WORLD.Barrier()
if MPI.COMM_WORLD.rank == 0:
    next(out.glob({file!r})).write_text("{{")
MPI.COMM_WORLD.Barrier()
try:
    sm.run(strip(), out, **asked)
except sm.SceneError as error:
    print(error)
"""


@pytest.mark.mpi
@pytest.mark.parametrize("file", ["accuracy.json", "levels/*companions.json"])
def test_all_ranks_end_where_the_first_one_reads(file: str, tmp_path: Path, mpirun) -> None:
    """What a request for an accuracy has kept is read by one rank, for which others wait."""
    out = tmp_path / "run"
    source = REQUEST.format(root=str(Path(__file__).parents[3]), out=str(out), file=file)
    said = mpirun(2, "-c", source)
    (damaged,) = out.glob(file)
    assert f"{damaged} is damaged" in said
