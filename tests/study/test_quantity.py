"""Quantities of histories: numbers of a curve, differences of curves."""

import numpy as np
import pandas as pd
import pytest

from shellmb.accuracy.studies.quantity import Quantity, curve, default_quantity, parse_quantity
from shellmb.errors import SceneError
from shellmb.scene import Scene


def history(steps, function=np.sin, end=2.0):
    t = np.linspace(0.0, end, steps + 1)
    return pd.DataFrame({"t": t, "u": function(t)})


def test_names_and_norms():
    assert parse_quantity("peak") == Quantity("peak")
    assert parse_quantity("drive.torque:l2") == Quantity("drive.torque", "l2")
    for text in ("u:largest", ":max", "u:"):
        with pytest.raises(SceneError, match="it must be the name of a result, or COLUMN:NORM"):
            parse_quantity(text)


def test_numbers_of_a_curve():
    # the largest value lies between two steps; a cubic spline finds it to h^4
    table = history(20)
    taken = {n: Quantity("u", n).take({}, table)["value"] for n in ("end", "max", "min", "mean")}
    assert taken["end"] == pytest.approx(np.sin(2.0), abs=1e-14)
    # an eighth of a step from it at most, beside the spline's error
    assert taken["max"] == pytest.approx(1.0, abs=(0.1 / 16) ** 2)
    assert table["u"].max() < 1 - 2e-4, "the largest value at the ends of the steps is less"
    assert taken["min"] == pytest.approx(0.0, abs=1e-14)
    # an integral of a cubic spline: h^4
    assert taken["mean"] == pytest.approx((1 - np.cos(2.0)) / 2, abs=1e-5)


def test_differences_of_curves():
    quantity, largest = Quantity("u", "l2"), Quantity("u", "sup")
    fine = quantity.take({}, history(400))
    same = quantity.take({}, history(20))
    assert quantity.difference(same, fine) < 1e-5, "a spline's error, h^4 / 384 and the ends'"
    scaled = quantity.take({}, history(20, lambda t: 1.1 * np.sin(t)))
    assert quantity.difference(scaled, fine) == pytest.approx(0.1, abs=1e-5)
    assert largest.difference(scaled, fine) == pytest.approx(0.1, abs=1e-5)
    assert Quantity("u", "end").difference({"value": 3.0}, {"value": 2.0}) == 0.5
    assert Quantity("u", "end").difference({"value": 3.0}, {"value": 0.0}) == 3.0, "absolute"


def test_means_over_steps_stand_at_their_middles():
    table = history(4, lambda t: t)
    table["mean"] = [np.nan, *((table["u"].to_numpy()[1:] + table["u"].to_numpy()[:-1]) / 2)]
    t, y = curve(table, "mean", mean=True)
    assert t.tolist() == [0.25, 0.75, 1.25, 1.75]
    # round-off of a spline
    np.testing.assert_allclose(y, t, rtol=1e-14)
    ends = table["t"].to_numpy()
    assert curve(table, "mean")[0].tolist() == ends[1:].tolist(), "values at the ends of steps"


def test_means_over_steps_are_no_error_of_second_order():
    errors = []
    for steps in (20, 40):
        table = history(steps)
        ends = -np.cos(table["t"].to_numpy())
        table["mean"] = [np.nan, *(np.diff(ends) / np.diff(table["t"]))]
        t, y = curve(table, "mean", mean=True)
        errors.append(np.abs(y - np.sin(t)).max())
    # fourth order inside, third at the ends, and a mean in place of a value 4e-4
    assert errors[1] < errors[0] / 7 < 1e-5


def test_unknown_quantities_list_those_known():
    with pytest.raises(SceneError, match="one of the scene's results, 'peak', or COLUMN:NORM"):
        Quantity("peek").take({"peak": 1.0}, history(2))
    with pytest.raises(SceneError, match="a column of the history, 't', 'u'"):
        Quantity("w", "end").take({}, history(2))
    with pytest.raises(SceneError, match="the scene 'bare' has no probe; give --quantity"):
        default_quantity(_bare())


def _bare():
    from shellmb.scene import Clamped, Isotropic, Rectangle, Shell

    steel = Isotropic(E=2e11, nu=0.3, thickness=0.01)
    return Scene("bare", Shell("plate", Rectangle(1, 1), steel), supports=Clamped("left"))
