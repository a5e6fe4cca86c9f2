"""Runs that stop and go on, fail, or have two ranks."""

import json
from dataclasses import replace
from typing import Any

from mpi4py import MPI

import numpy as np
import pytest

from shellmb.api.runs import load
from shellmb.errors import ControlError, SceneError, ShellmbWarning, Stopped
from shellmb.files.writing import add_checksum
from shellmb.observers.history import read_history
from shellmb.running.execute import execute
from shellmb.running.resume import resume
from shellmb.scene import (
    PID,
    Acceleration,
    Command,
    Controller,
    Driver,
    Event,
    FromRun,
    Gravity,
    InitialVelocity,
    Lock,
    Motor,
    Off,
    PointForce,
    Scene,
    Sensor,
    Solver,
)
from shellmb.simulate.control.items import Sampler
from shellmb.simulate.simulation import BaseObserver, Simulation

ANGLE, X = Sensor("hinge.rotation"), Sensor("slide.translation")


def filtered(t: float, readings: Any, state: Any, dt: float) -> Any:
    """A law with an array and a count for a memory."""
    past, count = state
    past = np.roll(past, 1)
    past[0] = readings[0] + 0.01 * readings[1]
    return 5.0 * (1.0 - past.mean()) - readings[1], (past, count + 1)


def busy(arm: Any, **more: Any) -> Scene:
    """A sampled law, a PID at each step, a load that an event takes away, and a late lock."""
    force = PointForce((1.0, 0, 0), (0, 0, -1.0), time=Off("light"))
    law = Controller(
        "law",
        (ANGLE, Sensor("hinge.F1")),
        filtered,
        state=(np.zeros(4), 0),
        period=0.03,
    )
    pid = PID("pid", ANGLE, 1.0, 10.0, ki=5.0, kd=2.0, limits=(-5, 5), filter=0.02)
    scene: Scene = arm(
        controllers=(law, pid),
        force_elements=[
            Motor("slow", "hinge", command=Command("law")),
            Motor("fast", "hinge", command=Command("pid")),
        ],
        loads=force,
        events=Event("light", ANGLE >= 0.05),
        locks=Lock("hinge", when=(ANGLE >= 0.4) & (ANGLE.rate > 0)),
        t_end=0.4,
        # factorisations in each iteration: older ones are not kept in the state
        solver=Solver(newton="full"),
        **more,
    )
    return scene


class Stop(BaseObserver):
    """Stops behind a step."""

    def __init__(self, step: int) -> None:
        self.step = step

    def accepted(self, simulation: Simulation) -> None:
        if simulation.step == self.step:
            raise Stopped(2)


def test_a_resumed_run_is_the_uninterrupted_one_bit_for_bit(arm, tmp_path) -> None:
    """Stopped between samples, and right behind events."""
    scene = busy(arm)
    whole = execute(scene, tmp_path / "whole", pictures=False)
    events = whole.summary["events"]
    assert all(len(event["times"]) == 1 for event in events.values())
    at = [int(np.flatnonzero(whole.column(f"{name}.on"))[0]) for name in events]
    parts = tmp_path / "parts"
    with pytest.raises(Stopped):
        execute(scene, parts, [Stop(at[0])], pictures=False)
    with pytest.raises(Stopped):
        resume(parts, [Stop(at[1])], scene=scene, pictures=False)
    result = resume(parts, scene=scene, pictures=False)
    assert result.summary["events"] == events
    for row, other in zip(whole.rows, read_history(parts / "history.csv"), strict=True):
        for name, value in row.items():
            if name != "wall_s":
                assert value == other[name] or (np.isnan(value) and np.isnan(other[name])), name
    for name, array in whole.simulation.arrays().items():
        assert np.array_equal(array, result.simulation.arrays()[name])
    assert whole.summary["energy_balance_error"] < 1e-9


def fading(t: float, readings: Any, state: Any, dt: float) -> Any:
    """A servo that remembers where it has been and for how long."""
    state = state * np.exp(-5 * dt) + dt * (0.4 - readings[0])
    return 20 * state - 3 * readings[1], state


@pytest.mark.parametrize("kind", ["motors", "driver"])
def test_a_run_from_another_goes_on_with_its_controllers(kind, arm, slider, tmp_path) -> None:
    """In two parts as in one: every kind of law, and what each of them moves.

    Where the memory of a controller is not there, or is of another law, the run says so.
    """

    def scene(t_end: float, law: Any = fading, **more: Any) -> Scene:
        x, make = (ANGLE, arm) if kind == "motors" else (X, slider)
        servo = Controller("servo", (x, x.rate), law, state=0.0, period=0.02)
        pid = PID("pid", x, 0.5, 8.0, ki=20.0, kd=1.0, filter=0.02)
        if kind == "motors":
            names = ("servo", "pid")
            motors = [Motor(f"by {name}", "hinge", command=Command(name)) for name in names]
            more |= {"controllers": (servo, pid), "force_elements": motors, "loads": Gravity()}
        else:
            drive = Driver("drive", "slide", translation=Acceleration("servo"))
            more |= {"controllers": servo, "drivers": drive}
        made: Scene = make(t_end=t_end, **more)
        return made

    whole = execute(scene(0.6))
    execute(scene(0.3), tmp_path / "first", pictures=False)
    start = FromRun(str(tmp_path / "first"))
    second = execute(scene(0.3, start=start))
    assert not second.summary["warnings"]
    name = "hinge.rotation" if kind == "motors" else "slide.translation"
    there, here = whole.column(name)[30:], second.column(name)
    # not round-off: a start projects velocities of EP on the joints, which changes 3e-6
    np.testing.assert_allclose(here, there, rtol=0, atol=1e-5 * np.abs(there).max())
    assert np.ptp(there) > 0.01
    with pytest.warns(ShellmbWarning, match="controllers 'servo' begin with empty mem.* laws are"):
        Simulation(scene(0.3, lambda t, readings, state, dt: (0.0, state), start=start))
    if kind == "driver":
        return
    with pytest.warns(ShellmbWarning, match="'servo'.* begin with empty memories, because frames"):
        Simulation(scene(0.3, start=replace(start, at=0.3, velocities=False)))
    state = tmp_path / "first" / "state" / "state.json"
    saved = json.loads(state.read_text())
    saved["simulation"]["control"]["controllers"] = saved["simulation"]["control"].pop("samplers")
    state.write_text(json.dumps(add_checksum(saved)))
    with pytest.raises(SceneError, match="were saved by an older version of shellmb; run it again"):
        Simulation(scene(0.3, start=start))


@pytest.mark.slow
def test_a_run_that_an_event_has_ended_stays_ended(slider, tmp_path) -> None:
    law = Controller("servo", X, lambda t, readings, state, dt: (2.0, state), period=0.05)
    drive = Driver("drive", "slide", translation=Acceleration("servo"))
    end = Event("limit", X >= 0.09, ends=True)
    scene = slider(controllers=law, drivers=drive, events=end)
    run = execute(scene, tmp_path / "run", pictures=False)
    # a coordinate that is driven from rest: x = t^2
    assert run.summary["t"] == pytest.approx(0.3, abs=1e-6) and run.summary["failed"] is None
    again = resume(tmp_path / "run", scene=scene, pictures=False)
    assert again.summary["t"] == run.summary["t"] and again.summary["ended_by"] == "limit"
    # and one whose motors and drivers hold a command goes on with it
    parts = tmp_path / "parts"
    with pytest.raises(Stopped):
        execute(scene, parts, [Stop(13)], pictures=False)
    assert resume(parts, scene=scene, pictures=False).summary["t"] == run.summary["t"]
    read = load(tmp_path / "run")
    assert read.summary["events"]["limit"]["on"] is True
    assert "limit.on" in read.history and "servo.u" in read.history


def fails(t: float, readings: Any, state: Any, dt: float) -> Any:
    return 0.0 if t < 0.035 else 1.0 / 0.0, state


def three(t: float, readings: Any, state: Any, dt: float) -> Any:
    return (1.0, 2.0, 3.0), state


def unknown(t: float, readings: Any, state: Any, dt: float) -> Any:
    return (0.0 if t < 0.035 else np.nan), state


def alone(t: float, readings: Any, state: Any, dt: float) -> Any:
    return 1.0


def words(t: float, readings: Any, state: Any, dt: float) -> Any:
    return "full speed", state


def opened(t: float, readings: Any, state: Any, dt: float) -> Any:
    return 1.0, {"file": object()}


FAILURES = {
    fails: (r"'law' at t = 0.04: its law fails \(test_runs.py, line \d+: ZeroDivisionError: ", 4),
    three: (r"controller 'law' at t = 0: its law gives 3 outputs; it must give 1: u", 0),
    unknown: (r"at t = 0.04: its output 'u' is nan, where slide.translation = 0.04;", 4),
    alone: (r"its law gives 1.0; it must give outputs, state", 0),
    words: (r"its outputs are 'full speed'; they must be numbers", 0),
    opened: (r"its state holds <object object at .*, which cannot be saved; it must be made of", 0),
}


@pytest.mark.parametrize("law", FAILURES)
def test_a_law_that_fails_is_named(law) -> None:
    said, steps = FAILURES[law]
    sampler = Sampler(Controller("law", X, law))
    with pytest.raises(ControlError, match=said):
        for k in range(steps + 1):
            sampler.ask(0.01 * k, {"slide.translation": 0.01 * k}, MPI.COMM_SELF)
    assert sampler.state()["count"] == steps


def test_a_run_that_fails_leaves_what_was_computed(slider, tmp_path) -> None:
    said, steps = FAILURES[unknown]
    motor = Motor("motor", "slide", command=Command("law"))
    glide = InitialVelocity(linear=(1.0, 0, 0))
    scene = slider(controllers=Controller("law", X, unknown), force_elements=motor, initial=glide)
    with pytest.raises(ControlError, match=f"{said}.*the last good state is in"):
        execute(scene, tmp_path / "run", pictures=False)
    assert len(read_history(tmp_path / "run" / "history.csv")) == steps + 1
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert summary["steps"] == steps and "controller 'law'" in summary["failed"]
    assert (tmp_path / "run" / "state" / "state.json").exists()


PROGRAM = """
import json, sys
sys.path.insert(0, sys.argv[1])
from mpi4py import MPI
from conftest import make_arm
from test_runs import busy
from shellmb.running.execute import execute
run = execute(busy(make_arm), sys.argv[2], pictures=False)
found = {name: list(run.column(name)) for name in ("t", "hinge.rotation", "pid.u", "law.u")}
every = MPI.COMM_WORLD.gather(found)
if MPI.COMM_WORLD.rank == 0:
    # all ranks have the same numbers, to the last bit
    assert all(one == every[0] for one in every)
    found["events"] = run.summary["events"]
    found["balance"] = run.summary["energy_balance_error"]
    with open(sys.argv[3], "w") as file:
        json.dump(found, file)
"""


@pytest.mark.slow
def test_two_ranks_do_what_one_does(arm, mpirun, tmp_path) -> None:
    file = tmp_path / "found.json"
    mpirun(2, "-c", PROGRAM, __file__.rpartition("/")[0], tmp_path / "two", file)
    two = json.loads(file.read_text())
    one = execute(busy(arm))
    for name in ("t", "hinge.rotation", "pid.u", "law.u"):
        # Newton's tolerance, in a command times its gains
        assert np.allclose(one.column(name), two[name], rtol=1e-7, atol=1e-7)
    for name, event in one.summary["events"].items():
        assert np.allclose(event["times"], two["events"][name]["times"], atol=2e-7)
    assert two["balance"] < 1e-9
