"""What observers collect is on disk in time: soon, before a state that counts on it, at the end."""

import json
from functools import partial
from pathlib import Path

import pytest

from shellmb.observers import history
from shellmb.observers.files.checkpoint import Checkpoint
from shellmb.observers.history import read_history
from shellmb.running import standard
from shellmb.running.execute import execute
from shellmb.running.standard import HISTORY
from shellmb.scene import Clamped, EdgeForce, Isotropic, Output, Rectangle, Scene, Shell
from shellmb.simulate.simulation import BaseObserver, Simulation

STEPS = 5


def scene() -> Scene:
    return Scene(
        "small",
        Shell(
            "plate",
            Rectangle(1.0, 0.08),
            Isotropic(210e9, 0.25, thickness=2e-3, density=7870.0),
            mesh=(2, 1),
        ),
        supports=Clamped("left"),
        loads=EdgeForce("right", (0, 0, 1.0)),
        scheme="ep",
        dt=1e-3,
        t_end=STEPS * 1e-3,
        output=Output(frames=STEPS + 1),
    )


def written(out: Path) -> tuple[list[int], list[object], int]:
    """Steps in the history, times in the list of frames, and files of frames."""
    series = json.loads((out / "fields" / "plate.vtu.series").read_text())["files"]
    files = len(list((out / "fields").glob("plate_*.vtu")))
    return [int(row["step"]) for row in read_history(out / HISTORY)], series, files


class Watch(BaseObserver):
    """Looks into the directory after every step, before the history and the frames of the step."""

    def __init__(self, out: Path) -> None:
        self.out = out
        self.seen: list[tuple[int, int]] = []

    def accepted(self, simulation: Simulation) -> None:
        steps, series, files = written(self.out)
        assert len(series) == files
        self.seen.append((len(steps), files))


class Fails(BaseObserver):
    """Fails in one of its calls, in the last step but one."""

    def __init__(self, where: str) -> None:
        self.where = where

    def solved(self, simulation: Simulation) -> None:
        if self.where == "solved" and simulation.step == STEPS - 2:
            raise RuntimeError("in solved")

    def accepted(self, simulation: Simulation) -> None:
        if self.where == "accepted" and simulation.step == STEPS - 1:
            raise RuntimeError("in accepted")
        if self.where == "interrupted" and simulation.step == STEPS - 1:
            raise KeyboardInterrupt

    def finish(self, simulation: Simulation, error: BaseException | None) -> None:
        if self.where == "finish":
            raise RuntimeError("in finish")


@pytest.mark.parametrize("where", ["solved", "accepted", "interrupted", "finish"])
def test_a_failing_observer_loses_nothing(tmp_path, monkeypatch, where):
    # nothing is due before the end
    monkeypatch.setattr(history, "BATCH", 1e3)
    with pytest.raises(KeyboardInterrupt if where == "interrupted" else RuntimeError):
        execute(scene(), tmp_path / "run", [Fails(where)], pictures=False)
    done = STEPS if where == "finish" else STEPS - 2
    steps, series, files = written(tmp_path / "run")
    assert steps == list(range(done + 1))
    assert len(series) == files == done + 1
    state = json.loads((tmp_path / "run" / "state" / "state.json").read_text())
    assert state["simulation"]["step"] == done
    assert state["observers"]["history"]["rows"] == done + 1
    assert len(state["observers"]["frames"]["times"]) == done + 1


@pytest.mark.parametrize("batch", [0.0, 1e3])
def test_steps_longer_than_a_batch_are_written_one_by_one(tmp_path, monkeypatch, batch):
    monkeypatch.setattr(history, "BATCH", batch)
    watch = Watch(tmp_path / "run")
    execute(scene(), tmp_path / "run", [watch], pictures=False)
    # the first state is written at once
    expected = [(k, k) for k in range(1, STEPS + 1)] if batch == 0 else [(1, 1)] * STEPS
    assert watch.seen == expected
    steps, series, files = written(tmp_path / "run")
    assert (steps, len(series), files) == ([*range(STEPS + 1)], STEPS + 1, STEPS + 1)


class Compare(BaseObserver):
    """Holds the last state against what is on disk, after every step."""

    def __init__(self, out: Path) -> None:
        self.out = out
        self.steps: list[int] = []

    def accepted(self, simulation: Simulation) -> None:
        state = json.loads((self.out / "state" / "state.json").read_text())
        steps, series, files = written(self.out)
        assert state["observers"]["history"]["rows"] == len(steps)
        assert len(state["observers"]["frames"]["times"]) == len(series) == files
        self.steps.append(state["simulation"]["step"])


def test_what_a_state_counts_on_is_written_before_it(tmp_path, monkeypatch):
    monkeypatch.setattr(history, "BATCH", 1e3)
    monkeypatch.setattr(standard, "Checkpoint", partial(Checkpoint, interval=0.0))
    compare = Compare(tmp_path / "run")
    execute(scene(), tmp_path / "run", [compare], pictures=False)
    assert compare.steps == list(range(STEPS))
