"""Orders by regression, and the uncertainty of a reference by extrapolation."""

import pytest

from shellmb.accuracy.studies.advice import find_orders
from shellmb.accuracy.studies.points import judge

from .conftest import judged, point


def test_orders_in_time(two_schemes):
    ep, ed = find_orders(two_schemes)
    assert (ep.family, ep.direction, ep.points) == ("EP", "dt", 4)
    assert ep.order == pytest.approx(2.0, abs=1e-12)
    assert ed.order == pytest.approx(3.0, abs=1e-12)


def test_errors_the_reference_cannot_tell_are_left_out():
    errors = {0.4: 0.48, 0.2: 0.12, 0.1: 0.03, 0.05: 0.0075, 0.025: 0.006}
    points = [point("ep", dt, e, 1.0, uncertainty=2.4e-3) for dt, e in errors.items()]
    order = find_orders(judged(points, 2.4e-3, ("dt",)))[0]
    # the first is no asymptotic error, the last is less than three uncertainties
    assert order.points == 3
    assert order.order == pytest.approx(2.0, abs=1e-12)
    some = find_orders(judged(points[-2:], 5e-3, ("dt",)))[0]
    assert some.order is None


def test_orders_in_space_and_time_each_at_the_finest_of_the_other():
    meshes = ((4, 1), (8, 2), (16, 4))
    points = [
        point("ep", dt, 0.02 * dt**2 + 10.0 * n[0] ** -4, 1.0, mesh=n)
        for n in meshes
        for dt in (0.2, 0.1, 0.05)
    ]
    time, space = find_orders(judged(points, 0.0, ("mesh", "dt")))
    assert (time.direction, time.at) == ("dt", "16x4")
    assert 1 < time.order < 2, "the mesh limits it"
    assert (space.direction, space.at) == ("h", "dt = 0.05 s")
    assert 3.5 < space.order < 4, "the step limits it"
    along = [point("static", 1.0, n**-3.0, 1.0, mesh=(n, 2)) for n in (2, 4, 8)]
    assert find_orders(judged(along, 0.0, ("mesh",)))[0].order == pytest.approx(3.0, abs=1e-12)


@pytest.mark.parametrize("order", [1.0, 2.0, 3.5])
def test_extrapolation_finds_the_order_and_the_error(order):
    # value 1 + h^p at h = 1/4, 1/8, 1/16; the true error of the finest is that power
    errors = [k**-order for k in (16, 8, 4)]
    differences = errors[1] - errors[0], errors[2] - errors[1]
    uncertainty, found = judge(differences, 2.0)
    assert found == pytest.approx(order, abs=1e-12)
    assert uncertainty == pytest.approx(1.25 * errors[0], rel=1e-12)


def test_what_does_not_converge_is_not_known():
    grows, order = judge((0.02, 0.01), 2.0)
    assert grows == pytest.approx(1.25 * 0.02)
    assert order == -1.0
    slow, order = judge((0.01, 0.014), 2.0)
    assert slow == pytest.approx(1.25 * 0.01), "the order is taken as 1"
    assert 0 < order < 1
    chance, order = judge((1e-9, 0.01), 2.0)
    assert chance == pytest.approx(1.25e-9 / 15), "no order above 4 is believed"
    assert judge((0.01, 0.8), 2.0) == (pytest.approx(0.01), None), "the third run is no use"
    assert judge((0.01,), 2.0) == (pytest.approx(0.01), None)
    assert judge((0.0, 0.0), 2.0)[0] == 0.0
