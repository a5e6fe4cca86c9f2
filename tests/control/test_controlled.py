"""Controlled motions against exact ones: of the sampled system, and of its limit in time."""

import math
from typing import Any

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import numpy as np
import pytest

from shellmb.running.execute import execute
from shellmb.running.loader import load
from shellmb.scene import (
    PID,
    Acceleration,
    Command,
    Controller,
    Driver,
    Motor,
    PointForce,
    Sensor,
    StepControl,
)

X, ANGLE = Sensor("slide.translation"), Sensor("hinge.rotation")
MASS = 2.0
# of the arm about its hinge
INERTIA = 2.0 / 3.0
KP, KI, KD = 30.0, 40.0, 8.0


def on(joint: str) -> dict[str, Any]:
    """A motor that a controller commands."""
    return {"force_elements": Motor("motor", joint, command=Command("pid"))}


def pid(sensor: Sensor, **more: Any) -> PID:
    return PID("pid", sensor, **({"target": 0.5, "kp": KP, "ki": KI, "kd": KD} | more))


def sampled(mass: float, period: float, count: int) -> np.ndarray:
    """Exact positions of a free mass under the sampled controller, by its own recursion."""
    x, v, integral, before, found = 0.0, 0.0, 0.0, None, [0.0]
    for _ in range(count):
        error = 0.5 - x
        integral += 0.0 if before is None else KI * period * (error + before) / 2
        before = error
        u = KP * error + integral - KD * v
        x, v = x + v * period + u / mass * period**2 / 2, v + u / mass * period
        found.append(x)
    return np.array(found)


def continuous(mass: float, t: np.ndarray) -> np.ndarray:
    """Exact positions under the continuous law: three exponentials."""
    # of x and the integral of the error: m s^3 + kd s^2 + kp s + ki = 0 beside the rest at 0.5
    roots = np.roots([mass, KD, KP, KI])
    # x - 0.5 is -0.5 at first, its rate 0, its acceleration 0.5 kp/m
    start = np.array([-0.5, 0.0, 0.5 * KP / mass])
    weights = np.linalg.solve(np.vander(roots, 3, increasing=True).T, start)
    return 0.5 + np.real(np.exp(np.outer(t, roots)) @ weights)


def test_sampled_slider_is_exact(slider) -> None:
    """EP integrates constant forces exactly, and in between nothing else happens."""
    period = 0.04
    run = execute(slider(controllers=pid(X, period=period), **on("slide")))
    # Newton's tolerance of 1e-9 in each of 100 steps
    assert np.allclose(run.column("slide.translation")[::4], sampled(MASS, period, 25), atol=1e-9)
    # a command is held from sample to sample: its column is what acted in the step that ends there
    command = run.column("pid.u")[1:].reshape(25, 4)
    assert np.array_equal(command, np.repeat(command[:, :1], 4, axis=1))
    assert np.array_equal(command.ravel(), run.column("motor.force")[1:])
    assert len(set(command[:, 0])) == 25
    # readings are those that it was made from
    assert np.array_equal(
        run.column("pid.slide.translation")[1::4], run.column("slide.translation")[:-1:4]
    )
    assert run.summary["energy_balance_error"] < 1e-12
    work = run.column("work_terms")[-1]
    assert work == pytest.approx(run.column("kinetic_energy")[-1], rel=1e-12)


@pytest.mark.slow
def test_short_periods_come_to_the_continuous_law(slider) -> None:
    """A command that is held is late by half a period: order one."""
    wrong = []
    for period in (0.04, 0.02, 0.01):
        run = execute(slider(controllers=pid(X, period=period), **on("slide")))
        wrong.append(np.abs(run.column("slide.translation") - continuous(MASS, run.column("t"))))
    size = [float(w.max()) for w in wrong]
    order = -np.polyfit(np.arange(3), np.log2(size), 1)[0]
    assert size[-1] < 0.01 and order == pytest.approx(1.0, abs=0.12)


ORDERS = [
    pytest.param("ep", 2, marks=pytest.mark.slow),
    pytest.param("ed", 2, marks=pytest.mark.slow),
    pytest.param("ep4", 4, marks=pytest.mark.slow),
    pytest.param("ed3", 3, marks=pytest.mark.slow),
]


@pytest.mark.parametrize(("scheme", "order"), ORDERS)
def test_sampled_arm_is_of_the_order_of_the_scheme(scheme, order, arm) -> None:
    """The period stays, the steps within it get shorter; torques are exact, rotations of order."""
    period, exact = 0.08, sampled(INERTIA, 0.08, 10)
    law = pid(ANGLE, period=period)
    wrong = []
    for count in (2, 4, 8):
        run = execute(
            arm(scheme=scheme, dt=period / count, t_end=0.8, controllers=law, **on("hinge"))
        )
        wrong.append(float(np.abs(run.column("hinge.rotation")[::count] - exact).max()))
        assert run.summary["energy_balance_error"] < 1e-10
    found = -np.polyfit(np.arange(3), np.log2(wrong), 1)[0]
    # ED comes to its order from below: its errors of second and third order are of opposite signs
    assert wrong[-1] < 2e-3 and order - (0.6 if scheme == "ed" else 0.2) < found < order + 0.7


def test_a_load_is_commanded_as_a_motor_is(slider) -> None:
    """A unit force times the command does what the motor does, and is booked as work of loads."""
    by_motor = execute(slider(controllers=pid(X, period=0.04), **on("slide")))
    force = PointForce((0, 0, 0), (1, 0, 0), time=Command("pid"))
    by_load = execute(slider(controllers=pid(X, period=0.04), loads=force))
    assert np.allclose(by_motor.column("slide.translation"), by_load.column("slide.translation"))
    assert by_load.column("work_loads")[-1] == pytest.approx(by_motor.column("work_terms")[-1])
    assert by_load.summary["energy_balance_error"] < 1e-12


def servo(t: float, readings: Any, state: Any, dt: float) -> Any:
    """Accelerates so as to be at rest at 0.3 after two more samples of 0.05 s."""
    x, v = readings
    period = 0.05
    return (0.3 - x - 1.5 * v * period) / period**2, state


def test_a_driver_is_commanded_by_its_acceleration(slider) -> None:
    """Deadbeat: a double integrator stands still at the target after two samples."""
    law = Controller("servo", (X, X.rate), servo, period=0.05)
    drive = Driver("drive", "slide", translation=Acceleration("servo"))
    run = execute(slider(t_end=0.3, controllers=law, drivers=drive))
    t, x = run.column("t"), run.column("slide.translation")
    a = 0.3 / 0.05**2
    exact = np.where(t <= 0.05, a * t**2 / 2, 0.3 - a * (0.1 - np.minimum(t, 0.1)) ** 2 / 2)
    assert np.allclose(x, exact, atol=1e-12)
    force = run.column("drive.force")[1:]
    assert np.allclose(force, np.repeat([MASS * a, -MASS * a, 0.0], [5, 5, 20]), atol=1e-6 * a)
    # what it has done is what was there in between, and nothing at the end
    assert np.allclose(run.column("work_supports"), run.column("kinetic_energy"), atol=1e-9)


@pytest.mark.slow
def test_steps_that_follow_a_tolerance_land_on_samples(arm) -> None:
    """And the motion is that of the exact sampled system, to the tolerance."""
    period = math.pi / 40
    law = pid(ANGLE, period=period)
    control = StepControl(step_error=1e-4)
    run = execute(arm(dt=1e-3, t_end=0.8, step_control=control, controllers=law, **on("hinge")))
    t = run.column("t")
    samples = period * np.arange(1, 11)
    where = np.searchsorted(t, samples - 1e-12)
    assert np.array_equal(t[where], samples)
    # several steps from sample to sample, and not the same
    assert len(t) > 25 and np.ptp(run.column("dt")[1:]) > 1e-3
    exact = sampled(INERTIA, period, 10)[1:]
    assert np.abs(run.column("hinge.rotation")[where] - exact).max() < 1e-4


def seen(t: float, readings: Any, state: Any, dt: float) -> Any:
    return readings[0], (*state, (t, dt, *readings))


def test_what_is_read_is_what_the_history_has(slider) -> None:
    """Energies, forces of joints (0 before the first step), and rates of what has no velocity."""
    sensors = (Sensor("kinetic_energy"), Sensor("slide.F2"), Sensor("kinetic_energy").rate, X.rate)
    watch = Controller("watch", sensors, seen, state=())
    push = PointForce((0, 0, 0), (3.0, 5.0, 0.0))
    run = execute(slider(t_end=0.05, loads=push, controllers=watch))
    # five samples, before each step: what they gave is the first reading
    energy = run.column("kinetic_energy")
    assert np.array_equal(run.column("watch.u")[1:], energy[:-1])
    assert np.allclose(run.column("watch.slide.F2")[1:], [0.0, *[-5.0] * 4], atol=1e-9)
    rates = np.diff(energy, prepend=0.0) / 0.01
    assert np.allclose(run.column("watch.kinetic_energy.rate")[1:], rates[:-1], rtol=1e-9)
    assert np.allclose(run.column("watch.slide.translation.rate")[1:], 1.5 * run.column("t")[:-1])


def test_a_law_is_asked_before_each_step_without_a_period(slider) -> None:
    """And told the time since it was asked last, 0 at first."""
    calls: list[tuple[float, float]] = []

    def law(t: float, readings: Any, state: int, dt: float) -> Any:
        calls.append((t, dt))
        return 0.0, state + 1

    execute(slider(t_end=0.03, controllers=Controller("count", X, law, state=0)))
    assert np.allclose(calls, [(0.0, 0.0), (0.01, 0.01), (0.02, 0.01)], atol=1e-14)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["pid_arm", "latching_panel"])
def test_flexible_demo(name) -> None:
    """CI runs the rigid ones: here the arm sags as a cantilever, and the panel swings over."""
    module = load(name)
    run = execute(module.build(), results=module.results)
    module.check(run.results)
    assert run.summary["warnings"] == []
