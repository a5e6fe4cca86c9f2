"""An accuracy on request: levels end where the error is met, or say why not; nothing is lost."""

from __future__ import annotations

import json
import math
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

import shellmb as sm
from shellmb.accuracy.caveats import remarks
from shellmb.accuracy.family import Change
from shellmb.accuracy.request.choose import choose, mesh_order, work
from shellmb.accuracy.request.levels import Level
from shellmb.accuracy.request.messages import offers
from shellmb.accuracy.run_record import RunRecord
from shellmb.api.modeshapes import ModeShapes
from shellmb.cli.main import app
from shellmb.errors import SceneError, Stopped
from shellmb.scene import Scene
from shellmb.simulate.simulation import BaseObserver, Simulation

BAR = sm.RectangularSection(210e9, 0.3, width=0.02, height=0.01, density=7850)
STEEL = sm.Isotropic(E=210e9, nu=0.25, thickness=2e-3, density=7870)


def strip(**options: object) -> Scene:
    """A cantilever strip under a load at its end, at rest or by a ramp."""
    given = {"scheme": "static"} | options
    time = {} if given["scheme"] == "static" else {"time": sm.Ramp(0.1)}
    return Scene(
        "strip",
        sm.Shell("strip", sm.Rectangle(1.0, 0.08), STEEL, mesh=(4, 1)),  # type: ignore[arg-type]
        supports=sm.Clamped("left"),  # type: ignore[arg-type]
        loads=sm.EdgeForce("right", (0, 0, 25.0), **time),  # type: ignore[arg-type]
        probes=sm.Probe("tip", (1.0, 0.0, 0.0), component=2),  # type: ignore[arg-type]
        **given,  # type: ignore[arg-type]
    )


def level(**changes: object) -> Level:
    values = {"mesh": 1e-2, "step": 1e-2, "others": 0.0, "order": 2.0, "refinable": True} | changes
    values = {"change": Change()} | values
    known = {"label": "", "value": 1.0, "seconds": 2.0, "stepping": 1.0}
    error = sum(float(values[k]) for k in ("mesh", "step", "others"))  # type: ignore[arg-type]
    return Level(**known, error=error, total=2.0, dimension=2, **values)  # type: ignore[arg-type]


def test_what_limits_is_refined() -> None:
    """The kind: the part that is too large becomes smaller, and the other one no smaller."""
    of_mesh = choose([level(step=1e-5)], 3e-3)
    assert of_mesh is not None
    assert of_mesh.change.mesh >= 2
    assert of_mesh.change.step >= 1
    of_step = choose([level(mesh=1e-5)], 3e-3)
    assert of_step is not None
    assert of_step.change.mesh == 1
    assert of_step.change.step < 1
    assert choose([level(others=1e-2)], 3e-3) is None
    assert choose([level(refinable=False, step=0.0)], 3e-3) is None


def test_predictions_leave_a_fifth_of_the_error() -> None:
    """The kind: the cheapest level in closed form, of an error that goes with the step's square."""
    # 0.8 of the target is 1/4 and 1/9 of the error, and a hundredth less is not enough
    for part, least in ((4.0, 2), (9.0, 3)):
        for target, times in (
            (1.0 / part / 0.8 * 1.005, least),
            (1.0 / part / 0.8 * 0.995, least + 1),
        ):
            given = level(mesh=0.0, step=1.0, order=2.0, refinable=False)
            found = choose([given], target)
            assert found is not None and found.change.step <= 1 / times, (part, target)
            assert found.error <= 0.8 * target


def test_the_order_of_meshes_is_observed_with_some_caution() -> None:
    """Of errors `h^q` of 1 and 2 times the elements: `q - 0.25`, and between one and two."""
    for q, believed in ((0.5, 1.0), (1.5, 1.25), (2.0, 1.75), (4.0, 2.0)):
        levels = [level(mesh=1.0), level(mesh=2.0**-q, change=Change(mesh=2))]
        assert mesh_order(levels) == pytest.approx(believed), q
    # errors that do not fall, or no other mesh, tell nothing
    assert mesh_order([level(mesh=1.0), level(mesh=1.1, change=Change(mesh=2))]) == 2.0
    assert mesh_order([level(mesh=1.0)]) == 2.0


def test_steps_whose_companions_are_there_are_cheaper() -> None:
    """The kind: a third of the step has its companions, and is as cheap as half of it with them."""
    before = level(mesh=0.0, step=1e-2, order=2.0)
    half = choose([before], 4.2e-3)
    assert half is not None
    assert half.change.step == 1 / 3
    assert half.seconds == pytest.approx(1.0 + 3.0)
    # far from a ninth of it, that is dearer
    assert choose([before], 5e-4).change.step == 1 / 5  # type: ignore[union-attr]
    # nothing of it is there on another mesh
    other = choose([level(mesh=1e-2, step=1e-2)], 4.2e-3)
    assert other is not None
    assert other.change.mesh > 1
    assert work(before, Change(step=1 / 3)) == pytest.approx(4.0)
    assert work(before, Change(step=0.5)) == pytest.approx(1.0 + 2.0 * (1 + 1 / 3 + 1 / 9))


@pytest.mark.parametrize("scene", [strip(), strip(scheme="ep4", dt=2.5e-2, t_end=0.2)])
def test_an_error_is_met(scene: Scene) -> None:
    told: list[float] = []
    run = sm.run(scene, accuracy=5e-3, of="tip")
    norm = "end" if scene.static else "l2"
    found = run.errors.loc[f"tip:{norm}"]
    assert found["error"] <= 5e-3 * found["value"]
    table = run.accuracy
    assert not table["predicted"].iloc[0]
    assert table["predicted"].iloc[-1]
    told += [e for e in table["error"] if e <= 5e-4]
    # a tenth of the error is predicted
    assert told
    fine = scene.with_options(mesh=(24, 6), dt=None if scene.static else 5e-3)
    if scene.static:
        right = sm.run(fine).history["tip"].iloc[-1]
        assert abs(run.history["tip"].iloc[-1] - right) <= 5e-3 * abs(right)


def test_a_budget_ends_it_and_it_goes_on(tmp_path: Path) -> None:
    scene, out = strip(), tmp_path / "run"
    short = sm.run(scene, accuracy=2e-4, budget=1e-3, out=out, pictures=False)
    about = json.loads((out / "accuracy.json").read_text())
    assert not about["met"]
    assert "within the budget" in about["says"]
    assert short.errors.loc["tip:end", "error"] > 0
    again = sm.run(scene, accuracy=6e-4, out=out, pictures=False)
    assert json.loads((out / "accuracy.json").read_text())["met"]
    assert len(again.accuracy) > 1
    # all levels are there: nothing is run again
    resumed = sm.resume(out, scene, pictures=False)
    assert resumed.results == again.results
    assert resumed.errors.equals(again.errors)
    with pytest.raises(SceneError, match="levels of another request"):
        sm.run(strip(t_end=2.0), accuracy=6e-4, out=out)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"accuracy": 0.0}, "accuracy is 0; it must be a relative error between 0 and 1"),
        ({"accuracy": 1e-30}, "accuracy is 1e-30; it must be at least 1e-12"),
        ({"accuracy": 2.0}, "accuracy is 2"),
        ({"accuracy": -1e-3}, "accuracy is -0.001"),
        ({"accuracy": 1e-2, "budget": 0.0}, "budget is 0 s; it must be a positive time"),
        ({"accuracy": 1e-2, "budget": "soon"}, "budget is 'soon'; it must be a time as 60s"),
        ({"of": "tip"}, "of is tip, and no accuracy is given"),
        ({"budget": 3.0}, "budget is 3"),
        ({"accuracy": 1e-2, "of": "top"}, "of is 'top'; it must be one of .* 'tip'"),
        ({"accuracy": 1e-2, "body": "top"}, "body is 'top'; it must be one of .*'strip'"),
        ({"accuracy": 1e-2, "scheme": "auto"}, "scheme is 'auto', and the scene 'strip' is static"),
        ({"scheme": "auto"}, "scheme is 'auto', and no accuracy is given"),
    ],
)
def test_bad_input(options: dict[str, object], says: str, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=says):
        sm.run(strip(), out=tmp_path / "run", **options)  # type: ignore[arg-type]
    assert not [p for p in tmp_path.glob("run/*") if p.name not in ("accuracy.json", "lock")]


def test_a_level_that_fails_leaves_the_others(tmp_path: Path) -> None:
    def only_coarse(run: object) -> dict[str, float]:
        if run.scene.shells[0].mesh[0] > 8:  # type: ignore[attr-defined]
            raise ValueError("too fine")
        return {}

    out = tmp_path / "run"
    scene = replace(strip(), results=only_coarse)
    run = sm.run(scene, accuracy=1e-6, out=out, pictures=False)
    about = json.loads((out / "accuracy.json").read_text())
    assert "too fine" in about["says"]
    assert run.errors.loc["tip:end", "error"] > 0


def test_the_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        app(
            "run heavy_top --set dt=2e-3 --t-end 0.04 --accuracy 1e-2 --of x --scheme auto "
            "--out run --no-pictures".split()
        )
    assert ended.value.code == 0
    said = capsys.readouterr()
    assert "1 %: " in said.out
    assert "1 % is met" in said.out
    assert "level 1: dt = " in said.err
    assert "for the error of the step" in said.err
    assert (tmp_path / "run" / "request.json").is_file()


def test_a_frequency_is_met(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Beam theory gives f1; asked more, the request goes on from its levels."""
    scene = sm.Scene(
        "rod",
        beams=sm.Beam("rod", sm.Line((0, 0, 0), (1, 0, 0)), BAR, elements=1),  # type: ignore[arg-type]
        supports=sm.Clamped("start"),  # type: ignore[arg-type]
    )
    # 1.8751^2 / (2 pi L^2) sqrt(E I / (rho A)); the stated error covers Timoshenko's part, too
    right = 1.8751041**2 / (2 * math.pi) * math.sqrt(210e9 * 0.01**2 / 12 / 7850)
    out = tmp_path / "modes"
    found = sm.modes(scene, out, accuracy=1e-2, of="f1", pictures=False)
    assert found.errors.loc["f1", "error"] <= 1e-2 * right
    assert abs(found.frequencies[0] - right) <= found.errors.loc["f1", "error"] + 1e-3 * right
    before = found.accuracy["label"].tolist()
    again = sm.modes(scene, out, accuracy=1e-3, of="f1", pictures=False)
    assert again.errors.loc["f1", "error"] <= 1e-3 * right
    assert again.accuracy["label"].tolist()[0] == before[0]
    with pytest.raises(SceneError, match=r"natural frequencies come from modes"):
        sm.run(scene, accuracy=1e-2, of="f1")
    free = scene.with_options(scheme="ep", dt=1e-3, t_end=1e-2)
    with pytest.raises(SceneError, match="rigid-body motion"):
        sm.modes(replace(free, supports=()), accuracy=1e-2, of="f1")
    with pytest.raises(SceneError, match="leave out errors and accuracy"):
        sm.modes(scene, accuracy=1e-2, rates=[1.0])


def test_the_command_takes_a_frequency(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The kind: as `run --of f1` and as `modes`; also where results have other names."""
    monkeypatch.chdir(tmp_path)
    for number, command in enumerate(("run", "modes")):
        words = [command, "sudden_load", "--accuracy", "2e-2", "--of", "f1", "--no-pictures"]
        with pytest.raises(SystemExit) as ended:
            app([*words, "--mesh", "2x1", "--out", str(number)])
        assert ended.value.code == 0
        assert "2 % is met" in capsys.readouterr().out
    first, second = (sm.load(tmp_path / k) for k in "01")
    assert isinstance(first, ModeShapes)
    assert isinstance(second, ModeShapes)
    assert first.frequencies[0] == pytest.approx(second.frequencies[0], rel=1e-9)


def test_what_a_killed_level_left_is_run_again(tmp_path: Path) -> None:
    out = tmp_path / "run"
    sm.run(strip(), accuracy=5e-2, out=out, pictures=False)
    left = out / "levels" / "2"
    left.mkdir(parents=True)
    (left / "history.csv").write_text("t\n0.0\n")
    found = sm.run(strip(), accuracy=6e-4, out=out, pictures=False)
    assert found.errors.loc["tip:end", "error"] <= 6e-4 * abs(found.errors.loc["tip:end", "value"])


def test_a_refused_request_leaves_its_directory_free(tmp_path: Path) -> None:
    """The kind: a request without a level, by a wrong name or scene, has nothing to lose."""
    out, asked = tmp_path / "run", {"accuracy": 5e-2, "out": tmp_path / "run", "pictures": False}
    with pytest.raises(SceneError, match=r"of is 'tip:l3'.*norms: end, max, min, mean"):
        sm.run(strip(), of="tip:l3", **asked)
    assert not out.exists()
    with pytest.raises(SceneError, match="scheme is 'auto'"):
        sm.run(strip(), scheme="auto", **asked)
    stiff = replace(strip(), loads=(sm.EdgeForce("right", (0, 0, 4.0)),))
    assert sm.run(stiff, of="tip", **asked).accuracy is not None
    with pytest.raises(SceneError, match="levels of another request"):
        sm.run(strip(), of="tip", **asked)


def test_what_finer_levels_do_not_change_is_said(tmp_path: Path) -> None:
    """A body that is joined cannot be refined alone: the request says it, and keeps its level."""
    sections = {"section": STEEL, "mesh": (2, 1)}
    plate = sm.Shell("plate", sm.Rectangle(1.0, 0.08), **sections)  # type: ignore[arg-type]
    flap = sm.Shell("flap", sm.Rectangle(0.5, 0.08, origin=(1.0, 0.0, 0.0)), **sections)  # type: ignore[arg-type]
    scene = replace(
        strip(),
        shells=(plate, flap),
        joins=(sm.Join("plate", "flap", "right", "left"),),
        supports=(sm.Clamped("left", body="plate"),),
        loads=(sm.EdgeForce("right", (0, 0, 5.0), body="flap"),),
        probes=(sm.Probe("tip", (1.5, 0.0, 0.0), body="flap", component=2),),
    )
    sm.run(scene, accuracy=1e-3, body="plate", out=tmp_path / "run", pictures=False)
    about = json.loads((tmp_path / "run" / "accuracy.json").read_text())
    assert not about["met"]
    assert "join of 'plate' and 'flap': the edges have" in about["says"]
    assert len(about["levels"]) == 1


def test_contacts_are_judged_where_steps_are_fine() -> None:
    """Steps are refined as long as they hide what contacts leave; the rest is not refined away."""
    hidden = choose([level(step=1.0, others=0.3)], 1e-2)
    assert hidden is not None
    assert hidden.change.step < 1
    assert choose([level(step=1e-3, mesh=1e-3, others=0.3)], 1e-2) is None
    assert offers([level(mesh=math.inf)], 1e-2, 1.0, lambda change: "") == []


def test_a_polygon_of_a_file_is_said() -> None:
    """A mesh from a file is refined as it is, which a remark says."""
    kept = RunRecord({}, pd.DataFrame(), {}, frozenset(), 0.0, 0)
    read = sm.Shell("part", sm.MeshFile(__file__), STEEL)
    scene = replace(strip(), shells=(read,), supports=(), loads=(), probes=(), scheme="ep", dt=1.0)
    (said,) = remarks(kept, [kept], None, {}, scene, {})
    assert "part" in said
    assert "chords" in said


class Stopper(BaseObserver):
    """An observer that stops the second level, as a signal does."""

    def accepted(self, simulation: Simulation) -> None:
        """Stop where the mesh is no more the first one."""
        if simulation.scene.shells[0].mesh != (4, 1):
            raise Stopped(2)


def test_a_signal_leaves_a_request_that_goes_on(tmp_path: Path) -> None:
    out = tmp_path / "run"
    with pytest.raises(Stopped, match=r"`shellmb resume .*run` repeats the level"):
        sm.run(strip(), accuracy=6e-4, out=out, observers=[Stopper()], pictures=False)
    assert (out / "levels" / "1" / "summary.json").is_file()
    found = sm.resume(out, strip(), pictures=False)
    assert json.loads((out / "accuracy.json").read_text())["met"]
    assert found.errors.loc["tip:end", "error"] <= 6e-4 * abs(found.errors.loc["tip:end", "value"])


def listed(patch: pytest.MonkeyPatch, last: float = math.inf) -> list[str]:
    """List files as they take their places; at a number of them the process ends as if killed."""
    done: list[str] = []

    def dying(method: Any) -> Any:
        def act(self: Path, target: Path) -> Any:
            if len(done) >= last:
                os._exit(0)
            done.append(f"{target.parent.name}/{target.name}")
            return method(self, target)

        return act

    patch.setattr(Path, "replace", dying(Path.replace))
    patch.setattr(Path, "rename", dying(Path.rename))
    return done


# what a request writes beside its levels, and what becomes of them
SUMMARISED = ("companions.json", "summary.json", "accuracy.json", "run/history.csv")


@pytest.mark.parametrize("which", [SUMMARISED, pytest.param(("",), marks=pytest.mark.slow)])
def test_a_request_that_is_killed_at_any_write_ends_as_if_it_was_not(
    which: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before and in its levels, between them and their errors, and while the last one is moved."""
    asked: Any = {"accuracy": 5e-2, "of": "tip:end", "pictures": False}
    scene = strip(output=sm.Output(frames=2))
    with monkeypatch.context() as patch:
        names = listed(patch)
        sm.run(scene, out=tmp_path / "whole" / "run", **asked)
    files = visible(tmp_path / "whole" / "run")
    whole = json.loads((tmp_path / "whole" / "run" / "summary.json").read_text())
    assert whole["errors"]["probes"]
    # before the first one there is nothing to go on with
    ends = [n for n in range(1, len(names)) if any(part in names[n] for part in which)]
    assert len(ends) > 5
    for end in ends:
        out = tmp_path / str(end) / "run"
        if not (child := os.fork()):
            try:
                listed(monkeypatch, end)
                sm.run(scene, out=out, **asked)
            finally:
                os._exit(1)
        assert os.waitpid(child, 0)[1] == 0
        sm.resume(out, scene, pictures=False)
        found = json.loads((out / "summary.json").read_text())
        for part in ("errors", "results"):
            same(found[part], whole[part])
        assert json.loads((out / "accuracy.json").read_text())["met"]
        assert visible(out) == files, names[end]


def visible(folder: Path) -> set[str]:
    """Names of files but for locks, and for drafts that a process leaves where it is killed."""
    return {path.name for path in folder.rglob("*") if not path.name.startswith(".")}


def same(found: Any, right: Any) -> None:
    """Check that values are equal but for round-off."""
    if isinstance(right, dict):
        assert found.keys() == right.keys()
        for key in right:
            same(found[key], right[key])
    elif isinstance(right, float):
        assert found == pytest.approx(right, rel=1e-6, abs=1e-12)
    else:
        assert found == right
