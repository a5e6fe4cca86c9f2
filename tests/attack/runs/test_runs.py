"""Runs: whose program is executed, the same scene, one writer, signals, and disks that are full."""

import errno
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from typer.testing import CliRunner

from shellmb.cli import app
from shellmb.errors import RunError, SceneError, Stopped
from shellmb.files.locks import FileLock
from shellmb.observers.files.gridfiles import GridFiles
from shellmb.observers.history import GrowingFile, read_history
from shellmb.running import execute as executing
from shellmb.running.execute import execute
from shellmb.running.loader import load
from shellmb.running.resume import resume
from shellmb.scene import Output, StepControl
from shellmb.simulate.simulation import BaseObserver, Simulation
from shellmb.stopping import STOPPING

SCENE = Path(__file__).with_name("scene_pendulum.py")


def shellmb(*arguments: object) -> tuple[int, str]:
    """Exit code of a command, and what it says; within this process."""
    done = CliRunner().invoke(app, [str(a) for a in arguments])
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    return done.exit_code, done.stderr


# --- whose program is executed ----------------------------------------------------------------
def test_a_stranger_s_directory_executes_nothing(run: Path, tmp_path: Path) -> None:
    evil, mark = tmp_path / "evil.py", tmp_path / "executed"
    evil.write_text(f"open({str(mark)!r}, 'w')\n" + SCENE.read_text())
    request = json.loads((run / "request.json").read_text())
    (run / "request.json").write_text(json.dumps({**request, "scene": str(evil)}))
    code, said = shellmb("resume", run, "--no-pictures")
    assert code == 2
    assert said == (
        f"error: resume: the run directory names {evil}, a program to be executed; give its path "
        "behind the directory, or --trust if the directory is yours\n"
    )
    assert not mark.exists()
    # the path on the command line counts, not that in the directory
    code, said = shellmb("resume", run, SCENE, "--no-pictures")
    assert code == 0, said
    assert not mark.exists()


def test_a_trusted_directory_names_its_scene(run: Path) -> None:
    code, said = shellmb("resume", run, "--trust", "--no-pictures")
    assert code == 0, said


def test_a_run_of_a_file_is_none_of_a_bundled_scene(run: Path) -> None:
    code, said = shellmb("resume", run, "heavy_top")
    assert code == 2
    assert "and not of 'heavy_top'" in said


# --- the same scene -----------------------------------------------------------------------------
REQUESTS = {
    "mass": ({"parameters": {"mass": "3"}}, "rigid_bodies['arm'].mass was 2.0, is 3.0"),
    "steps": ({"parameters": {"steps": "8"}}, "t_end was 0.004, is 0.008"),
    "load": ({"parameters": {"own": "false"}}, "loads[0].time was swell, is Sine"),
    "dt": ({"options": {"dt": 5e-4}}, "dt was 0.001, is 0.0005"),
    "scheme": ({"options": {"scheme": "ed"}}, "scheme was ep, is ed"),
}


@pytest.mark.parametrize("what", REQUESTS)
def test_an_edited_request_is_other_physics(what: str, run: Path) -> None:
    change, named = REQUESTS[what]
    request = json.loads((run / "request.json").read_text())
    (run / "request.json").write_text(json.dumps({**request, **change}))
    with pytest.raises(SceneError, match="is not of the scene 'pendulum' as it is now") as refused:
        resume(run, scene_file=str(SCENE), pictures=False)
    assert named in str(refused.value)
    assert "request.json was edited" in str(refused.value)


EDITS = {
    "a number of the module": ("PULL = 9.81", "PULL = 1.62", "PULL was 9.81, is 1.62"),
    "a load": ("(0, 0, -PULL)", "(0, PULL, 0)", "acceleration was [0.0, 0.0, -9.81], is"),
    "a function": ("1.0 + PULL * t", "1.0 - PULL * t", "loads[0].time's code was sha256"),
    "a number of a function": ("1.0 + PULL", "1.5 + PULL", "loads[0].time's code was sha256"),
    "a joint": ("axis=(0, 1, 0)", "axis=(0, 0, 1)", "joints['pin'].axis was [0.0, 1.0, 0.0], is"),
    "a body more": ("rigid_bodies=arm", 'rigid_bodies=[arm, RigidBody("b", 1, (1, 1, 1))]', "'b'"),
}


@pytest.mark.parametrize("what", EDITS)
def test_an_edited_file_is_other_physics(what: str, run: Path, tmp_path: Path) -> None:
    old, new, named = EDITS[what]
    text = SCENE.read_text()
    assert text.count(old) == 1
    (tmp_path / "edited.py").write_text(text.replace(old, new))
    with pytest.raises(SceneError, match="is not of the scene") as refused:
        resume(run, scene_file=str(tmp_path / "edited.py"), pictures=False)
    assert named in str(refused.value)


def test_an_edited_file_may_be_the_same_scene(run: Path, tmp_path: Path, caplog) -> None:
    """How a run is evaluated may change; its values are those of the new function."""
    text = SCENE.read_text().replace('"steps": float', '"count": 10 * float')
    text = text.replace("counts.", "counts, and a comment more.").replace(
        "frames=steps", "frames=1"
    )
    (tmp_path / "edited.py").write_text(text)
    made = resume(run, scene_file=str(tmp_path / "edited.py"), pictures=False)
    assert made.results == {"count": 40.0}
    assert "edited.py was edited, and still defines the same scene" in caplog.text


@pytest.mark.parametrize(
    ("field", "value", "says"),
    [
        ("output", Output(end_forces=True), "columns .*_end.* are new or gone; keep observers"),
        ("step_control", StepControl(step_error=1e-3), "is not of .*: step_control.step_error was"),
    ],
)
@pytest.mark.parametrize("before", [True, False])
def test_a_history_keeps_its_columns(
    tmp_path: Path, field: str, value: object, says: str, before: bool
) -> None:
    """Rows of other columns behind those of the run made its history unreadable."""
    plain = load(str(SCENE)).build({})
    other = replace(plain, **{field: value})
    first, then = (other, plain) if before else (plain, other)
    with pytest.raises(KeyboardInterrupt):
        execute(first, tmp_path / "run", [StopsAt(2)], pictures=False)
    with pytest.raises(SceneError, match=says):
        resume(tmp_path / "run", [StopsAt(0)], scene=then, pictures=False)
    # nothing is lost: it goes on as it was
    made = resume(tmp_path / "run", [StopsAt(0)], scene=first, pictures=False)
    assert len({tuple(row) for row in made.rows}) == 1 and made.simulation.t == 0.004


def test_a_history_that_goes_on_keeps_its_order(tmp_path: Path) -> None:
    """Observers in another order wrote numbers below one another's names, and took names twice."""
    scene, names = load(str(SCENE)).build({}), ["seven", "eight"]
    both = [Measures("seven", 7.0), Measures("eight", 8.0)]
    with pytest.raises(KeyboardInterrupt):
        execute(scene, tmp_path / "run", [*both, StopsAt(2)], pictures=False)
    with pytest.raises(SceneError, match="two columns are named 'seven'"):
        resume(tmp_path / "run", [*both, Measures("seven", 9.0)], scene=scene, pictures=False)
    resume(tmp_path / "run", [*reversed(both)], scene=scene, pictures=False)
    rows = read_history(tmp_path / "run" / "history.csv")
    assert [[row[name] for name in names] for row in rows] == [[7.0, 8.0]] * 5


class Measures(BaseObserver):
    """One number, always the same."""

    def __init__(self, name: str, value: float) -> None:
        self.name, self.value = name, value

    def measure(self) -> dict[str, float]:
        return {self.name: self.value}


class StopsAt(BaseObserver):
    """Ends a run behind a step, as Ctrl-C does."""

    def __init__(self, step: int) -> None:
        self.step = step

    def accepted(self, simulation: Simulation) -> None:
        if simulation.step == self.step:
            raise KeyboardInterrupt


def test_a_run_that_has_computed_nothing_does_not_begin_as_another(run: Path) -> None:
    for name in ("state/state.json", "history.csv", "summary.json"):
        (run / name).unlink()
    request = json.loads((run / "request.json").read_text())
    (run / "request.json").write_text(json.dumps({**request, "parameters": {"mass": "3"}}))
    with pytest.raises(SceneError, match="was edited, and there is no state"):
        resume(run, scene_file=str(SCENE), pictures=False)


# --- one writer ---------------------------------------------------------------------------------
class Meanwhile(BaseObserver):
    """Tries to write the same directory while the run goes on."""

    def __init__(self, out: Path) -> None:
        self.out, self.said = out, list[str]()

    def accepted(self, simulation) -> None:
        if simulation.step == 2:
            code, said = shellmb("run", SCENE, "--out", self.out)
            self.said.append(f"{code} {said}")
            code, said = shellmb("resume", self.out, SCENE)
            self.said.append(f"{code} {said}")


def test_a_live_run_is_left_alone(tmp_path: Path) -> None:
    watch = Meanwhile(tmp_path / "run")
    execute(load(str(SCENE)).build(), tmp_path / "run", [watch], pictures=False)
    (new, again) = watch.said
    assert new.startswith("2 ") and f"another run is writing (process {os.getpid()} on " in new
    assert again.startswith("2 ")
    assert not (tmp_path / "run" / "lock").exists()


def test_a_live_run_is_not_resumed(run: Path) -> None:
    lock = FileLock(run / "lock")
    assert lock.acquire()
    before = {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}
    with pytest.raises(SceneError, match="another run is writing"):
        resume(run, scene_file=str(SCENE), pictures=False)
    assert {path: path.read_bytes() for path in run.rglob("*") if path.is_file()} == before
    lock.release()
    assert resume(run, scene_file=str(SCENE), pictures=False).simulation.step == 4


@pytest.mark.parametrize("where", ["file/run", "file", "/proc/run"])
def test_what_cannot_be_written_is_refused_before_anything_is_built(
    where: str, tmp_path: Path, monkeypatch
) -> None:
    monkeypatch.setattr(executing, "Simulation", None)
    (tmp_path / "file").touch()
    code, said = shellmb("run", SCENE, "--out", tmp_path / where, "--quiet")
    assert code == 2
    assert said.startswith(f"error: out is {tmp_path / where}, which ")
    assert said.count("\n") == 1


def test_nothing_is_left_of_a_run_that_cannot_be_built(tmp_path: Path, monkeypatch) -> None:
    def impossible(*args):
        raise SceneError("impossible")

    monkeypatch.setattr(executing, "Simulation", impossible)
    assert shellmb("run", SCENE, "--out", tmp_path / "a" / "b")[0] == 2
    assert not (tmp_path / "a").exists()


# --- signals --------------------------------------------------------------------------------------
class Signal(BaseObserver):
    """Sends this process a signal in the middle of a step."""

    def __init__(self, number: int, times: int = 1) -> None:
        self.number, self.times = number, times

    def solved(self, simulation) -> None:
        if simulation.step == 1:
            for _ in range(self.times):
                os.kill(os.getpid(), self.number)


ENDING = [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]
ENDING += [(signal.SIGQUIT, 131), (signal.SIGPIPE, 141), (signal.SIGXCPU, 152)]


@pytest.fixture
def heeded() -> Iterator[None]:
    """Signals as a terminal has them: what starts tests in the background may ignore some."""
    before = {number: signal.getsignal(number) for number, _ in ENDING}
    ignored = [number for number, handler in before.items() if handler is signal.SIG_IGN]
    for number in ignored:
        signal.signal(number, signal.SIG_DFL)
    yield
    for number in ignored:
        signal.signal(number, signal.SIG_IGN)


@pytest.mark.usefixtures("heeded")
@pytest.mark.parametrize(("number", "code"), ENDING)
def test_a_signal_ends_a_run_behind_its_step(number, code, tmp_path, monkeypatch) -> None:
    how = {"observers": [Signal(number)]}
    monkeypatch.setattr("shellmb.cli.main._reports", lambda scene, quiet, levels: how)
    out = tmp_path / "run"
    found, said = shellmb("run", SCENE, "--out", out, "--quiet", "--no-pictures")
    assert found == code
    assert said.splitlines()[-1] == (
        f"error: stopped by {number.name}: t = 0.002, step 2; `shellmb resume {out} {SCENE}` "
        "continues from there"
    )
    assert "Traceback" not in said
    state = json.loads((out / "state" / "state.json").read_text())
    assert state["simulation"]["step"] == 2
    assert json.loads((out / "summary.json").read_text())["failed"] == "KeyboardInterrupt"
    assert resume(out, trust=True, pictures=False).simulation.step == 4


def test_a_second_signal_does_not_wait(tmp_path: Path) -> None:
    """It loses the step, and nothing more."""
    with STOPPING.caught(), pytest.raises(Stopped):
        scene = load(str(SCENE)).build()
        execute(scene, tmp_path / "run", [Signal(signal.SIGTERM, 2)], pictures=False)
    state = json.loads((tmp_path / "run" / "state" / "state.json").read_text())
    assert state["simulation"]["step"] == 1


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_a_run_is_built_ends_it_at_once(number, tmp_path, monkeypatch) -> None:
    def build(*args):
        os.kill(os.getpid(), number)
        time.sleep(10)

    monkeypatch.setattr(executing, "Simulation", build)
    code, said = shellmb("run", SCENE, "--out", tmp_path / "run", "--quiet")
    assert code == 128 + number
    assert said == f"error: stopped by {number.name}: nothing is left of it\n"
    assert not (tmp_path / "run").exists()


def test_a_signal_that_a_compiler_gets_too_is_a_signal(tmp_path, monkeypatch) -> None:
    def build(*args):
        try:
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(10)
        except KeyboardInterrupt:
            raise RuntimeError("gcc failed") from None

    monkeypatch.setattr(executing, "Simulation", build)
    code, said = shellmb("run", SCENE, "--out", tmp_path / "run", "--quiet")
    assert (code, said) == (130, "error: stopped by SIGINT: nothing is left of it\n")


@pytest.mark.mpi
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_two_ranks_behind_the_same_step(number, tmp_path: Path) -> None:
    mpiexec = Path(sys.executable).parent / "mpiexec"
    command = [mpiexec, "-n", "2", sys.executable, "-m", "shellmb.cli", "run", SCENE, "--quiet"]
    command += ["--no-pictures", "--set", "steps=1000000", "--out", "run"]
    process = subprocess.Popen(
        list(map(str, command)), cwd=tmp_path, stderr=subprocess.PIPE, text=True
    )
    history = tmp_path / "run" / "history.csv"
    try:
        begin = time.monotonic()
        while not (history.is_file() and history.read_bytes().count(b"\n") > 50):
            assert process.poll() is None and time.monotonic() - begin < 240
            time.sleep(0.2)
        process.send_signal(number)
        _, said = process.communicate(timeout=60)
    finally:
        process.kill()
    assert process.returncode == 128 + number
    assert said.count("error: stopped by") == 1
    state = json.loads((tmp_path / "run" / "state" / "state.json").read_text())
    rows = history.read_bytes().count(b"\n") - 1
    assert state["simulation"]["step"] == rows - 1 > 40, "no step is lost"


# --- full disks -----------------------------------------------------------------------------------
class Full(BaseObserver):
    """From the second step on nothing can be written."""

    def __init__(self, monkeypatch, *places: tuple[object, str]) -> None:
        self.patch, self.places = monkeypatch, places

    def accepted(self, simulation) -> None:
        if simulation.step == 2:
            for owner, name in self.places:
                full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                self.patch.setattr(owner, name, Mock(side_effect=full))


DISK = {
    "history": (GrowingFile, "add"),
    "fields": (GridFiles, "write"),
    "state": (np, "savez"),
    "summary": (executing, "write_json"),
}


@pytest.mark.parametrize("where", [*DISK, "everywhere"])
def test_a_full_disk_leaves_a_state_to_go_on_from(where: str, tmp_path: Path) -> None:
    places = list(DISK.values()) if where == "everywhere" else [DISK[where]]
    scene, out = load(str(SCENE)).build(), tmp_path / "run"
    with pytest.MonkeyPatch.context() as patch, pytest.raises(RunError) as failure:
        execute(scene, out, [Full(patch, *places)], pictures=False)
    assert "cannot be written (No space left on device)" in str(failure.value)
    assert not (out / "lock").exists()
    assert resume(out, scene=scene, pictures=False).simulation.step == 4
