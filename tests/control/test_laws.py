"""Sensors, conditions and the laws of controllers by themselves: plain Python."""

import math

import numpy as np
import pytest

from shellmb.errors import SceneError
from shellmb.scene import PID, Controller, Event, Lock, Motor, Sensor
from shellmb.simulate.control.items import first_crossing, packed, unpacked

X = Sensor("slide.translation")


def read(sensor: Sensor) -> float:
    return -3.0 if sensor.derivative else 2.0


@pytest.mark.parametrize(
    ("condition", "margin"),
    [
        (X >= 1.5, 0.5),
        (X <= 1.5, -0.5),
        (X.rate < 0, 3.0),
        (1.5 <= X, 0.5),
        (2 * X - X.rate / 3 + 1 > 0, 6.0),
        (abs(-X - 1) >= (lambda t: 10 * t), 1.0),
        ((X >= 1.5) & (X.rate >= 0), -3.0),
        ((X >= 1.5) | (X.rate >= 0), 0.5),
        (X >= 2.0, 0.0),
    ],
)
def test_margins_of_conditions(condition, margin) -> None:
    assert condition.margin(read, 0.2) == pytest.approx(margin, abs=1e-14)


def test_a_strict_comparison_is_not_true_of_equals() -> None:
    assert (X > 2.0).margin(read, 0.0) < 0 and (X < 2.0).margin(read, 0.0) < 0
    assert (X >= 2.0).margin(read, 0.0) == 0 and (X <= 2.0).margin(read, 0.0) == 0


def law(t, readings, state, dt):
    return 0.0, state


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: 0 <= X <= 1, "joined by & or |"),
        (lambda: X >= "1", "'1': a sensor can be compared and calculated with a number"),
        (lambda: X.rate.rate, "it is a rate already"),
        (lambda: Event("e", True), "event 'e': when is True; it must be a condition"),
        (lambda: Lock("j"), "of active and conditions (when, until) none is given"),
        (lambda: Lock("j", (0, 1), when=X > 1), "both are given"),
        (lambda: Lock("j", when="e", until=X > 1), "it must be the event's"),
        (lambda: Motor("m", "j"), "of law and command neither is given"),
        (lambda: PID("p", X, 1.0, 1.0, limits=(1, -1)), "the first must be less"),
        (lambda: PID("p", X, 1.0, 1.0, period=0.0), "period is 0.0; it must be greater than 0"),
        (lambda: Controller("c", X, law, outputs=("a", "a")), "one name at least, each once"),
        (lambda: Controller("c", "x", law), "sensors"),
    ],
)
def test_what_makes_no_sense_is_refused(make, said) -> None:
    with pytest.raises(SceneError) as error:
        make()
    assert said in str(error.value)


def test_a_state_stays_as_it_is_given_and_survives_being_saved() -> None:
    given = {"x": np.arange(6.0).reshape(2, 3), "n": (1, None, [True, "a"]), "s": np.float64(0.1)}
    controller = Controller("c", X, law, state=given)
    assert controller.state is given
    kept = unpacked(packed(given))
    assert isinstance(kept["x"], np.ndarray) and np.array_equal(kept["x"], given["x"])
    assert kept["n"] == given["n"] and kept["s"] == given["s"]
    empty = unpacked(packed(np.zeros((0, 3))))
    assert empty.shape == (0, 3)


def held(pid: PID, readings: list[list[float]], dt: float) -> list[float]:
    """Outputs of a controller for a series of readings."""
    state, found = None, []
    for k, row in enumerate(readings):
        output, state = pid.act(k * dt, np.array(row), state, 0.0 if k == 0 else dt)
        found.append(output)
    return found


def test_pid_of_a_sine_in_the_limit_of_short_periods() -> None:
    """Gain and phase of the law: kp e + ki int e + kd e'; trapezoids are of second order."""
    pid = PID("p", X, 0.0, 2.0, 3.0, 0.5)
    wrong = []
    for n in (100, 200):
        t = np.linspace(0.0, 2.0, n + 1)
        e = -np.sin(t)
        exact = 2.0 * e + 3.0 * (np.cos(t) - 1) - 0.5 * np.cos(t)
        found = held(pid, np.column_stack([np.sin(t), np.cos(t)]).tolist(), t[1])
        wrong.append(np.abs(found - exact).max())
    assert wrong[1] < 1e-4 and wrong[0] / wrong[1] == pytest.approx(4.0, rel=0.01)


def test_filter_of_the_derivative_is_a_lag_of_first_order() -> None:
    """A rate that jumps at the second sample comes through as 1 - exp(-t/T)."""
    dt, lag = 1e-4, 0.1
    rates = [0.0] + [-1.0] * 4000
    found = held(PID("p", X, 0.0, 0.0, kd=1.0, filter=lag), [[0.0, r] for r in rates], dt)
    t = dt * np.arange(len(rates))
    # backward Euler: half a period late
    assert np.allclose(found, 1 - np.exp(-t / lag), atol=dt / lag)


def test_integral_waits_where_a_limit_holds() -> None:
    """With anti-windup the output leaves the limit when the error changes its sign, or before."""
    pid = PID("p", X, 1.0, 1.0, ki=10.0, limits=(-2.0, 2.0))
    readings = [[-4.0]] * 100 + [[3.0]] * 2
    found = held(pid, readings, 0.1)
    assert found[:100] == [2.0] * 100
    # a wound-up integral of 500 would hold it at the limit for long
    assert found[100] < 0 and found[101] < 0
    wound = held(PID("p", X, 1.0, 1.0, ki=10.0), readings, 0.1)
    assert wound[100] > 400


@pytest.mark.parametrize("tolerance", [1e-3, 1e-9])
@pytest.mark.parametrize(
    "margin",
    [
        lambda s: np.array([s - 0.3]),
        lambda s: np.array([s**7 - 0.3**7, s - 0.9]),
        lambda s: np.array([math.sin(5 * min(s, 0.31)) - math.sin(1.5), -1.0]),
        lambda s: np.array([-1.0 if s < 0.3 else 1e6]),
        lambda s: np.array([(s - 0.3) ** 9, s - 0.3]),
    ],
)
def test_first_crossing_to_the_tolerance(margin, tolerance) -> None:
    calls = []

    def counted(s: float) -> np.ndarray:
        calls.append(s)
        return margin(s)

    where, behind = first_crossing(counted, margin(0.0), margin(1.0), 1.0, tolerance)
    assert np.any(behind >= 0) and 0 <= where - 0.3 <= tolerance + 1e-15
    assert len(calls) <= 120


def test_first_crossing_of_straight_margins_takes_two_points() -> None:
    calls = []

    def margin(s: float) -> np.ndarray:
        calls.append(s)
        return np.array([s - 0.3, 5 * s - 4.0])

    first_crossing(margin, np.array([-0.3, -4.0]), np.array([0.7, 1.0]), 1.0, 1e-6)
    assert len(calls) <= 3


@pytest.mark.parametrize("lag", [0.0, 0.2])
def test_pid_follows_a_target_that_moves(lag: float) -> None:
    """The rate of the error is that of the target less that of the sensor, each by itself.

    A target that rises steadily and a sensor that stays: `kd` acts on the slope of the target from
    the second sample on, through the filter; a sensor that keeps up leaves nothing at all.
    """
    dt, slope, kd = 0.01, 3.0, 0.5
    pid = PID("p", X, lambda t: slope * t, 0.0, kd=kd, filter=lag)
    still = np.array(held(pid, [[0.0, 0.0]] * 200, dt))
    t = dt * np.arange(200)
    comes = 1.0 if lag == 0 else 1 - (lag / (lag + dt)) ** np.arange(200)
    assert np.allclose(still, np.where(t > 0, kd * slope * comes, 0.0), rtol=0, atol=1e-12)
    follows = held(
        PID("p", X, lambda t: slope * t, 2.0, 5.0, kd), [[x, slope] for x in slope * t], dt
    )
    # before there was a second sample the rate of the target is not known
    assert follows[0] == pytest.approx(-kd * slope) and np.allclose(follows[1:], 0, atol=1e-12)


def test_pid_of_a_target_on_a_sine() -> None:
    """All terms of `e = sin 2t - sin t`; the rate of the target is half a sample late."""
    wrong = []
    for n in (400, 800):
        t = np.linspace(0.0, 2.0, n + 1)
        pid = PID("p", X, lambda s: np.sin(2 * s), 2.0, 3.0, 0.5)
        exact = 2.0 * (np.sin(2 * t) - np.sin(t)) + 0.5 * (2 * np.cos(2 * t) - np.cos(t))
        exact += 3.0 * ((1 - np.cos(2 * t)) / 2 - 1 + np.cos(t))
        found = held(pid, np.column_stack([np.sin(t), np.cos(t)]).tolist(), t[1])
        wrong.append(np.abs(found - exact)[1:].max())
    assert wrong[1] < 6e-3 and wrong[0] / wrong[1] == pytest.approx(2.0, rel=0.02)
