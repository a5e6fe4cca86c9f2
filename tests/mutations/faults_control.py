"""Faults of controllers, events, times and starts, as those of `faults`."""

from .faults import Fault

LAWS, EVENTS = "tests/control/test_laws.py", "tests/control/test_events.py"
CONTROLLED = "tests/control/test_controlled.py"
CONTROLLERS = "shellmb/scene/control/controllers.py"
CONTROL = "shellmb/simulate/control"
GIVEN, STARTS = "shellmb/simulate/start/initial_state.py", "tests/simulate/test_starts.py"
SECTIONS = "tests/simulate/test_start_sections.py"
TIMES = "tests/simulate/test_times.py"

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
        f"{CONTROL}/items.py",
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
        f"{CONTROL}/items.py",
        "        self.armed = False\n",
        "        self.armed = True\n",
        (f"{EVENTS}::test_a_lock_that_lets_go",),
    ),
    Fault(
        "a turning point far below zero is looked at",
        f"{CONTROL}/items.py",
        "top + (top - max(b, c)) / 4 >= 0",
        "top + (top - min(b, c)) / 4 >= 0",
        (f"{EVENTS}::test_a_turning_point_is_where_the_parabola_has_it",),
    ),
    Fault(
        "rows of steps that are taken back stay",
        "shellmb/observers/deferred.py",
        "del self._rows[rows:]",
        "del self._rows[rows + 1:]",
        (
            "tests/observers/test_booking.py"
            "::test_rows_of_a_step_that_is_taken_back_are_in_no_history",
        ),
    ),
    # starts
    Fault(
        "a mode turns three directors twice as far",
        GIVEN,
        "turns = cross if rows.shape[1] == 1 else cross / 2",
        "turns = cross",
        (f"{STARTS}::test_a_mode_turns_directors_by_its_slope[beam]",),
    ),
    Fault(
        "a mode turns one director half as far",
        GIVEN,
        "turns = cross if rows.shape[1] == 1 else cross / 2",
        "turns = cross / 2",
        (f"{STARTS}::test_a_mode_turns_directors_by_its_slope[shell]",),
    ),
    Fault(
        "forces of other sections are taken",
        GIVEN,
        "return anew or not _same_sections(scene, stored)",
        "return anew",
        (
            f"{SECTIONS}::test_forces_are_those_of_the_sections_now[another contraction]",
            f"{SECTIONS}::test_forces_are_those_of_the_sections_now[another rod]",
        ),
    ),
    Fault(
        "one section that stays says that all do",
        GIVEN,
        "return all(below(stored.scene, path)",
        "return any(below(stored.scene, path)",
        (f"{SECTIONS}::test_forces_are_those_of_the_sections_now[plies along and across]",),
    ),
    Fault(
        "forces are found anew where they are known",
        GIVEN,
        "return anew or not _same_sections(scene, stored)",
        "return True",
        (f"{SECTIONS}::test_forces_are_those_of_the_sections_now[the same]",),
    ),
    Fault(
        "controllers begin with empty memories",
        "shellmb/simulate/simulation.py",
        "        self.control.go_on(self.problem.controlled)\n",
        "",
        (
            "tests/control/test_runs.py"
            "::test_a_run_from_another_goes_on_with_its_controllers[motors]",
        ),
    ),
    Fault(
        "velocities that joints replace are not said",
        "shellmb/simulate/start/start.py",
        "        if abs(after - before) > DRIFT * before:\n",
        "        if after < 0.01 * before:\n",
        ("tests/mechanisms/test_start.py::test_velocities_that_joints_replace_are_said",),
    ),
    # times
    Fault(
        "times of steps are summed",
        "shellmb/simulate/stepsize.py",
        "return self.begin + self.steps * dt",
        "return t + dt",
        (f"{TIMES}::test_equal_steps_are_counted",),
    ),
    Fault(
        "a rest of a step is a step",
        "shellmb/simulate/stepsize.py",
        "(remaining / 2 if remaining < (1 + size.least_rest) * size.dt else size.dt)",
        "size.dt",
        (f"{TIMES}::test_a_rest_is_shared_where_it_is_short",),
    ),
)
