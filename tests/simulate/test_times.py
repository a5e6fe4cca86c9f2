"""Times of steps: counted, not summed; where they land; and no step that is a rest of round-off."""

from collections.abc import Iterator
from typing import Any

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import numpy as np
import pytest

from shellmb.errors import ConvergenceError
from shellmb.running.execute import execute
from shellmb.scene import (
    GROUND,
    Command,
    Controller,
    Gravity,
    Lock,
    Motor,
    Revolute,
    RigidBody,
    Scene,
    Sensor,
    StepControl,
)
from shellmb.simulate.simulation import BaseObserver, Simulation
from shellmb.simulate.stepping import StepInfo
from shellmb.simulate.stepsize import LEAST, SHORT

# numbers of steps and lengths as users write them down
STEPS = ((12_000, 1e-3), (20_000, 5e-3), (37_777, 1 / 3e3), (50_000, 2e-4), (16_001, 0.7e-3))
STEPS += ((30_000, 0.01), (14_400, 1 / 240))
MASS, RADIUS, INERTIA, G = 0.3, 0.2, 1e-3, 9.81


def pendulum(dt: float, t_end: float, **more: Any) -> Scene:
    """A body on a hinge."""
    given = {
        "rigid_bodies": RigidBody("p", MASS, (INERTIA,) * 3, com=(RADIUS, 0, 0)),
        "joints": Revolute("h", GROUND, "p", at=(0, 0, 0), axis=(0, 1, 0)),
        "loads": Gravity((0, 0, -G)),
        "scheme": "ep",
    }
    return Scene("pendulum", dt=dt, t_end=t_end, **given | more)


class Still:
    """A solution that costs nothing: the state stays as it is; some steps fail.

    Args:
        fails: Numbers of attempts that fail.
    """

    finished = False

    def __init__(self, fails: tuple[int, ...] = ()) -> None:
        self.fails, self.count = fails, 0

    def attempt(self, t: float, dt: float) -> StepInfo:
        self.count += 1
        if self.count in self.fails:
            raise ConvergenceError("not this one", field=None, norms={})
        return StepInfo(t, dt, 1, 1e-9)

    def accept(self, dt: float) -> None: ...

    def forget(self, velocities: bool) -> None: ...

    def state(self) -> None: ...

    def restore(self, state: Any) -> None: ...


class Times(BaseObserver):
    """Ends of accepted steps, and their lengths."""

    def __init__(self) -> None:
        self.t: list[float] = []
        self.dt: list[float] = []

    def accepted(self, simulation: Simulation) -> None:
        assert simulation.last is not None
        self.t.append(simulation.t)
        self.dt.append(simulation.last.dt)


class Clockwork:
    """The loop of simulations without their equations.

    Args:
        model: What the scenes have in common.
    """

    def __init__(self, **model: Any) -> None:
        self.model = model

    def made(self, dt: float, t_end: float, fails: tuple[int, ...] = (), **more: Any) -> Simulation:
        """A simulation before its first step."""
        simulation = Simulation(pendulum(dt, t_end, **self.model, **more))
        simulation.stepping = Still(fails)
        return simulation

    def run(self, dt: float, t_end: float, fails: tuple[int, ...] = (), **more: Any) -> Times:
        """Times of a run."""
        simulation, times = self.made(dt, t_end, fails, **more), Times()
        simulation.run([times])
        assert simulation.t == t_end
        # what a step integrates is what the clock shows
        steps = np.diff([0.0, *times.t])
        np.testing.assert_allclose(steps, times.dt, rtol=0, atol=1e-15 * t_end)
        return times


@pytest.fixture(scope="module")
def clockwork() -> Iterator[Clockwork]:
    yield Clockwork()


@pytest.mark.parametrize("number, dt", STEPS)
def test_equal_steps_are_counted(number, dt, clockwork) -> None:
    """As many steps as there are, of one length, at `k dt` to the last bit."""
    times = clockwork.run(dt, number * dt)
    assert times.t == (np.arange(1, number + 1) * dt).tolist()
    assert set(times.dt) == {dt}
    # the end as it is written down
    times = clockwork.run(dt, round(500 * dt, 9))
    assert len(times.t) == 500
    np.testing.assert_allclose(times.dt, dt, rtol=1e-6)


@pytest.mark.parametrize("rest", (1e-15, 1e-11, 1e-8, 1e-5, 1e-3, 0.05, 0.09, 0.2, 0.7, 1 - 1e-9))
def test_a_rest_is_shared_where_it_is_short(rest, clockwork) -> None:
    dt = 1 / 3e3
    times = clockwork.run(dt, (600 + rest) * dt)
    assert max(times.dt) <= dt * (1 + 1e-6) and min(times.dt) > min(rest, 0.5) * dt
    assert min(times.dt) >= SHORT * dt and len(times.t) == (601 if rest > 1e-6 else 600)
    assert set(times.dt[:599]) == {dt}


@pytest.mark.parametrize("dt", (5e-3, 0.7e-3, 1 / 240))
def test_times_that_are_one(dt, clockwork) -> None:
    """Times of steps as they are computed in one way and another, samples among them, and the end.

    Windows of locks are the same as `times`, by `Landing`.
    """
    sample = Controller(
        "c",
        Sensor("h.rotation", derivative=True),
        law=lambda t, x, s, since: (0.0, s),
        period=3 * dt,
    )
    motor = Motor("m", "h", command=Command("c"))
    ends = [n * dt for n in (3, 7, 120, 300, 301, 600)]
    written = [(t, t * (1 + 3e-16), float(f"{t:.12g}"), t + 1e-9 * dt) for t in ends]
    last = 600 * dt
    control = StepControl(times=sorted({t for times in written for t in times if t <= last}))
    held = Lock("h", active=(6 * dt * (1 - 2e-16), 8.0 * dt))
    for more in ({}, {"controllers": sample, "force_elements": motor, "locks": held}):
        made = clockwork if not more else Clockwork(**more)
        times = made.run(dt, last, step_control=control)
        assert len(times.t) == 600
        np.testing.assert_allclose(times.dt, dt, rtol=1e-6)


def test_steps_that_fail_are_halved_and_counted_again(clockwork) -> None:
    dt, end = 1e-3, 15.0
    fails = (40, 41, 5_000, 12_003, 14_999)
    times = clockwork.run(dt, end, fails, step_control=StepControl(times=(3.0, 7.7003)))
    steps = np.array(times.dt)
    assert {3.0, 7.7003} <= set(times.t)
    assert min(steps) >= LEAST * dt and np.mean(steps < 0.99 * dt) < 5e-3
    # a short rest before a time is shared
    assert np.all(steps > 0.09 * dt)


def test_steps_that_follow_an_error_leave_no_rest(clockwork) -> None:
    """Any number of times at which they end, and an error that nothing has."""
    ends = (0.01, 0.0100000000001, 0.3, 3 * 0.1, 0.30000001, 2.0, 2.0004)
    control = StepControl(step_error=1e-3, times=sorted(set(ends)))
    times = clockwork.run(0.01, 3.0, step_control=control)
    assert {0.0100000000001, 2.0, 2.0004} <= set(times.t)
    assert min(times.dt) > 1e-4


def test_a_run_that_is_taken_up_goes_on_counting(clockwork) -> None:
    """In the middle, behind a step that failed, the times are those of the whole run."""
    dt, end, first, second = 1 / 3e3, 3.0, Times(), Times()
    whole = clockwork.run(dt, end, fails=(50,))
    simulation = clockwork.made(dt, end, (50,))
    for _ in range(7_000):
        simulation.advance([first])
    saved = simulation.arrays(), simulation.state()
    simulation = clockwork.made(dt, end)
    simulation.restore(*saved)
    simulation.run([second])
    assert first.t + second.t == whole.t


@pytest.mark.parametrize("scheme", ("ep", "ep4", "ed", "ed3"))
@pytest.mark.parametrize("rest", (3e-12, 2e-5, 0.04))
def test_forces_stay_where_a_step_has_to_end(scheme, rest) -> None:
    """Of a pendulum, whose energy tells the forces at any angle; a time is a rest behind a step."""
    dt, number = 2e-3, 40
    control = StepControl(times=((20 + rest) * dt,))
    alpha = 0.1 if scheme in ("ed", "ed3") else None
    end = (number + 2 * rest) * dt
    run = execute(pendulum(dt, end, scheme=scheme, alpha=alpha, step_control=control))
    angle, whole = run.column("h.rotation"), INERTIA + MASS * RADIUS**2
    angle = (angle[1:] + angle[:-1]) / 2
    along = MASS * G * np.sin(angle) * (1 + 2 * MASS * RADIUS**2 / whole)
    across = MASS * G * np.cos(angle) * INERTIA / whole
    found = np.linalg.norm([run.column(f"h.F{k}")[1:] for k in (1, 2, 3)], axis=0)
    # of the second order in the step; EP and ED take up steps of another length with oscillations
    off = 2e-2 if scheme in ("ep", "ed") and rest > 1e-6 else 1e-3
    np.testing.assert_allclose(found, np.hypot(along, across), rtol=off)
