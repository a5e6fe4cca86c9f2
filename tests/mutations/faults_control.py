"""Faults of controllers and events, as those of `faults`."""

from .faults import Fault

LAWS, EVENTS = "tests/control/test_laws.py", "tests/control/test_events.py"
CONTROLLED = "tests/control/test_controlled.py"
CONTROLLERS = "shellmb/scene/control/controllers.py"
CONTROL = "shellmb/simulate/control"

FAULTS = (
    Fault(
        "a limited integral winds up",
        CONTROLLERS,
        "(wanted - output) * (grown - integral) > 0",
        "(wanted - output) * (grown - integral) > 9e9",
        (f"{LAWS}::test_integral_waits_where_a_limit_holds",),
    ),
    Fault(
        "the filter of the derivative lets all through",
        CONTROLLERS,
        "late * derivative + (1 - late) * rate",
        "0 * derivative + rate",
        (f"{LAWS}::test_filter_of_the_derivative_is_a_lag_of_first_order",),
    ),
    Fault(
        "a sampled law is asked at every step",
        f"{CONTROL}/sampling.py",
        "period is None or t >= self.next - ROUND_OFF * period",
        "period is None or t >= 0",
        (f"{CONTROLLED}::test_sampled_slider_is_exact",),
    ),
    Fault(
        "a driven coordinate loses its rate from sample to sample",
        "shellmb/model/signals.py",
        "self.rate + (t - self.begin) * self.acceleration, acceleration",
        "self.rate, acceleration",
        (f"{CONTROLLED}::test_a_driver_is_commanded_by_its_acceleration",),
    ),
    Fault(
        "an event is not sought within its step",
        f"{CONTROL}/control.py",
        "last = simulation.stepping.attempt(t, dt)\n            crossing = found >= 0",
        "last = attempt\n            crossing = found >= 0",
        (
            f"{EVENTS}::test_an_event_is_found_to_its_tolerance[None]",
            f"{EVENTS}::test_several_events_in_a_step_are_found_in_their_order",
        ),
    ),
    Fault(
        "what went off goes on again at once",
        f"{CONTROL}/watching.py",
        "        self.armed = False\n",
        "        self.armed = True\n",
        (f"{EVENTS}::test_a_lock_that_lets_go",),
    ),
)
