"""The error estimate of ED in the summary, on made-up histories."""

import math

import pytest

from shellmb.observers.summary import POINTS, jump_error


def rows(count, jump):
    first = {"t": 0.0, "dt": 0.0, "jump": math.nan}
    return [first] + [{"t": 0.1 * k, "dt": 0.1, "jump": jump(k)} for k in range(1, count + 1)]


def test_no_jumps_no_estimate():
    assert jump_error(rows(3, lambda k: math.nan)) is None
    assert jump_error(rows(0, float)) is None


def test_few_steps_are_all_there():
    found = jump_error(rows(3, lambda k: (4.0, 1.0, 2.0)[k - 1]))
    assert found["largest"] == [4.0, 1.0, 2.0]
    assert found["t"] == pytest.approx([0.1, 0.2, 0.3])
    assert (found["max"], found["time_of_max"]) == (4.0, 0.1)
    assert found["mean"] == pytest.approx(7 / 3)


def test_the_mean_is_over_time():
    table = [{"t": 1.0, "dt": 1.0, "jump": 1.0}, {"t": 4.0, "dt": 3.0, "jump": 3.0}]
    assert jump_error(table)["mean"] == pytest.approx(2.5)


@pytest.mark.parametrize("count", [50, 51, 119, 1234])
def test_a_long_run_keeps_its_peaks(count):
    # a peak of one step is in the series, wherever it is
    peak = count - 7
    found = jump_error(rows(count, lambda k: 9.0 if k == peak else 1e-3 * (k % 5)))
    assert len(found["t"]) == len(found["largest"]) == POINTS
    assert max(found["largest"]) == found["max"] == 9.0
    assert found["time_of_max"] == pytest.approx(0.1 * peak)
    assert found["t"] == sorted(found["t"])
