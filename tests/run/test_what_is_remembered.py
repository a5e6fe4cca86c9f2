"""A run that stops and goes on says at its end what it says uninterrupted: the worst is no news.

The kind: a number that is the largest, or a sum, over all steps, and what is armed or has gone off.
All that is worst comes before the stop, so that what is forgotten is missed.
"""

import json
from typing import Any

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import numpy as np
import pytest

import shellmb.running.execute as executing
from shellmb.errors import Stopped
from shellmb.running.execute import RunResult, execute
from shellmb.running.resume import resume
from shellmb.running.standard import StandardObservers
from shellmb.scene import (
    GROUND,
    Clamped,
    Contact,
    Event,
    InitialVelocity,
    Isotropic,
    JointDamper,
    Plane,
    Rectangle,
    Revolute,
    RigidBody,
    Scene,
    Sensor,
    Shell,
    Solver,
    StepControl,
)
from shellmb.simulate.simulation import BaseObserver, Simulation

FULL = Solver(newton="full")
INERTIA = (0.1, 0.2, 0.3)
BALL = RigidBody("ball", 1.0, INERTIA, position=(5, 0, 0.11))
DOOR = RigidBody("door", 1.0, INERTIA, position=(0.5, 0, 0))
FLOOR = Contact("floor", Plane(), 1e5, body="ball", radius=0.1)
HINGE = Revolute("hinge", GROUND, "door", at=(0, 0, 0), axis=(0, 0, 1))
OPEN = Event("open", Sensor("hinge.rotation") >= 0.2)
STARTS = (
    InitialVelocity(linear=(0, 0, -1.0), spin=(0.5, 0, 0), about=(5, 0, 0.11), body="ball"),
    InitialVelocity(spin=(0, 0, 40.0), body="door"),
)


def rigid(**more: Any) -> Scene:
    """A ball whose only impact is over in three steps, and a door that a damper slows down."""
    return Scene(
        "rigid",
        rigid_bodies=(BALL, DOOR),
        joints=HINGE,
        force_elements=JointDamper("damper", "hinge", 10.0),
        contacts=FLOOR,
        initial=STARTS,
        solver=FULL,
        **{"events": OPEN, "scheme": "ed", "alpha": 1.0, "dt": 0.02, "t_end": 0.4} | more,
    )


def strip(model: str, **more: Any) -> Scene:
    """A damped cantilever that is hit: its first swing is the farthest."""
    section = Isotropic(E=1.0, nu=0.3, thickness=0.2, density=1.0, mass_damping=0.2)
    shell = Shell("strip", Rectangle(1.0, 0.5), section, mesh=(2, 1), model=model)
    return Scene(
        "strip",
        shell,
        supports=Clamped("left"),
        initial=InitialVelocity(linear=(0, 0, 0.4)),
        solver=FULL,
        **{"scheme": "ep", "dt": 1.0, "t_end": 24.0} | more,
    )


def blade() -> Scene:
    """A stiff plate that spins fast under ED, and slows down."""
    section = Isotropic(E=1e6, nu=0.3, thickness=0.2, density=1.0, mass_damping=0.4)
    shell = Shell("strip", Rectangle(1.0, 0.5), section, mesh=(2, 1))
    spin = InitialVelocity(spin=(0, 0, 0.4), about=(0.5, 0.25, 0))
    return Scene("blade", shell, initial=spin, scheme="ed", dt=1.0, t_end=12.0, solver=FULL)


# with the number of the step to stop in (the state is of the step before), and watches that must
# have something to say
SCENES: dict[str, tuple[Scene, int, set[str]]] = {
    "rigid": (rigid(), 11, {"contact", "angular momentum"}),
    "tolerance": (
        rigid(
            scheme="ed3", alpha=0.5, dt=0.01, t_end=0.2, step_control=StepControl(step_error=1e-3)
        ),
        12,
        {"contact"},
    ),
    "linear scheme": (strip("exact", scheme="linear-dynamics"), 12, {"small displacements"}),
    "linear body": (strip("floating-frame"), 12, {"linear bodies"}),
    "bent": (strip("exact"), 12, {"folded"}),
    "stiff": (blade(), 6, {"stiff spin"}),
}


class Unchanged(BaseObserver):
    """Sees that what a state was made of is its own: a step that fails comes after it."""

    def __init__(self, observed: list[StandardObservers]) -> None:
        self._observed, self._before = observed, list[tuple[str, Any, str]]()

    def accepted(self, simulation: Simulation) -> None:
        for name, state, text in self._before:
            assert json.dumps(plain(state)) == text, name
        states = {n: o.state() for n, o in self._observed[-1].named.items()}
        states["simulation"] = simulation.state()
        self._before = [(n, state, json.dumps(plain(state))) for n, state in states.items()]


class Stop(BaseObserver):
    """Stops behind a step."""

    def __init__(self, step: int) -> None:
        self.step = step

    def accepted(self, simulation: Simulation) -> None:
        if simulation.step == self.step:
            raise Stopped(2)


@pytest.fixture
def observed(monkeypatch: pytest.MonkeyPatch) -> list[StandardObservers]:
    """The observers of all runs, in their order."""
    found: list[StandardObservers] = []

    class Kept(StandardObservers):
        def __init__(self, *given: Any, **options: Any) -> None:
            super().__init__(*given, **options)
            found.append(self)

    monkeypatch.setattr(executing, "StandardObservers", Kept)
    return found


def said(run: RunResult) -> dict[str, Any]:
    """The summary, without what depends on the clock and on the folder."""
    return {k: v for k, v in run.summary.items() if k not in {"jit_s"} and not k.endswith("_s")}


def plain(value: Any) -> Any:
    """Numbers, texts, and what is made of them; None where there is something else."""
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, dict):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if value is None or isinstance(value, bool | int | float | str):
        return repr(value)
    return plain(vars(value)) if type(value).__name__ == "Turn" else None


# the state with the largest energy since the run went on: `LinearBodies` scales what it has
NEWS = {"_shapes"}
# of accounts, the steps since then, and room for what they leave
ROOM = {"count", "mark", "_reactions", "_found"}


@pytest.mark.parametrize("name", SCENES)
def test_a_run_that_went_on_says_what_the_whole_run_says(name, observed, tmp_path) -> None:
    scene, stop, watches = SCENES[name]
    whole = execute(scene, tmp_path / "whole", [Unchanged(observed)], pictures=False)
    assert whole.simulation.step > stop
    assert {c.watch for c in whole.warnings} >= watches, [c.says for c in whole.warnings]
    parts = tmp_path / "parts"
    with pytest.raises(Stopped):
        execute(scene, parts, [Stop(stop)], pictures=False)
    result = resume(parts, scene=scene, pictures=False)
    assert said(result) == said(whole)
    kept = json.loads((parts / "summary.json").read_text())
    assert kept["warnings"] == [c.to_dict() for c in whole.warnings]
    first, _, last = observed
    for key in ("energy", "constraints", "momentum", "turning", *last.named):
        if key in ("history", "frames", "checkpoint", "stop") or key.startswith("observer"):
            continue
        one, other = first.named[key], last.named[key]
        assert json.dumps(plain(one.state())) == json.dumps(plain(other.state())), key
        news = NEWS if key.startswith("watch") else ROOM
        if news is NEWS or key in ("constraints", "energy"):
            now, then = ({k: plain(v) for k, v in vars(o).items()} for o in (other, one))
            assert {k for k in then if now[k] != then[k]} <= news, key


class Violated(Stop):
    """Has constraints violated before it stops, by more than round-off does later."""

    def __init__(self, behind: int, observed: list[StandardObservers]) -> None:
        super().__init__(behind)
        self._observed = observed

    def accepted(self, simulation: Simulation) -> None:
        if simulation.step == 2:
            account = self._observed[-1].named["constraints"]
            account._director_max, account._constraint_max = 0.5, 1.0
        super().accepted(simulation)


def test_the_largest_violations_are_remembered(observed, tmp_path) -> None:
    scene, stop, _ = SCENES["rigid"]
    with pytest.raises(Stopped):
        execute(scene, tmp_path / "parts", [Violated(stop, observed)], pictures=False)
    summary = resume(tmp_path / "parts", scene=scene, pictures=False).summary
    assert (summary["director_max"], summary["constraint_max"]) == (0.5, 1.0)


def test_events_stay_as_they_were(tmp_path) -> None:
    """What has gone on, and would go off by what was true already then, waits for it to change."""
    scene = rigid(
        events=(
            Event("once", Sensor("hinge.rotation") >= 0.2),
            Event("back", Sensor("hinge.rotation") >= 0.3, until=Sensor("hinge.rotation") >= 0.1),
        )
    )
    whole = execute(scene, tmp_path / "whole", pictures=False)
    events = whole.simulation.control.watches
    assert [len(event.times) for event in events] == [1, 1]
    with pytest.raises(Stopped):
        execute(scene, tmp_path / "parts", [Stop(12)], pictures=False)
    result = resume(tmp_path / "parts", scene=scene, pictures=False)
    found = [(event.state(), event.windows) for event in result.simulation.control.watches]
    assert found == [(event.state(), event.windows) for event in events]
    assert result.summary["events"] == whole.summary["events"]


class Refuses(BaseObserver):
    """Stops in the first step."""

    def solved(self, simulation: Simulation) -> None:
        raise Stopped(2)


def test_a_run_that_stops_in_its_first_step_begins_there(tmp_path) -> None:
    """Kind: sizes of steps that are infinite as long as there is no step."""
    scene, _, _ = SCENES["tolerance"]
    with pytest.raises(Stopped):
        execute(scene, tmp_path / "parts", [Refuses()], pictures=False)
    resumed = resume(tmp_path / "parts", scene=scene, pictures=False)
    assert said(resumed) == said(execute(scene, tmp_path / "whole", pictures=False))
