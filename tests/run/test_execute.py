"""Run directories: what is in them, what a failure leaves, and going on after a stop."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import pyvista

import shellmb as sm
from shellmb.errors import ConvergenceError, SceneError
from shellmb.options.run import Options
from shellmb.running.execute import execute
from shellmb.running.loader import load
from shellmb.running.request import Request
from shellmb.running.resume import resume
from shellmb.scene import Solver, StepControl
from shellmb.simulate.simulation import BaseObserver

SMALL = str(Path(__file__).with_name("scene_small.py"))

KEYS = {
    "scene",
    "scheme",
    "alpha",
    "dt",
    "t_end",
    "steps",
    "rejected_steps",
    "newton_iterations",
    "unknowns",
    "elements",
    "ranks",
    "setup_s",
    "jit_s",
    "wall_s",
    "wall_per_step_s",
    "energy_balance_error",
    "constraint_max",
    "director_max",
    "linear_momentum_drift",
    "angular_momentum_drift",
    "dissipated_share",
    "versions",
    "warnings",
    "results",
}


class Stop(BaseObserver):
    """Stops a run after some steps, as Ctrl-C does."""

    def __init__(self, steps):
        self.steps = steps

    def accepted(self, simulation):
        if simulation.step == self.steps:
            raise KeyboardInterrupt


class Height(BaseObserver):
    """A measuring observer of a user."""

    def accepted(self, simulation):
        self.steps = simulation.step

    def start(self, simulation):
        self.steps = 0

    def measure(self):
        return {"twice": 2 * self.steps}


def rows(directory, without=("wall_s",)):
    with (directory / "history.csv").open() as file:
        table = list(csv.DictReader(file))
    return [{k: v for k, v in row.items() if k not in without} for row in table]


def request(newton=None, **parameters):
    return Request(SMALL, {k: str(v) for k, v in parameters.items()}, Options(newton=newton))


def run(out, *, asked=None, observers=(), **keywords):
    asked = asked or request()
    scene, module = asked.build()
    keywords = {"pictures": False, "request": asked, "results": module.results} | keywords
    return execute(scene, out, observers, **keywords)


class Plain:
    """An observer that derives from nothing and measures nothing."""

    def start(self, simulation):
        self.steps = 0

    def accepted(self, simulation):
        self.steps += 1

    def nothing(self, *_):
        return {}

    solved = switched = finish = state = restore = nothing


def test_observers_may_derive_from_nothing_and_measure_nothing(tmp_path):
    """Kind: what is accepted as an observer runs, also beside one that measures."""
    plain = Plain()
    result = run(tmp_path / "run", observers=[plain, Height()])
    assert plain.steps == len(result.history) - 1 == result.history["twice"].iloc[-1] / 2


def test_directory_is_complete(tmp_path):
    out = tmp_path / "run"
    result = run(out, pictures=True, observers=[Height()])
    names = {path.name for path in out.iterdir()}
    pictures = {"shape.png", "probes.png", "energy.png", "steps.png", "animation.gif"}
    written = {"summary.json", "history.csv", "fields", "state", "request.json", "scene.json"}
    assert names == pictures | written

    summary = json.loads((out / "summary.json").read_text())
    assert summary.keys() >= KEYS
    assert summary["steps"] == 5
    assert summary["failed"] is None
    assert summary["results"] == {"tip": result.history["tip_z"].iloc[-1]}
    assert summary["energy_balance_error"] < 1e-12
    assert summary["director_max"] < 1e-14
    # with what the clamped edge holds the balance closes in a supported scene, too
    assert summary["linear_momentum_drift"] < 1e-10
    assert summary["angular_momentum_drift"] < 1e-10

    table = rows(out)
    assert [int(row["step"]) for row in table] == [0, 1, 2, 3, 4, 5]
    assert [float(row["twice"]) for row in table] == [0, 2, 4, 6, 8, 10]
    for name, column in result.history.items():
        if name not in ("jump", "wall_s"):
            assert [float(row[name]) for row in table] == column.tolist()

    series = json.loads((out / "fields" / "plate.vtu.series").read_text())["files"]
    assert [f["time"] for f in series][0::2] == [0, 0.005]
    last = pyvista.read(out / "fields" / series[-1]["name"])
    assert last.n_cells == 12
    assert last.n_points == 13 * 5
    moved = last.points - last.point_data["reference"]
    assert np.allclose(moved, last.point_data["displacement"], atol=1e-6)
    assert np.max(last.point_data["displacement"][:, 2]) == pytest.approx(
        result.history["tip_z"].iloc[-1], rel=0.02
    )


def test_nothing_is_written_without_a_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = run(None)
    assert result.results["tip"] > 0
    assert list(tmp_path.iterdir()) == []


def test_free_flight_keeps_momenta(tmp_path):
    result = run(None, asked=request(held=False))
    assert result.summary["linear_momentum_drift"] < 1e-12
    assert result.summary["angular_momentum_drift"] < 1e-12
    impulse = 2.0 * result.history["t"]
    assert np.allclose(result.history["momentum_z"], impulse, rtol=1e-10)


def test_used_directory_is_refused(tmp_path):
    (tmp_path / "something").touch()
    with pytest.raises(SceneError, match="exists and is not empty"):
        run(tmp_path)


@pytest.mark.parametrize("stop", [1, 3])
def test_resumed_run_equals_the_uninterrupted_one_bit_for_bit(tmp_path, stop):
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    # factorisations in each iteration: older ones are not kept in the state
    expected = run(whole, asked=request("full"))
    with pytest.raises(KeyboardInterrupt):
        run(parts, asked=request("full"), observers=[Stop(stop)])
    stopped = json.loads((parts / "summary.json").read_text())
    assert stopped["failed"] == "KeyboardInterrupt"
    result = resume(parts, pictures=False, scene_file=SMALL)
    assert rows(parts) == rows(whole)
    assert result.results == expected.results
    assert result.summary["energy_balance_error"] == expected.summary["energy_balance_error"]
    for name, array in expected.simulation.arrays().items():
        assert np.array_equal(array, result.simulation.arrays()[name])
    fields = [sorted(p.name for p in (d / "fields").iterdir()) for d in (whole, parts)]
    assert fields[0] == fields[1]
    for name in fields[0]:
        assert (whole / "fields" / name).read_bytes() == (parts / "fields" / name).read_bytes()


def test_resumed_run_equals_the_uninterrupted_one_to_round_off_where_factors_are_kept(tmp_path):
    expected = run(tmp_path / "whole")
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path / "parts", observers=[Stop(3)])
    result = resume(tmp_path / "parts", pictures=False, trust=True)
    for name, array in expected.simulation.arrays().items():
        found = result.simulation.arrays()[name]
        # the iteration leaves 1e-15 of each part; velocities are differences over 1e-3 s
        np.testing.assert_allclose(found, array, rtol=1e-10, atol=1e-10 * np.abs(array).max())


def test_resuming_a_complete_run_changes_nothing(tmp_path):
    run(tmp_path / "run")
    before = rows(tmp_path / "run")
    result = resume(tmp_path / "run", pictures=False, trust=True)
    assert rows(tmp_path / "run") == before
    assert result.simulation.step == 5


def test_failed_run_leaves_its_last_good_state(tmp_path, caplog):
    scene, module = request().build()
    # a load that jumps in the fourth step, few iterations, and no smaller steps to be tried
    load_ = replace(scene.loads[0], time=lambda t: 1.0 if t < 3e-3 else 1e4)
    hard = replace(scene, loads=load_, step_control=StepControl(min_dt=1e-3))
    bad = replace(hard, solver=Solver(max_iterations=4))
    with pytest.raises(ConvergenceError, match=r"step 4.*last good state is in"):
        execute(bad, tmp_path / "run", pictures=False, results=module.results)
    # a temporary directory is gone before anybody can look into it
    with pytest.raises(ConvergenceError, match=r"step 4.*left when Python ends; give out to keep"):
        sm.run(bad, pictures=False)
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert "step 4" in summary["failed"]
    assert summary["steps"] == 3
    assert len(rows(tmp_path / "run")) == 4
    # another load is another scene; how it is solved is not
    with pytest.raises(SceneError, match=r"loads\[0\].time was test_.*<lambda>, is null"):
        resume(tmp_path / "run", pictures=False, scene=scene)
    result = resume(tmp_path / "run", pictures=False, scene=hard)
    assert "other numerical settings: solver.max_iterations was 4, is 30" in caplog.text
    assert result.simulation.step == 5
    assert result.summary["failed"] is None
    assert [int(row["step"]) for row in rows(tmp_path / "run")] == [0, 1, 2, 3, 4, 5]


def test_what_cannot_be_resumed(tmp_path):
    with pytest.raises(SceneError, match="give a directory made by `shellmb run`"):
        resume(tmp_path)
    scene = load(SMALL).build()
    with pytest.raises(SceneError, match="there is no state"):
        resume(tmp_path, scene=scene)
    run(tmp_path / "run")
    other = Options(mesh=(4, 2)).apply(scene)
    with pytest.raises(SceneError, match=r"shells\['plate'\].mesh was \[6, 2\], is \[4, 2\]"):
        resume(tmp_path / "run", scene=other)
