"""The command line as a user starts it."""

import contextlib
import json
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from shellmb.cli import app

SMALL = str(Path(__file__).parents[1] / "run" / "scene_small.py")

BODY = """
from shellmb.scene import *
NAN = float("nan")
def scene():
    steel = Isotropic(E=2e11, nu=0.3, thickness={thickness}, density=7800)
    plate = Shell("plate", Rectangle(2, 1), {section}, mesh={mesh})
    return Scene("bad", plate, supports={supports}, loads=EdgeForce("right", (0, 0, {force})),
                 probes=Probe("tip", {point}), scheme="{scheme}", dt={dt}, t_end=1)
"""
GOOD = {
    "thickness": "0.01",
    "section": "steel",
    "mesh": "(2, 1)",
    "supports": 'Clamped("left")',
    "force": "1",
    "point": '"right-top"',
    "scheme": "static",
    "dt": "None",
}


def shellmb(*arguments, cwd):
    command = [sys.executable, "-m", "shellmb.cli", *map(str, arguments)]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=240)


def within(*arguments, cwd):
    """The same without a process of its own, which takes seconds to start."""
    with contextlib.chdir(cwd):
        result = CliRunner().invoke(app, [*map(str, arguments)])
    # anything else would be a traceback
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


PENDULUM = """
from mpi4py import MPI
from shellmb.scene import *
KEPT = []
def scene():
    arm = RigidBody("arm", 2.0, (0.01, 0.2, 0.2), com=(0.5, 0, 0))
    section = RectangularSection(7e10, 0.3, width=0.02, height=0.01, density=2700)
    bar = Beam("bar", Line((1, 0, 0), (2, 0, 0)), section)
    pins = [Revolute("pin", "ground", "arm", at=(0, 0, 0), axis=(0, 1, 0)),
            Revolute("hinge", "arm", "bar", at=(1, 0, 0), axis=(0, 1, 0))]
    return Scene("pendulum", rigid_bodies=arm, beams=bar, joints=pins, scheme="ep", dt=1e-3,
                 loads=Gravity((0, 0, -9.81)), t_end=4e-3, output=Output(frames=3))
def results(run):
    if MPI.COMM_WORLD.rank == 0:
        KEPT.append(run)
    return {"steps": float(len(run.history) - 1)}
def check(results):
    assert results["steps"] == WANTED, "it takes four steps"
"""


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"thickness": "-0.01"}, "thickness is -0.01; it must be greater than 0"),
        ({"section": "Laminate(plies=())"}, "plies"),
        ({"mesh": "(0, 1)"}, "mesh"),
        ({"supports": "()"}, "nothing supports it"),
        ({"supports": 'Clamped("lft")'}, "has no edge 'lft'; its edges are"),
        ({"force": "NAN"}, "force"),
        ({"scheme": "ep", "dt": "0"}, "dt is 0; it must be greater than 0"),
        ({"scheme": "eq"}, "scheme is 'eq'"),
        ({"point": "(1.5, 0.3, 7)"}, "(1.5, 0.3, 7) is not on shell 'plate'"),
    ],
)
def test_bad_scenes_say_so_at_once(tmp_path, change, message):
    (tmp_path / "bad.py").write_text(BODY.format(**(GOOD | change)))
    result = within("run", "bad.py", cwd=tmp_path)
    assert result.exit_code == 2
    assert result.stdout == ""
    errors = [line for line in result.stderr.splitlines() if line.startswith("error: ")]
    assert len(errors) == 1
    assert message in errors[0]
    assert not (tmp_path / "runs").exists()


def test_a_bad_scene_ends_the_process_before_anything_is_compiled(tmp_path, monkeypatch):
    (tmp_path / "bad.py").write_text(BODY.format(**(GOOD | {"point": "(1.5, 0.3, 7)"})))
    # nothing is there yet: a run would compile all of its kernels, which takes a minute
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    result = shellmb("run", "bad.py", cwd=tmp_path)
    assert result.returncode == 2
    assert not [*tmp_path.rglob("*.so"), *tmp_path.rglob("*.c")]
    assert result.stdout == ""
    assert "error: probe 'tip': (1.5, 0.3, 7) is not on shell 'plate'; it is 7" in result.stderr
    assert "Traceback" not in result.stderr


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nosuch"], "there is no scene 'nosuch'"),
        ([SMALL, "--mesh", "6"], "mesh is '6'; it must be two counts as in 8x4"),
        ([SMALL, "--dt", "-1"], "dt is -1.0; it must be greater than 0"),
        ([SMALL, "--scheme", "ed", "--alpha", "2"], "alpha is 2.0; it must be at most 1"),
        (
            [SMALL, "--scheme", "ep", "--step-error", "2"],
            "step_error is 2.0; it must be less than 1",
        ),
        ([SMALL, "--scheme", "static", "--step-error", "1e-3"], "scheme 'static' has no motion"),
        ([SMALL, "--tolerance", "1e-3"], "--tolerance is now called --step-error"),
        ([SMALL, "--accuracy", "1e-2", "--of", "tip:l3"], "of is 'tip:l3'; it must be one of"),
        (["sudden_laod"], "there is no scene 'sudden_laod'; did you mean 'sudden_load'?"),
        ([SMALL, "--set", "colour=red"], "there is no parameter 'colour'"),
    ],
)
def test_bad_options_say_so(tmp_path, arguments, message):
    result = within("run", *arguments, cwd=tmp_path)
    assert result.exit_code == 2
    assert message in result.stderr
    # nothing is left of what was never begun
    assert [*tmp_path.iterdir()] == []


def test_a_directory_that_is_not_there(tmp_path):
    for command in ("report", "plot", "view"):
        result = within(command, "nothing", cwd=tmp_path)
        assert result.exit_code == 2
        assert "error: there is no directory nothing; give the directory of a" in result.stderr


def test_list_version_and_help(tmp_path):
    listed = within("list", cwd=tmp_path)
    assert listed.exit_code == 0
    lines = listed.stdout.splitlines()
    assert lines[0] == "start here:"
    assert any(line.startswith("  sudden_load ") for line in lines)
    assert within("--version", cwd=tmp_path).stdout.startswith("shellmb 0.")
    helped = within("run", "--help", cwd=tmp_path).stdout
    for option in ("--scheme", "--alpha", "--t-end", "--mesh", "--set", "--no-pictures"):
        assert option in helped
    # what is on or off has no type
    assert "<bool>" not in helped + within("--help", cwd=tmp_path).stdout


def test_run_prints_a_log_and_a_table(tmp_path):
    result = shellmb("run", SMALL, "--no-pictures", "--check", "--out", "one", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert "deprecated" not in result.stderr
    assert "step 5, t = 0.005" in result.stderr
    assert "iterations per step" in result.stdout
    assert "written to one" in result.stdout
    again = within("resume", "one", SMALL, "--no-pictures", cwd=tmp_path)
    assert again.exit_code == 0, again.stderr
    assert "written to one" in again.stdout


def test_quiet_is_silent_and_a_failed_check_counts(tmp_path):
    arguments = (SMALL, "--no-pictures", "--quiet", "--set", "force=-2")
    result = within("run", *arguments, cwd=tmp_path)
    assert (result.exit_code, result.stdout, result.stderr) == (0, "", "")
    (directory,) = (tmp_path / "runs").iterdir()
    assert directory.name.startswith("scene_small-ep-")
    failed = within("run", *arguments, "--check", "--out", "two", cwd=tmp_path)
    assert failed.exit_code == 1
    assert failed.stderr == "check failed: the tip goes down\n"


@pytest.mark.mpi
def test_two_ranks_give_the_same_and_one_prints(tmp_path, mpirun):
    options = ("--no-pictures", "--set", "held=false")
    within("run", SMALL, *options, "--out", "one", cwd=tmp_path)
    printed = mpirun(2, "-m", "shellmb.cli", "run", SMALL, *options, "--out", "two")
    assert printed.count("written to two") == 1
    one, two = (json.loads((tmp_path / d / "summary.json").read_text()) for d in ("one", "two"))
    assert (one["ranks"], two["ranks"]) == (1, 2)
    assert two["results"]["tip"] == pytest.approx(one["results"]["tip"], rel=1e-10)
    assert two["angular_momentum_drift"] < 1e-12
    assert one["warnings"] == two["warnings"] == []
    again = within("resume", "two", "--trust", cwd=tmp_path)
    assert again.exit_code == 0, again.stderr


def test_no_check_passes_without_its_assertions(tmp_path):
    """Kind: PYTHONOPTIMIZE leaves out what would fail."""
    (tmp_path / "pendulum.py").write_text(PENDULUM.replace("WANTED", "5"))
    run = [sys.executable, "-O", "-m", "shellmb.cli", "run", "pendulum.py", "--check"]
    failed = subprocess.run(run, cwd=tmp_path, capture_output=True, text=True)
    assert failed.returncode == 2
    assert "--check needs the assertions of its check(results)" in failed.stderr
    assert not (tmp_path / "runs").exists()


def test_no_directory_has_such_a_name(tmp_path):
    failed = within("run", SMALL, "--out", "x" * 300, cwd=tmp_path)
    assert failed.exit_code == 2
    assert "cannot be written (File name too long)" in failed.stderr.splitlines()[-1]


@pytest.mark.mpi
def test_two_ranks_end_whatever_keeps_the_run_alive_on_one(tmp_path, mpirun):
    """Solvers are freed collectively: the other rank, which frees its own, would wait for ever."""
    (tmp_path / "pendulum.py").write_text(PENDULUM.replace("WANTED", "4"))
    # about ten seconds, with new kernels and other work on the machine half a minute
    run = ("-m", "shellmb.cli", "run", "pendulum.py", "--check", "--out", "one")
    assert "written to one" in mpirun(2, *run, timeout=150)
    pictures = {path.name for path in (tmp_path / "one").glob("*.png")}
    assert pictures == {"shape.png", "energy.png", "joints.png", "steps.png"}


@pytest.mark.mpi
def test_two_ranks_fail_with_the_exit_code_of_one(tmp_path, mpirun):
    (tmp_path / "pendulum.py").write_text(PENDULUM.replace("WANTED", "5"))
    run = ("-m", "shellmb.cli", "run", "pendulum.py", "--check", "--quiet", "--no-pictures")
    with pytest.raises(pytest.fail.Exception) as failure:
        mpirun(2, *run, timeout=150)
    said = str(failure.value)
    assert said.startswith("exit code 1:")
    assert said.count("check failed: it takes four steps") == 1
    assert "Traceback" not in said


def test_modes_leave_a_table(tmp_path):
    result = within("modes", SMALL, "--count", "3", "--no-pictures", "--out", "m", cwd=tmp_path)
    assert result.exit_code == 0, result.stderr
    lines = (tmp_path / "m" / "modes.csv").read_text().splitlines()
    # first bending mode of a cantilever: 1.875104^2 / (2 pi) sqrt(E h^2 / (12 rho)) / L^2, 1.667 Hz
    assert float(lines[1].split(",")[1]) == pytest.approx(1.667, rel=0.02)
    assert len(lines) == 4


APART = """
import sys
from mpi4py import MPI
from shellmb.cli.main import app
sys.argv = ["shellmb", *{asked}[MPI.COMM_WORLD.rank]]
app()
"""


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("first", "second", "said"),
    [
        (["run", SMALL], ["modes", SMALL], "command is run on rank 0 and modes on another"),
        (
            ["run", SMALL, "--out", "one"],
            ["run", SMALL, "--out", "one", "--accuracy", "0.01", "--of", "tip"],
            "accuracy is None on rank 0 and 0.01 on another",
        ),
    ],
)
def test_ranks_that_are_asked_for_different_things_are_refused(first, second, said, mpirun):
    """Kind: what differs from rank to rank before there is a scene; ranks waited for ever."""
    with pytest.raises(pytest.fail.Exception, match=said):
        mpirun(2, "-c", APART.format(asked=[first, second]), timeout=60, alone=True)
