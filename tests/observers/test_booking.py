"""Steps that are booked together give what they give one by one, to the last bit."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from shellmb.observers import deferred
from shellmb.observers.account.energy import COLUMNS
from shellmb.observers.forces.reactions import ArmCarrier
from shellmb.running.execute import RunResult, execute
from shellmb.running.resume import resume
from shellmb.running.saved import read_saved
from shellmb.running.standard import StandardObservers
from shellmb.scene import (
    GROUND,
    Gravity,
    Output,
    Probe,
    Revolute,
    RigidBody,
    Scene,
    Solver,
    Spherical,
)
from shellmb.simulate.simulation import BaseObserver, Simulation

COUNT = deferred.STEPS + 5


def swing() -> Scene:
    """Two pendulums on one another, the first of which turns whole turns."""
    inertia = (1e-3, 4e-3, 4e-3)
    return Scene(
        "swing",
        rigid_bodies=(
            RigidBody("upper", 1.0, inertia, position=(0.1, 0, 0)),
            RigidBody("lower", 1.0, inertia, position=(0.2, 0, -0.1)),
        ),
        joints=(
            Revolute("hinge", GROUND, "upper", at=(0, 0, 0), axis=(0, 1, 0)),
            Spherical("ball", "upper", "lower", at=(0.2, 0, 0)),
        ),
        loads=Gravity((0, 2.0, -9.81)),
        probes=(
            Probe("turned", (0.1, 0, 0), "rotation", 1, body="upper"),
            Probe("far", (0.2, 0, -0.1), "position", "norm", body="lower"),
        ),
        scheme="ep",
        dt=0.01,
        t_end=COUNT * 0.01,
        output=Output(frames=2),
        # a resumed run factorises anew
        solver=Solver(newton="full"),
    )


def rows_of(result: RunResult) -> list[dict[str, float]]:
    """Rows without what clocks tell."""
    return [{k: v for k, v in row.items() if k != "wall_s"} for row in result.rows]


def observed(ask: bool) -> tuple[list[dict[str, float]], dict[str, Any], list[int]]:
    """Rows and states of a run that is asked in each step or not, and how many booked at once."""
    simulation, standard = Simulation(swing()), StandardObservers(None)
    booked: list[int] = []
    energy = standard.sources.energy
    book = energy.book_rows

    def counted(rows: slice) -> list[dict[str, float]]:
        booked.append(rows.stop - rows.start)
        return book(rows)

    energy.book_rows = counted  # type: ignore[method-assign]

    class Reader(BaseObserver):
        def accepted(self, simulation: Simulation) -> None:
            for observer in standard.named.values():
                if ask and hasattr(observer, "collect"):
                    observer.measure()

    simulation.run([*standard.named.values(), Reader()])
    rows = [{k: v for k, v in r.items() if k != "wall_s"} for r in standard.sources.history.rows]
    booking_ones = {
        n: o for n, o in standard.named.items() if isinstance(o, deferred.DeferredObserver)
    }
    return rows, {name: o.state() for name, o in booking_ones.items()}, booked


def test_rows_are_the_same_however_many_are_booked_together(monkeypatch) -> None:
    """Asked in each step, or left alone until 32 are together."""
    monkeypatch.setattr("shellmb.observers.history.BATCH", 1e9)
    alone, states, ones = observed(ask=True)
    together, others, several = observed(ask=False)
    # of numbers that are none no one equals another
    assert repr(alone) == repr(together)
    assert repr(states) == repr(others) and {"energy", "turning"} <= set(states)
    assert len(alone) == COUNT + 1
    assert set(ones) == {1} and len(ones) == COUNT
    assert max(several) == deferred.STEPS and sum(several) == COUNT
    # of a large system fewer are, as a table of all its dofs has so many numbers at most
    unknowns = len(Simulation(swing()).problem.system.numbering.local_to_global)
    monkeypatch.setattr(deferred, "NUMBERS", 7 * unknowns - 1)
    large, others, several = observed(ask=False)
    assert repr(alone) == repr(large) and repr(states) == repr(others)
    assert max(several) == 7 and sum(several) == COUNT


def test_forces_on_arms_are_the_same_however_many_steps_there_are() -> None:
    """Kind: sums over nodes, whose order NumPy takes from how the steps lie in memory."""
    rng, count, steps = np.random.default_rng(0), 25, 10
    dofs = rng.permutation(3 * count)
    body: Any = SimpleNamespace(
        name="arms",
        mixed=SimpleNamespace(dofs={"u": dofs}),
        arms=rng.normal(size=(count, 3)),
        nodes=SimpleNamespace(item=np.arange(count)),
    )
    carrier = ArmCarrier(body, slice(0, 3 * count))
    q, force = rng.normal(size=(2, steps, 3 * count))
    moments, sizes = carrier.resultants(q, 1.0, [force])
    for k in range(steps):
        one = slice(k, k + 1)
        moment, size = carrier.resultants(q[one], 1.0, [force[one]])
        assert np.array_equal(moment, moments[:, one]) and np.array_equal(size, sizes[one])
    arms = (
        body.arms + q[:, dofs].reshape(steps, count, 3),
        force[:, dofs].reshape(steps, count, 3),
    )
    # a sum of 25 products of order one
    np.testing.assert_allclose(moments[0, :, 3:], np.cross(*arms).sum(axis=1), atol=1e-12)


TOLD = (
    "energy_balance_error",
    "constraint_max",
    "director_max",
    "joints",
    "linear_momentum_drift",
    "angular_momentum_drift",
)


class Fails(BaseObserver):
    """Fails when a step is accepted, behind observers that have taken it."""

    def __init__(self, step: int) -> None:
        self._step = step

    def accepted(self, simulation: Simulation) -> None:
        """Fail in its step."""
        if simulation.step == self._step:
            raise KeyError("some other observer")


@pytest.mark.parametrize("step", [2, deferred.STEPS + 1, deferred.STEPS + 3])
def test_a_state_is_of_one_step(tmp_path: Path, step: int) -> None:
    """What failed in a step leaves the state before it, of all observers, and the run goes on."""
    with pytest.raises(KeyError):
        execute(swing(), tmp_path / "failed", [Fails(step)], pictures=False)
    straight = execute(swing(), tmp_path / "straight", [BaseObserver()], pictures=False)
    found = read_saved(tmp_path / "failed", straight.simulation.model.comm)
    assert found.simulation["step"] == step - 1
    row = straight.rows[step - 1]
    assert found.observers["energy"]["values"] == {k: row[k] for k in COLUMNS}
    freedoms = found.observers["joints"]["freedoms"]
    assert freedoms["values"] == {"hinge.rotation": row["hinge.rotation"]}
    resumed = resume(tmp_path / "failed", [BaseObserver()], scene=swing(), pictures=False)
    assert repr(rows_of(resumed)) == repr(rows_of(straight))
    for name in TOLD:
        assert resumed.summary[name] == straight.summary[name] != 0, name
    ends = [read_saved(run.out, run.simulation.model.comm).observers for run in (straight, resumed)]
    for name in ("energy", "momentum", "constraints", "turning", "probes", "joints"):
        assert ends[0][name] == ends[1][name], name


def test_copies_are_of_the_step_they_were_taken_in() -> None:
    """A copy goes into one row and leaves the others; without arrays there is nothing."""
    rng = np.random.default_rng(1)
    arrays = [np.zeros(3), np.zeros(0), np.zeros(5)]
    kept, none = deferred.copies(arrays), deferred.copies([])
    expected = np.zeros((deferred.STEPS, 8))
    for row in (4, 0, 31, 4):
        for array in arrays:
            array[:] = rng.normal(size=len(array))
        expected[row, :3], expected[row, 3:] = arrays[0], arrays[2]
        kept.take(row)
        none.take(row)
    assert np.array_equal(kept.of(slice(None)), expected)
    assert none.of(slice(None)).shape == (deferred.STEPS, 0)


def test_only_observers_with_something_to_do_are_called() -> None:
    """Idle ones are not; what somebody gives an observer in place of a method is."""
    calls: list[str] = []

    class Looks(BaseObserver):
        def __init__(self, name: str, idle: bool) -> None:
            self.name, self._will = name, idle

        def start(self, simulation: Simulation) -> None:
            self.idle = self._will

        def accepted(self, simulation: Simulation) -> None:
            calls.append(self.name)

    given = BaseObserver()
    given.solved = lambda simulation: calls.append("given")  # type: ignore[method-assign]
    scene = replace(swing(), t_end=0.02)
    Simulation(scene).run([Looks("idle", True), Looks("busy", False), BaseObserver(), given])
    assert calls == ["given", "busy"] * 2


class Squares(deferred.DeferredObserver):
    """Books the squares of what it is given."""

    given = 0.0

    def __init__(self) -> None:
        super().__init__()
        self.values = np.zeros(deferred.STEPS)

    def take_accepted(self, simulation: Any, row: int) -> None:
        self.values[row] = self.given

    def book_rows(self, rows: slice) -> list[dict[str, float]]:
        return [{"square": float(value) ** 2} for value in self.values[rows]]


def test_rows_of_a_step_that_is_taken_back_are_in_no_history() -> None:
    """An event looks behind steps, some of which are not taken: only those that are have rows."""
    squares, numbering = Squares(), SimpleNamespace(local_to_global=range(3))
    system = SimpleNamespace(numbering=numbering)
    simulation = SimpleNamespace(problem=SimpleNamespace(system=system))
    assert squares.collect(0) == []
    for taken, tried in ((1.0, 7.0), (2.0, 8.0), (3.0, 9.0)):
        kept = squares.state()
        for squares.given in (tried, -tried):
            squares.solved(simulation)
            squares.accepted(simulation)
            assert squares.measure() == {"square": tried**2}
        squares.restore(kept)
        squares.given = taken
        squares.solved(simulation)
        squares.accepted(simulation)
    assert squares.count == 3
    assert [row["square"] for row in squares.collect(9)] == [1.0, 4.0, 9.0]
