"""Runs that follow a path: what they leave, and going on after a stop."""

import csv
import json
from pathlib import Path
from typing import Any

import pytest

from shellmb.options.run import Options
from shellmb.running.execute import execute
from shellmb.running.request import Request
from shellmb.running.resume import resume
from shellmb.simulate.simulation import BaseObserver

REQUEST = Request("hinged_roof", {"load_end": "0.745"}, Options(mesh=(2, 2)))


class Stop(BaseObserver):
    """Stops a run after some steps, as Ctrl-C does."""

    def __init__(self, steps: int) -> None:
        self.steps = steps

    def accepted(self, simulation: Any) -> None:
        if simulation.step == self.steps:
            raise KeyboardInterrupt


def rows(directory: Path) -> list[dict[str, str]]:
    with (directory / "history.csv").open() as file:
        return [{k: v for k, v in r.items() if k != "wall_s"} for r in csv.DictReader(file)]


@pytest.mark.parametrize("steps", [3, 11])
def test_a_stopped_path_goes_on_as_if_never_stopped(tmp_path: Path, steps: int) -> None:
    """Before and behind the first limit point, bit for bit; the points are remembered."""
    scene, _ = REQUEST.build()
    whole = execute(scene, tmp_path / "whole", request=REQUEST, pictures=False)
    with pytest.raises(KeyboardInterrupt):
        execute(scene, tmp_path / "parts", [Stop(steps)], request=REQUEST, pictures=False)
    parts = resume(tmp_path / "parts", pictures=False, trust=True)
    assert rows(tmp_path / "parts") == rows(tmp_path / "whole")
    assert parts.summary["path"] == whole.summary["path"]
    # at its end it stays
    assert (
        resume(tmp_path / "parts", pictures=False, trust=True).simulation.step
        == whole.simulation.step
    )


def test_a_path_has_its_own_picture_and_summary(tmp_path: Path) -> None:
    scene, _ = REQUEST.build()
    out = tmp_path / "run"
    run = execute(scene, out, request=REQUEST)
    assert (out / "path.png").stat().st_size > 5000
    points = json.loads((out / "summary.json").read_text())["path"]
    assert [p["kind"] for p in points] == ["limit point", "limit point"]
    assert {"load_factor", "load_rate", "unstable"} <= set(rows(out)[0])
    # the last state is the last frame, though the path ends before the last time
    times = json.loads(next((out / "fields").glob("*.series")).read_text())["files"]
    assert times[-1]["time"] == run.simulation.t < run.scene.t_end
