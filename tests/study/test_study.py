"""Small studies from end to end: runs, a stop, what is written and printed."""

import json

import pytest
from typer.testing import CliRunner

import shellmb as sm
from shellmb.accuracy.studies import runner
from shellmb.accuracy.studies.runner import RECORDS
from shellmb.cli.main import app
from shellmb.errors import ConvergenceError
from shellmb.options.run import Options
from shellmb.running.execute import execute
from shellmb.running.loader import load

from .conftest import SMALL

SWEEP = ("--dt", "1e-3,5e-4", "--scheme", "ep,ed", "--alpha", "1")
QUANTITIES = ("--quantity", "tip_z:l2", "--quantity", "tip")

KEYS = {
    "schema",
    "title",
    "scene",
    "parameters",
    "t_end",
    "quantity",
    "clock",
    "swept",
    "not_refined",
    "reference",
    "points",
    "left_out",
    "orders",
    "targets",
    "sentence",
}
POINT_KEYS = {
    "choice",
    "error",
    "error_below",
    "time_s",
    "spread",
    "rounds",
    "setup_s",
    "jit_s",
    "steps",
    "rejected",
    "iterations",
    "jump",
    "failed",
    "credit",
}


def study(*arguments):
    return CliRunner().invoke(app, ["study", *map(str, arguments)])


def scene(folder, steps=4):
    """One and a half elements' worth of the small scene."""
    text = "\n".join(
        [
            "import importlib.util, sys",
            f"spec = importlib.util.spec_from_file_location('small_for_study', {SMALL!r})",
            "small = importlib.util.module_from_spec(spec)",
            "spec.loader.exec_module(small)",
            "def scene(sides: tuple[int, int] = (2, 1)):",
            f"    return small.scene(steps={steps}, sides=sides)",
            "def results(run):",
            "    return small.results(run)",
        ]
    )
    path = folder / "strip.py"
    path.write_text(text)
    return path


def test_a_study_is_stopped_and_goes_on(tmp_path, monkeypatch):
    path, out = scene(tmp_path), tmp_path / "out"
    arguments = (path, *SWEEP, *QUANTITIES, "--repeat", 2, "--out", out)
    done = []
    whole = runner.run_once

    def counted(sweep, choice, quantities, round_, comm):
        if len(done) == stop:
            raise KeyboardInterrupt
        done.append((choice, round_))
        return whole(sweep, choice, quantities, round_, comm)

    monkeypatch.setattr(runner, "run_once", counted)
    stop = 3
    result = study(*arguments)
    assert result.exit_code == 130
    assert f"stopped; the same command continues in {out}" in result.stderr
    assert len((out / RECORDS).read_text().splitlines()) == 1 + 3

    stop = None
    result = study(*arguments)
    assert result.exit_code == 0, result.output
    # 4 configurations twice; of the reference one run is none of them, and two are
    assert len(done) == len(set(done)) == 4 * 2 + 1
    assert "3 of 9 runs are done already" in result.stderr
    # in turn: no configuration is run again before all others have had theirs
    assert [round_ for _, round_ in done] == [0] * 5 + [1] * 4

    assert "tip_z:l2" in result.stdout
    assert "observed orders: EP in dt: " in result.stdout
    assert "error in tip from the step alone choose" in result.stdout
    assert {p.name for p in out.iterdir()} == {RECORDS, "study.json", "study.png"}

    found = json.loads((out / "study.json").read_text())
    assert [f["quantity"] for f in found] == ["tip_z:l2", "tip"]
    for finding in found:
        assert finding.keys() == KEYS
        assert finding["swept"] == ["scheme", "alpha", "dt"]
        assert finding["not_refined"] == ["the mesh (2x1 in all runs)"]
        assert all(p.keys() == POINT_KEYS for p in finding["points"])
        assert len(finding["points"]) == 4
        assert all(p["rounds"] == 2 and p["time_s"] > 0 for p in finding["points"])
        assert finding["sentence"].startswith("For 1 % error in ")
    curve = found[0]
    # five steps are too few to see an order, and enough to see the error shrink
    errors = {(p["choice"]["scheme"], p["choice"]["dt"]): p["error"] for p in curve["points"]}
    for scheme in ("ep", "ed"):
        assert 0 < errors[scheme, 5e-4] < errors[scheme, 1e-3] < 0.3
    assert 0 < curve["reference"]["uncertainty"] < min(errors.values())
    assert curve["reference"]["source"] == "ED alpha = 1, 2x1, dt = 0.00025 s"
    jumps = {p["choice"]["scheme"]: p["jump"] for p in curve["points"]}
    assert jumps["ep"] is None
    assert jumps["ed"] > 0

    # all is done: the same numbers again, without a run
    before = len(done)
    result = study(*arguments, "--json", "--no-pictures")
    assert len(done) == before
    assert json.loads(result.stdout) == found


def test_failures_are_shown_and_not_repeated(tmp_path, monkeypatch):
    path, out = scene(tmp_path, steps=1), tmp_path / "out"
    whole = runner.execute

    def strict(scene, *arguments, **options):
        if scene.solver.tolerance < 1e-30:
            raise ConvergenceError("strip did not converge")
        return whole(scene, *arguments, **options)

    monkeypatch.setattr(runner, "execute", strict)
    sweep = (
        "--newton-tolerance",
        "1e-9,1e-40",
        "--scheme",
        "ep",
        "--exact",
        "1e-6",
        "--quantity",
        "tip",
    )
    result = study(path, *sweep, "--repeat", 2, "--out", out)
    assert result.exit_code == 0, result.output
    assert "failed: Newton tolerance 1e-40" in result.stdout
    records = [json.loads(line) for line in (out / RECORDS).read_text().splitlines()[1:]]
    assert [(r["choice"]["newton_tolerance"], r["round"]) for r in records if r["failed"]] == [
        (1e-40, 0)
    ]
    points = json.loads((out / "study.json").read_text())[0]["points"]
    assert [p["failed"] != "" for p in points] == [False, True]


def test_meshes_and_exact_values(tmp_path):
    # Navier's series; two elements along a side are 3 % off, four 0.2 % (Q2, order above 4)
    sweep = ("--mesh", "2x2,4x4", "--exact", "2.1135179e-4", "--quantity", "deflection")
    result = study("loaded_plate", *sweep, "--repeat", 1, "--out", tmp_path / "out", "--json")
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)[0]
    assert found["reference"] == {
        "source": "exact",
        "own": False,
        "value": 2.1135179e-4,
        "uncertainty": 0.0,
        "order": None,
        "differences": [],
    }
    coarse, fine = (p["error"] for p in found["points"])
    assert 0.01 < coarse < 0.05
    assert fine < coarse / 10
    assert found["orders"][0]["direction"] == "h"
    assert found["orders"][0]["order"] > 3


def test_the_bundled_studies_are_listed():
    result = study()
    assert result.exit_code == 0
    assert "tumbling_plate" in result.stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((SMALL, "--dt", "1e-3,fast"), "study: dt is '1e-3,fast'; it must be values of its kind"),
        ((SMALL, "--dt", "1e-3,-1"), "study: dt is '1e-3,-1'"),
        ((SMALL, "--mesh", "4,4"), "mesh is '4'; it must be two counts as in 8x4"),
        ((SMALL, "--degree", "1,2"), "degree is 1"),
        ((SMALL, "--cell", "hex"), "'hex' is not possible here; it must be 'quad' or 'tri'"),
        ((SMALL, "--scheme", "rk4"), "scheme is 'rk4'; it must be one of 'static'"),
        ((SMALL, "--alpha", "0,1"), "where no scheme is 'ed'"),
        ((SMALL, "--quantity", "tip_z:most"), "quantity is 'tip_z:most'"),
        ((SMALL, "--set", "width=2"), "there is no parameter 'width'"),
        (("nothing",), "there is no scene 'nothing'"),
        (("--bundled", "nothing"), "bundled is 'nothing'; it must be 'all' or one of"),
        ((SMALL, "--bundled", "all"), "bundled is 'all'; beside it a scene must be left out"),
        (("--bundled", "all", "--t-end", "1"), "beside it t-end must be left out"),
        (("--dt", "1e-3"), "study: scene is missing; it must be named where dt is given"),
        ((SMALL, "--repeat", "0"), "repeat is 0; it must be at least 1"),
    ],
)
def test_bad_input_is_one_sentence(arguments, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = study(*arguments)
    assert result.exit_code == 2
    (error,) = result.stderr.splitlines()
    assert error.startswith("error: ")
    assert message in error
    assert not [*tmp_path.iterdir()], "nothing was run"


def test_an_unknown_quantity_lists_those_known(tmp_path):
    path = scene(tmp_path, steps=1)
    result = study(path, "--dt", "1e-3,5e-4", "--quantity", "tipp", "--out", tmp_path / "out")
    assert result.exit_code == 2
    assert "one of the scene's results, 'tip', or COLUMN:NORM" in result.stderr
    assert "'tip_speed'" in result.stderr


@pytest.mark.mpi
def test_two_ranks(tmp_path, mpirun):
    path = scene(tmp_path, steps=2)
    printed = mpirun(
        2,
        *(
            "-m",
            "shellmb.cli",
            "study",
            path,
            "--exact",
            "1e-5",
            "--quantity",
            "tip",
            "--repeat",
            "1",
        ),
        *("--out", tmp_path / "out", "--json", "--quiet"),
    )
    (point,) = json.loads(printed)[0]["points"]
    assert point["steps"] == 2


def test_every_ed_run_tells_its_jumps():
    module = load(SMALL)
    for scheme in ("ep", "ed"):
        run = execute(Options(scheme=scheme, mesh=(2, 1)).apply(module.build({"steps": "3"})))
        jumps = run.summary["jump_error"]
        if scheme == "ep":
            assert jumps is None
            continue
        column = run.history["jump"].to_numpy()[1:]
        assert jumps["max"] == run.summary["jump_max"] == column.max() > 0
        assert jumps["largest"] == column.tolist()
        assert jumps["t"] == run.history["t"].to_numpy()[1:].tolist()


# What a user's own scheme object is called, and by which scheme it is judged
@pytest.mark.parametrize("reference", [None, "ep4"])
def test_a_scheme_of_the_users_own_is_studied(reference):
    from shellmb.demos.own_forms import scene as own

    options = {} if reference is None else {"reference": reference}
    steps = {"dt": [8e-3, 4e-3, 2e-3], "t_end": 0.16}
    found = sm.study(own("scheme"), quantity="tip:l2", **steps, **options)
    # of second order; the load rises within 0.1 s, and the coarsest step sees that
    assert found.orders["order"].iloc[0] == pytest.approx(2, abs=0.3)
    assert {*found.table["scheme"]} == {"newmark"}


def falling(dt, scheme="ep4"):
    """Two bodies that fall about hinges, with a force of each."""
    section = sm.Isotropic(E=5e8, nu=0.3, thickness=5e-3, density=1500.0)
    beam = sm.GeneralSection(
        [1e5, 1e5, 1e5, 1, 1, 1], mass_per_length=1.0, second_moments=(1e-4, 0, 1e-4)
    )
    return sm.Scene(
        "falling",
        sm.Shell("strip", sm.Rectangle(1.0, 0.2), section, mesh=(3, 1)),
        beams=sm.Beam("rod", sm.Line((0, 1, 0), (1, 1, 0)), beam, elements=2),
        supports=[sm.Hinged("left", body="strip"), sm.Hinged("start", body="rod")],
        loads=sm.Gravity(),
        probes=[
            sm.Probe("N", (1 / 3, 0.0, 0.0), "membrane", 0, body="strip"),
            sm.Probe("F", (0.5, 1, 0), "force", 0, body="rod"),
        ],
        scheme=scheme,
        dt=dt,
        t_end=0.48,
    )


@pytest.mark.parametrize("column", ["N", "F"])
def test_forces_of_sections_are_judged_as_the_means_that_they_are(column):
    """Kind: a column of means over steps, judged as values at their ends, is half a step late."""
    found = sm.study(falling(0.02), quantity=f"{column}:l2", dt=[0.04, 0.02])
    coarse, fine = found.table["error"]
    # half a step late: by 0.02 s of a force that rises as t^2 within 0.48 s, that is 7 %
    assert fine < coarse < 0.02


def test_errors_that_are_left_out_are_said():
    """Kind: an offer for an error that was not looked at."""
    told = sm.study(falling(0.02), quantity="N:end", dt=[0.04, 0.02]).advice
    assert "from the step alone" in told
    assert "leave out the mesh (3x1 in all runs)" in told
