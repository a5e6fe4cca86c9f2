"""What a scene says of sensors, controllers and events that cannot be: before anything is built."""

import math

import pytest

from shellmb.errors import SceneError
from shellmb.scene import (
    GROUND,
    PID,
    Acceleration,
    Command,
    Controller,
    Driver,
    Event,
    Gravity,
    Lock,
    Motor,
    Off,
    On,
    PathFollowing,
    Prismatic,
    Probe,
    Sensor,
    StepControl,
)

X = Sensor("slide.translation")
HOLD = PID("hold", X, 1.0, 1.0)


def two(t, readings, state, dt):
    return (0.0, 0.0), state


TWO = Controller("two", X, two, outputs=("a", "b"))
BAD = {
    "sensor 'slide.rotation': the run has no such number; of 'slide' it has 'slide.translation'": {
        "events": Event("e", Sensor("slide.rotation") > 1)
    },
    "'nothing': the run has no such number; it must be one of 'slide.translation', 'tip', ": {
        "probes": Probe("tip", (0, 0, 0)),
        "events": Event("e", Sensor("nothing") > 1),
    },
    "sensor 'slide.translation': joint 'slide' has windows of time": {
        "joints": Prismatic("slide", GROUND, "mass", at=(0, 0, 0), axis=(1, 0, 0), active=(0, 1)),
        "events": Event("e", X > 1),
    },
    "motor 'm': command: there is no controller 'pid'; the scene has 'hold'": {
        "controllers": HOLD,
        "force_elements": Motor("m", "slide", command=Command("pid")),
    },
    "motor 'm': command: output is missing; controller 'two' has 'a', 'b'": {
        "controllers": TWO,
        "force_elements": Motor("m", "slide", command=Command("two")),
    },
    "controller 'two' has no output 'c'": {
        "controllers": TWO,
        "force_elements": Motor("m", "slide", command=Command("two", "c")),
    },
    "motor 'm': there is no joint 'hinge'; the scene has 'slide'": {
        "controllers": HOLD,
        "force_elements": Motor("m", "hinge", command=Command("hold")),
    },
    "2 controllers are named 'hold'": {"controllers": (HOLD, HOLD)},
    "2 events are named 'slide lock'": {
        "events": Event("slide lock", X > 1),
        "locks": Lock("slide", when=X > 1),
    },
    "lock of joint 'slide': there is no event 'e'; the scene has none": {
        "locks": Lock("slide", when="e")
    },
    "gravity: time: there is no event 'e'": {"loads": Gravity(time=On("e"))},
    "driver 'd': translation is Off(event='e', time=None), which jumps": {
        "events": Event("e", X > 1),
        "drivers": Driver("d", "slide", translation=Off("e")),
    },
    "gravity: time is Acceleration(controller='hold', output=None); it must be Command(...)": {
        "controllers": HOLD,
        "loads": Gravity(time=Acceleration("hold")),
    },
    "period is 0.015; it must be a multiple of dt, which is 0.01": {
        "controllers": PID("hold", X, 1.0, 1.0, period=0.015)
    },
    "period is 0.001; it must be a multiple of dt": {
        "controllers": PID("hold", X, 1.0, 1.0, period=0.001)
    },
    "it has controllers, and scheme 'static' has no time": {
        "controllers": HOLD,
        "scheme": "static",
    },
    "it has events, and follows a path": {
        "events": Event("e", X > 1),
        "scheme": "static",
        "path": PathFollowing(),
    },
    "it has controllers, which scheme 'generalized-alpha' cannot have": {
        "controllers": HOLD,
        "scheme": "generalized-alpha",
    },
    "which scheme 'linear-dynamics' cannot have; it must be one of 'ep', 'ed', 'ep4', 'ed3'": {
        "events": Event("e", X > 1),
        "scheme": "linear-dynamics",
    },
    "sensor 'slide.translation.rate' is a rate, and scheme 'static' has none": {
        "events": Event("e", X.rate > 1),
        "scheme": "static",
    },
}


@pytest.mark.parametrize("said", BAD)
def test_what_cannot_be(said, slider) -> None:
    with pytest.raises(SceneError) as error:
        slider(**BAD[said])
    assert said in str(error.value)


def test_any_period_will_do_where_steps_follow_a_tolerance(slider) -> None:
    control = StepControl(step_error=1e-3)
    pid = PID("hold", X, 1.0, 1.0, period=math.pi / 300)
    assert slider(controllers=pid, step_control=control).sensors == (X,)
    assert slider(controllers=PID("hold", X, 1.0, 1.0, period=0.03)).controllers


def test_a_controlled_scene_keeps_its_controllers_with_another_scheme(slider) -> None:
    scene = slider(controllers=HOLD, events=Event("e", X > 1))
    assert scene.with_options(scheme="ed3").events == scene.events
    with pytest.raises(SceneError, match="it has controllers, and scheme 'static'"):
        scene.with_options(scheme="static")
