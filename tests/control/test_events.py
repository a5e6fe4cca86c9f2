"""Events: when they are found, in which order, and what they switch."""

import math
from typing import Any

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import numpy as np
import pytest

from shellmb.errors import ControlError, SceneError
from shellmb.running.execute import execute
from shellmb.scene import (
    Event,
    Gravity,
    InitialVelocity,
    JointSpring,
    Lock,
    Off,
    On,
    PointForce,
    PointMoment,
    Scene,
    Sensor,
    StepControl,
)
from shellmb.simulate.control.items import turning_point

X, ANGLE = Sensor("slide.translation"), Sensor("hinge.rotation")
MASS = 2.0
SPEED = 0.7
GLIDE = {"initial": InitialVelocity(linear=(SPEED, 0, 0))}


def times(run: Any, event: str) -> list[float]:
    """When an event went on, off, on, ..."""
    found: list[float] = run.summary["events"][event]["times"]
    return found


@pytest.mark.parametrize(
    "tolerance", [None, *(pytest.param(t, marks=pytest.mark.slow) for t in (1e-4, 1e-10))]
)
def test_an_event_is_found_to_its_tolerance(tolerance, slider) -> None:
    """A mass at a constant speed, which EP moves exactly; never before the condition is true."""
    end = Event("there", X >= 0.2345, ends=True, tolerance=tolerance)
    run = execute(slider(events=end, **GLIDE))
    exact = 0.2345 / SPEED
    (found,) = times(run, "there")
    # round-off of Newton's method, over the speed
    assert -1e-12 <= found - exact <= (tolerance or 1e-7) + 1e-12
    assert run.rows[-1]["t"] == found == run.summary["t"] and run.summary["ended_by"] == "there"
    assert run.rows[-1]["there.on"] == 1.0 and run.rows[-2]["there.on"] == 0.0
    assert run.rows[-1]["slide.translation"] >= 0.2345
    assert run.summary["failed"] is None


def test_several_events_in_a_step_are_found_in_their_order(slider) -> None:
    places = {"c": 0.0237, "a": 0.0219, "d": 0.0279, "b": 0.0226}
    events = [Event(name, X >= place) for name, place in places.items()]
    run = execute(slider(events=[*events, Event("no", X > 9)], t_end=0.1, **GLIDE))
    for name, place in places.items():
        (found,) = times(run, name)
        assert 0.03 < found < 0.04
        assert 0 <= found - place / SPEED + 1e-12 <= 1.1e-7
    assert times(run, "no") == []
    t = run.column("t")
    # three steps, four that end with an event, and seven to the end
    assert np.all(np.diff(t) > 0) and len(t) == 1 + 3 + 4 + 7
    assert run.summary["energy_balance_error"] < 1e-9


def test_events_at_the_ends_of_steps(slider) -> None:
    """Found there, with no step much shorter than the tolerance, and nothing twice."""
    just = 1e-11
    events = [
        Event("end", X >= SPEED * 0.02),
        Event("before", X >= SPEED * (0.04 - just)),
        Event("after", X >= SPEED * (0.06 + just)),
    ]
    run = execute(slider(events=events, t_end=0.1, **GLIDE))
    for name, exact in (("end", 0.02), ("before", 0.04), ("after", 0.06)):
        (found,) = times(run, name)
        assert abs(found - exact) <= 1.1e-7
    assert np.diff(run.column("t")).min() > 0.9e-7
    # round-off of positions of 1e-17 over a step of 1e-7 s is one of velocities
    assert run.summary["energy_balance_error"] < 1e-9
    assert run.column("slide.translation")[-1] == pytest.approx(SPEED * 0.1, rel=1e-10)


def test_a_condition_that_is_true_at_the_start(slider) -> None:
    """It counts at once; a run that would end before its first step is refused."""
    run = execute(slider(locks=Lock("slide", when=X >= 0), t_end=0.05, **GLIDE))
    assert times(run, "slide lock") == [0.0]
    assert np.abs(run.column("slide.translation")).max() < 1e-14
    # the impact takes all
    assert run.column("dissipation")[-1] == pytest.approx(MASS * SPEED**2 / 2)
    with pytest.raises(SceneError, match="event 'end': it is true at the start"):
        execute(slider(events=Event("end", X >= 0, ends=True), t_end=0.05, **GLIDE))
    moved = execute(slider(events=Event("end", X > 0, ends=True), t_end=0.05, **GLIDE))
    assert moved.summary["ended_by"] == "end"


def test_a_force_that_turns_back_and_forth(slider) -> None:
    """A relay with hysteresis: parabolas in time, whose ends are known in closed form."""
    relay = Event("relay", X >= 0.1, until=X <= -0.1)
    force = 40.0
    loads = [
        PointForce((0, 0, 0), (force, 0, 0), time=Off("relay")),
        PointForce((0, 0, 0), (-force, 0, 0), time=On("relay")),
    ]
    run = execute(slider(events=relay, loads=loads, t_end=2.0))
    # each way from rest or with the speed it has: x' grows by what is put in between the ends
    a, t, x, v, exact = force / MASS, 0.0, 0.0, 0.0, []
    for side in (1, -1, 1, -1, 1):
        # from x with velocity v under side*a until x = side*0.1
        way = side * (side * 0.1 - x)
        speed = side * v
        after = math.sqrt(speed**2 + 2 * a * way)
        t += (after - speed) / a
        x, v = side * 0.1, side * after
        exact.append(t)
    found = times(run, "relay")
    # each is found late by the tolerance, and what follows is late by as much
    assert len(found) >= 5 and np.allclose(found[:5], exact, rtol=0, atol=5e-6)
    assert run.summary["energy_balance_error"] < 1e-9
    on = run.column("relay.on")
    assert set(on) == {0.0, 1.0} and np.count_nonzero(np.diff(on)) == len(found)


def test_chatter_is_named(slider) -> None:
    """A relay on the speed without hysteresis would switch for ever."""
    relay = Event("relay", X.rate >= 0.1, until=X.rate < 0.1)
    loads = [
        PointForce((0, 0, 0), (1.0, 0, 0), time=Off("relay")),
        PointForce((0, 0, 0), (-1.0, 0, 0), time=On("relay")),
    ]
    with pytest.raises(ControlError, match="'relay' has gone on and off 40 times within"):
        execute(slider(events=relay, loads=loads, t_end=0.5))


def test_a_lock_that_lets_go(slider) -> None:
    """Held from the start until the force is too large, and caught again further on."""
    push = PointForce((0, 0, 0), (1.0, 0, 0), time=lambda t: 100 * t)
    let_go = Lock("slide", until=lambda_force() >= 10.0)
    run = execute(slider(locks=let_go, loads=push, t_end=0.3))
    first, then = times(run, "slide lock")
    # the force is a mean over the step, that of its middle: the step that ends the hold is behind
    assert first == 0.0 and 0.1 <= then <= 0.1 + 0.5 * 0.01 + 1e-9
    x = run.column("slide.translation")
    late = run.column("t") - then
    exact = np.where(late > 0, (100 * then * late**2 / 2 + 100 * late**3 / 6) / MASS, 0.0)
    # EP: what the midpoint rule is off by under a force that grows, dt^2/12 of its rate in time
    assert np.abs(x - exact).max() < 1.1 * 100 / MASS * 0.01**2 / 12 * 0.2
    assert run.summary["energy_balance_error"] < 1e-9


def lambda_force() -> Any:
    """The force that the lock takes."""
    return -1 * Sensor("slide.lock_force")


def falling(arm: Any, **more: Any) -> Scene:
    """An arm that falls from the horizontal."""
    scene: Scene = arm(**({"loads": Gravity(), "t_end": 0.6} | more))
    return scene


def fall_time(angle: float) -> float:
    """Time of a uniform rod of 1 m from the horizontal to an angle: w^2 = 3 g sin(a)/L."""
    # a = s^2 takes the root out of the integrand
    s, weights = np.polynomial.legendre.leggauss(60)
    s, weights = (s + 1) / 2 * math.sqrt(angle), weights / 2 * math.sqrt(angle)
    return float(np.sum(weights * 2 * s / np.sqrt(3 * 9.81 * np.sin(s**2))))


SCHEMES = [
    pytest.param("ep", 2),
    pytest.param("ed", 2, marks=pytest.mark.slow),
    pytest.param("ep4", 4, marks=pytest.mark.slow),
    pytest.param("ed3", 3, marks=pytest.mark.slow),
]


@pytest.mark.parametrize(("scheme", "order"), SCHEMES)
def test_time_of_a_latch_is_of_the_order_of_the_scheme(scheme, order, arm) -> None:
    """It locks where it hangs; the impact takes what gravity gave."""
    wrong = []
    for dt in (0.04, 0.02, 0.01):
        latch = Event("latch", ANGLE >= math.pi / 2, tolerance=1e-11)
        lock = Lock("hinge", when="latch")
        run = execute(falling(arm, scheme=scheme, dt=dt, events=latch, locks=lock))
        (found,) = times(run, "latch")
        wrong.append(abs(found - fall_time(math.pi / 2)))
        held = run.column("t") >= found
        assert np.allclose(run.column("hinge.rotation")[held], math.pi / 2, atol=1e-9)
        assert run.column("dissipation")[-1] == pytest.approx(MASS * 9.81 / 2, rel=1e-4)
        assert run.column("kinetic_energy")[-1] < 1e-20
        assert run.summary["energy_balance_error"] < 1e-9
    found_order = -np.polyfit(np.arange(3), np.log2(wrong), 1)[0]
    assert found_order > order - 0.25, (wrong, found_order)


def test_a_latch_where_steps_follow_a_tolerance(arm) -> None:
    control = StepControl(step_error=1e-5)
    lock = Lock("hinge", when=ANGLE >= math.pi / 2)
    run = execute(falling(arm, dt=1e-3, step_control=control, locks=lock))
    (found,) = times(run, "hinge lock")
    assert abs(found - fall_time(math.pi / 2)) < 1e-5
    assert run.summary["energy_balance_error"] < 1e-9
    # at rest steps grow again
    assert run.column("dt")[-2] > 5e-3


@pytest.mark.slow
def test_static_steps_end_at_events_too(arm) -> None:
    """A spring turned by a moment: the load at which it has turned by 0.3."""
    spring = JointSpring("spring", "hinge", stiffness=10.0)
    turn = PointMoment((0, 0, 0), (0, 5.0, 0))
    end = Event("turned", ANGLE >= 0.3, ends=True)
    run = execute(
        arm(scheme="static", dt=0.25, t_end=1.0, force_elements=spring, loads=turn, events=end)
    )
    assert times(run, "turned")[0] == pytest.approx(0.6, abs=1e-6)
    assert run.rows[-1]["hinge.rotation"] == pytest.approx(0.3, abs=1e-6)


def test_what_is_true_within_a_step_only_is_seen(slider) -> None:
    """Turning points of a mass on a spring, above the limit for a third of a step, ten times."""
    stiffness, rate, dt = 50.0, 5.0, 0.04
    spring = JointSpring("spring", "slide", stiffness=stiffness, coordinate="translation")
    size = SPEED / rate
    top = Event("top", X >= 0.9995 * size, until=X <= 0)
    far = Event("far", X >= 1.001 * size)
    given = {"force_elements": spring, "dt": dt, "t_end": 10 * 2 * math.pi / rate, **GLIDE}
    run = execute(slider(events=[top, far], **given))
    t, x = run.column("t"), run.column("slide.translation")
    on = times(run, "top")[::2]
    assert len(on) == 10 and not times(run, "far")
    # early by half the window, late by what is left of EP's frequency after ten periods
    peaks = (np.arange(10) + 0.25) * 2 * math.pi / rate
    assert np.all(np.abs(on - peaks - 0.0034 * peaks) < 0.02)
    at = x[np.searchsorted(t, on)]
    assert np.all((at >= 0.9995 * size) & (at < 1.0001 * size))
    # the ends of steps alone would have missed most, and no step was cut in vain
    assert len(t) < 1 + given["t_end"] / dt + 4 * 10


def test_a_turning_point_is_where_the_parabola_has_it() -> None:
    def at(*parts: float) -> list[np.ndarray]:
        return [np.array([0.01 - (p - 0.3) ** 2, -1.0, -np.inf]) for p in parts]

    assert turning_point(*at(-0.5, 0.0, 0.8), (0.5, 0.8)) == pytest.approx(0.3)
    # it turns outside of the step, or does not turn
    assert turning_point(*at(-0.5, 0.0, 0.29), (0.5, 0.29)) is None
    assert turning_point(*at(0.31, 0.8, 1.0), (0.49, 0.2)) is None
    # far below
    below = [m - 1.0 for m in at(-0.5, 0.0, 0.8)]
    assert turning_point(*below, (0.5, 0.8)) is None
    # it stays below zero by less than a quarter of its rise of 0.09 from the higher end, or by more
    for top, found in ((-0.022, 0.3), (-0.023, None)):
        near = [np.array([m[0] + top - 0.01, -1.0]) for m in at(-0.5, 0.0, 0.8)]
        assert turning_point(*near, (0.5, 0.8)) == (found and pytest.approx(found))
