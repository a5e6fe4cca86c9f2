"""Errors beside results: true ones are covered, whatever the scene consists of."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

import shellmb as sm
from shellmb.accuracy.errors import add_errors, estimate_errors
from shellmb.accuracy.estimates import Errors
from shellmb.accuracy.studies.quantity import Quantity
from shellmb.cli.main import app
from shellmb.running.execute import RunResult, execute
from shellmb.scene import Scene
from shellmb.show.account import with_error
from tests import scenes

STEEL = sm.Isotropic(E=210e9, nu=0.25, thickness=2e-3, density=7870)


def tip(run: RunResult) -> dict[str, float]:
    return {"tip": run.column("tip")[-1]}


def plate(**options: object) -> Scene:
    """A cantilever plate under a load that grows."""
    given = {"scheme": "ep4", "dt": 1e-2, "t_end": 0.2, "results": tip} | options
    body = {"section": STEEL, "size": (1.0, 0.08), "mesh": (4, 1)}
    probe = sm.Probe("tip", (1.0, 0.04, 0.0), component=2)
    return scenes.cantilever((0, 0, 25.0), probes=probe, **{**body, **given})


def true_error(run: RunResult, finer: Scene, quantity: Quantity, size: float) -> float:
    reference = execute(finer, pictures=False)
    mine = quantity.take(run.results, run.history)
    return quantity.difference(mine, quantity.take(reference.results, reference.history)) * size


@pytest.mark.parametrize("static", [False, True])
def test_true_errors_are_covered(static: bool) -> None:
    scene = plate(scheme="static", dt=0.5, t_end=1.0) if static else plate()
    run = execute(scene, pictures=False)
    errors = estimate_errors(run)
    finer = scene.with_options(degree=3, mesh=(8, 2), dt=None if static else 2.5e-3)
    quantity = Quantity("tip", "end" if static else "l2")
    found = errors.others[str(quantity)]
    true = true_error(run, finer, quantity, found.value)
    assert 0 < true <= found.error <= 10 * true
    assert (found.step.error == 0) == static
    assert found.mesh.error > 0
    assert not errors.remarks
    assert set(errors.results) == {"tip"}


def test_rigid_bodies_have_no_error_of_a_mesh() -> None:
    top = sm.load_scene("heavy_top", dt=2e-3, t_end=0.04)
    run = execute(replace(top, probes=sm.Probe("place", "center", component=0)), pictures=False)
    found = estimate_errors(run).others["place:l2"]
    assert found.mesh.error == 0
    assert found.step.error > 0
    # of steps that are far from small
    assert found.step.order == pytest.approx(2, abs=0.5)


def test_what_cannot_be_told_is_said() -> None:
    """A companion that fails leaves an unknown error and a sentence, and the run stays."""

    def only_this_step(run: RunResult) -> dict[str, float]:
        assert run.scene.dt == 0.01
        return tip(run)

    run = execute(plate(t_end=0.1, results=only_this_step), pictures=False)
    errors = estimate_errors(run)
    assert any("the run with 3 times the step fails" in r for r in errors.remarks)
    assert any("the error of the step is not known of tip" in r for r in errors.remarks)
    assert errors.others["tip:end"].to_dict()["error"] is None
    assert "step not known" in with_error(errors.others["tip:end"].to_dict())


def test_a_scene_asks_for_errors(tmp_path: Path) -> None:
    run = sm.run(plate(t_end=0.05, errors=True), out=tmp_path / "run", pictures=False)
    assert run.errors.loc["tip", "error"] > 0
    resumed = sm.resume(tmp_path / "run", plate(t_end=0.05, errors=True), pictures=False)
    assert resumed.errors.loc["tip", "error"] == pytest.approx(
        run.errors.loc["tip", "error"], rel=1e-3
    )


def test_comparison_runs_do_not_warn_again() -> None:
    """The run, or its modes, have said what is to be said of the units."""
    scene = plate(t_end=0.02, section=replace(STEEL, E=210e3), errors=True)
    with pytest.warns(sm.ShellmbWarning, match="check the units") as said:
        sm.run(scene)
    assert len(said) == 1
    with pytest.warns(sm.ShellmbWarning, match="check the units") as said:
        sm.modes(scene, count=2)
    assert len(said) == 1


def test_what_is_off_costs_nothing() -> None:
    code = """
import sys
import shellmb as sm
top = sm.load_scene("heavy_top", dt=2e-3, t_end=4e-3)
sm.run(top)
assert not [m for m in sys.modules if m.startswith("shellmb.accuracy")]
"""
    subprocess.run([sys.executable, "-c", code], check=True)


def parts(scene: Scene) -> dict[str, float]:
    found = add_errors(execute(scene, pictures=False)).summary["errors"]["probes"]["tip:l2"]
    return {k.removeprefix("error_"): v for k, v in found.items() if k.startswith("error_")}


def test_a_loose_tolerance_has_its_share() -> None:
    loose = plate(t_end=0.1)
    loose = replace(loose, solver=replace(loose.solver, tolerance=1e-3))
    assert parts(loose)["newton"] > 0


@pytest.mark.slow  # kernels of reduced bodies
def test_a_reduced_body_has_its_share() -> None:
    found = parts(plate(t_end=0.05).with_options(model="modal:1"))
    assert found["model"] > 0
    assert not {"newton", "contact"} & set(found)


def test_command_and_python_tell_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "strip.py"
    file.write_text(SCENE)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        app(["run", str(file), "--errors", "--out", "run", "--no-pictures"])
    assert ended.value.code == 0
    said = capsys.readouterr().out
    assert " +- " in said
    stored = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert set(stored["results"]["tip"]) >= {"value", "error", "error_mesh", "error_step"}
    run = sm.load(tmp_path / "run")
    assert isinstance(run, sm.Run)
    again = sm.run(str(file), errors=True)
    assert again.errors.loc["tip", "error"] == run.errors.loc["tip", "error"]
    assert run.results == again.results
    assert isinstance(run.results["tip"], float)


def test_numbers_end_where_their_errors_begin() -> None:
    def shown(value: float, error: float) -> str:
        found = {"value": value, "error": error, "error_mesh": error, "error_step": 0.0}
        return with_error(found)

    assert shown(0.0774035, 3.3e-4).startswith("0.07740 +- 3.3e-04 (mesh 3.3e-04)")
    assert shown(123456.789, 250.0).startswith("123457 +- ")
    assert shown(1.23456789e-9, 2.5e-12).startswith("1.2346e-09 +- ")
    # of what vanishes, and of round-off
    assert shown(5e-224, 1.9e-7).startswith("0 +- ")
    assert shown(7.0737201667702976e-03, 7.5e-18) == "0.00707372"


def test_the_run_itself_stays_as_it_is() -> None:
    scene = plate(t_end=0.03)
    run = execute(scene, pictures=False)
    before = run.column("tip").copy()
    errors = estimate_errors(run)
    assert isinstance(errors, Errors)
    assert (run.column("tip") == before).all()
    assert run.summary["results"] == {"tip": run.results["tip"]}


SCENE = '''"""A strip."""
import shellmb as sm


def scene():
    steel = sm.Isotropic(E=210e9, nu=0.25, thickness=2e-3, density=7870)
    return sm.Scene(
        "strip",
        sm.Shell("plate", sm.Rectangle(1.0, 0.08), steel, mesh=(4, 1)),
        supports=sm.Clamped("left"),
        loads=sm.EdgeForce("right", (0, 0, 25.0)),
        probes=sm.Probe("tip", (1.0, 0.04, 0.0), component=2),
        scheme="ep4", dt=1e-2, t_end=0.1,
    )


def results(run):
    return {"tip": run.column("tip")[-1]}
'''
