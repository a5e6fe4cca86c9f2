"""Runs are made once, gone on with when stopped, refused when they are others; what is printed."""

import dataclasses
import json
from pathlib import Path

import matplotlib.figure
import numpy as np
import pytest
from PIL import Image

from demos.paper.example import Example, Figure, Results, Run, Statement, Verdict
from demos.paper.make import Made, find_examples, make
from demos.paper.report import print_made
from demos.paper.runs import finish, request_of
from shellmb.accuracy.measuring import to_json
from shellmb.errors import SceneError, Stopped
from shellmb.running.execute import execute
from shellmb.simulate.simulation import BaseObserver, Simulation

SHORT = {"t_end": 0.02}
FIRST = Run("first", "slider_crank", {"flexible": False}, SHORT)
SECOND = Run("second", "slider_crank", {}, {**SHORT, "scheme": "ep"})


def plot(made: matplotlib.figure.Figure, results: Results) -> None:
    axes = made.subplots()
    for run in results.values():
        axes.plot(run.history["t"], run.history["slider_x"], label=run.name)


def fine(results: Results) -> Verdict:
    end = float(results["first"].history["slider_x"].iloc[-1])
    return Verdict(f"{end:.3f} m", 0.4 < end <= 0.5)


EXAMPLE = Example(
    "0.0",
    "A slider-crank",
    (FIRST, SECOND),
    (
        Figure("1", "The slider of one run.", ("first",), plot),
        Figure("2", "Of both.", ("first", "second"), plot),
    ),
    (
        Statement("The slider is in its range", "0.4 to 0.5 m", ("first",), fine),
        Statement("It never is", "-", ("first", "second"), lambda r: Verdict("it is", False)),
    ),
    animation="first",
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("figures")


@pytest.fixture(scope="module")
def made(folder: Path) -> Made:
    return make(EXAMPLE, folder / "runs", folder / "pictures")


def test_everything_is_made(made: Made, folder: Path) -> None:
    assert [p.name for p in made.pictures] == ["figure-1.png", "figure-2.png", "animation.gif"]
    for path in made.pictures[:2]:
        with Image.open(path) as image:
            # 7 x 5 inches, many colours: not an empty picture
            assert image.size == (770, 550)
            assert len(image.getcolors()) > 10
        assert path.stat().st_size < 120_000
    with Image.open(made.pictures[2]) as image:
        # one picture for each frame of a run of ten steps and the first state
        assert image.n_frames == 11
    assert [j.passed for j in made.judged] == [True, False]
    assert set(made.wall_s) == {"first", "second"}
    assert all(seconds > 0 for seconds in made.wall_s.values())


def test_finished_runs_are_read(made: Made, folder: Path) -> None:
    history = folder / "runs" / "first" / "history.csv"
    before = history.stat().st_mtime_ns
    again = finish(FIRST, folder / "runs" / "first")
    assert history.stat().st_mtime_ns == before
    assert again.history.equals(made.runs["first"].history)
    assert again.results == made.runs["first"].results


def test_only_one_run(made: Made, folder: Path) -> None:
    one = make(EXAMPLE, folder / "runs", None, only=["first"])
    assert list(one.runs) == ["first"]
    assert one.pictures == []
    # the other statement is about both
    assert [j.statement for j in one.judged] == ["The slider is in its range"]


class Stop(BaseObserver):
    """Ends a run where the shorter one ends."""

    def accepted(self, simulation: Simulation) -> None:
        if simulation.t > 0.02:
            raise Stopped(15)


def test_stopped_run_goes_on(made: Made, folder: Path, tmp_path: Path) -> None:
    whole = made.runs["first"].history
    long = dataclasses.replace(FIRST, name="long", options={"t_end": 0.03})
    request = request_of(long)
    with pytest.raises(Stopped):
        execute(request.build()[0], tmp_path / "long", [Stop()], pictures=False, request=request)
    # as if it had been killed
    (tmp_path / "long" / "summary.json").unlink()
    went_on = finish(long, tmp_path / "long").history
    assert went_on["t"].iloc[-1] == pytest.approx(0.03, rel=1e-12)
    # the last step of the shorter run ends at its end, to round-off where the longer one's does
    np.testing.assert_allclose(went_on["slider_x"][: len(whole)], whole["slider_x"], rtol=1e-14)


def test_run_without_a_state_begins_anew(made: Made, tmp_path: Path) -> None:
    directory = tmp_path / "first"
    directory.mkdir()
    (directory / "request.json").write_text(json.dumps(request_of(FIRST).to_dict()))
    assert finish(FIRST, directory).history["t"].iloc[-1] == pytest.approx(0.02, rel=1e-12)


def test_another_run_is_refused(made: Made, folder: Path) -> None:
    with pytest.raises(SceneError, match="not of the run 'second' as it is defined now"):
        finish(SECOND, folder / "runs" / "first")


def test_failures_that_are_expected(made: Made, folder: Path, tmp_path: Path) -> None:
    run = dataclasses.replace(FIRST, name="failing")
    finish(run, tmp_path / "failing")
    path = tmp_path / "failing" / "summary.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "failed": "did not converge"}))
    stamp = path.stat().st_mtime_ns
    # a failure that the paper speaks of is the end of the run
    expected = dataclasses.replace(run, expected_failure="the paper says so")
    assert finish(expected, tmp_path / "failing").summary["failed"] == "did not converge"
    assert path.stat().st_mtime_ns == stamp
    # any other is tried again
    assert finish(run, tmp_path / "failing").summary["failed"] is None


def test_what_is_printed(made: Made, capsys: pytest.CaptureFixture[str]) -> None:
    rows = json.loads(to_json(made.judged, passed="pass"))
    assert rows[0] == {
        "example": "0.0",
        "statement": "The slider is in its range",
        "paper": "0.4 to 0.5 m",
        "ours": rows[0]["ours"],
        "pass": True,
        "why": "",
    }
    assert rows[1]["pass"] is False
    print_made(made)
    printed = capsys.readouterr().out
    assert "The slider is in its range" in printed
    assert "FAIL" in printed
    assert "run second: " in printed


def test_unknown_example() -> None:
    with pytest.raises(SceneError, match=r"no example '7.1'; give one of 6\.1"):
        find_examples("7.1")
