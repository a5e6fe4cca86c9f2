"""Derivatives of the number that an adjoint differentiates by the histories that it reads.

The kind: numbers that are not smooth, that depend on nothing, or that are no numbers beside the
histories of the run. They gave means of derivatives, round-off or NaN without a word.
"""

import warnings
from collections.abc import Callable

import numpy as np
import pytest

import shellmb as sm
from shellmb.sensitivity.adjoint.objective import evaluated, slopes
from tests.sensitivity import test_adjoint as adjoints
from tests.sensitivity import test_refusals as refusals

T = np.linspace(0.0, 1.0, 6)
FLAT = np.array([0.0, 0.5, 1.0, 1.0 - 3e-5, 0.4, 0.2])  # its largest value is near another one

DRAWN = iter(range(9))


def slopes_of(objective: Callable, tip: np.ndarray = FLAT, kinks: int = 0) -> np.ndarray:
    history, said = {"t": T, "tip": tip, "other": 2 * tip}, list[str]()
    found = slopes(objective, history, evaluated(objective, history), said)
    assert not found["other"].any()
    assert ["has a kink in the history of 'tip'" in text for text in said] == [True] * kinks
    return found["tip"]


@pytest.mark.parametrize(
    ("objective", "exact"),
    [
        # 0.5 and 0.5 with differences as wide as the distance of both
        (lambda h: h["tip"].max(), np.eye(6)[2]),
        (lambda h: np.ptp(h["tip"]), np.eye(6)[2] - np.eye(6)[0]),
        (lambda h: (h["tip"] ** 2).sum(), 2 * FLAT),
        (lambda h: (h["tip"] ** 20).sum(), 20 * FLAT**19),
        (lambda h: np.array(h["tip"][3]), np.eye(6)[3]),
        # the way to a point that starts at zero has no derivative there, and needs none
        (lambda h: np.abs(h["tip"]).sum(), np.sign(FLAT)),
    ],
)
def test_derivatives_of_numbers(objective: Callable, exact: np.ndarray) -> None:
    # round-off 2e-16 over the closer distance 1e-6
    np.testing.assert_allclose(slopes_of(objective), exact, rtol=1e-8, atol=1e-8)


def test_numbers_that_depend_on_nothing() -> None:
    """Weights of differences add up to round-off only: it was 2e-13 of the number."""
    assert not slopes_of(lambda h: 3.0).any()
    assert not slopes_of(lambda h: h["t"][-1]).any()


@pytest.mark.parametrize(
    "objective",
    [
        lambda h: h["tip"].max(),  # reached twice
        lambda h: np.abs(h["tip"] - 1.0).sum(),
        lambda h: float((h["tip"] > 1.0 - 1e-7).sum()),
        lambda h: 1e11 + h["tip"].sum(),
    ],
)
def test_kinks_are_said(objective: Callable) -> None:
    twice = np.array([0.0, 0.5, 1.0, 1.0, 0.4, 0.2])
    slopes_of(objective, twice, kinks=1)


@pytest.mark.parametrize(
    ("objective", "said"),
    [
        # it was NaN after a whole sweep
        (lambda h: np.sqrt(h["tip"]).sum(), "no derivative by 'tip' at t = 0, where it is 0: at"),
        (lambda h: {0.4: 1.0}[h["tip"][4]], "no derivative by 'tip' at t = 0.8, .*KeyError"),
        (lambda h: h["tip"], r"the objective is array\(.*it must be a finite number"),
        (lambda h: "3", "the objective is '3'; it must be a finite number"),
        (lambda h: True, "the objective is True; it must be"),
        (lambda h: 1j * h["tip"][1], "the objective is .*j.?; it must be a finite number"),
        (lambda h: next(DRAWN), "the objective is 0, and 1 in a second call"),
    ],
)
def test_numbers_without_derivatives(objective: Callable, said: str) -> None:
    with pytest.raises(sm.SceneError, match=said):
        slopes_of(objective)


def last(history: dict) -> float:
    return float(history["x"][-1])


def test_corners_that_a_step_meets_are_said_backwards() -> None:
    """A load is taken in the middle of a step of EP, where its ramp begins."""
    with pytest.warns(sm.ShellmbWarning, match=r"load 1 has a corner at t = 0\.45, .*'start' mov"):
        found = sm.adjoint(refusals.thrown, last, parameters=("start",), values={"start": 0.45})
    (said,) = found.warnings
    assert "load 1 has a corner at t = 0.45" in said
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = sm.adjoint(refusals.thrown, last, parameters=("start",), values={"start": 0.42})
    assert found.warnings == ()


def test_kinks_of_the_scene_function_are_said_backwards() -> None:
    with pytest.warns(sm.ShellmbWarning, match="'a' = -1e-05 and 1e-05, and another one at 0"):
        sm.adjoint(
            lambda a=0.0: refusals.thrown(push=abs(a)), last, parameters="a", scales={"a": 1.0}
        )


def test_fields_on_which_nothing_depends_are_said() -> None:
    field = ("strip", "thickness")
    with pytest.warns(sm.ShellmbWarning, match="not depend on 'thickness' of shell 'strip'"):
        found = sm.adjoint(adjoints.plate, lambda h: 3.0, [field], values={"steps": 1})
    assert (found.fields[field]["derivative"] == 0).all()


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        (3, "a field is 3; it must be the name of a shell"),
        ([("strip", "thickness")] * 2, r"field \('strip', 'thickness'\) is named twice"),
    ],
)
def test_fields_that_are_named_wrongly(fields: object, said: str) -> None:
    with pytest.raises(sm.SceneError, match=said):
        sm.adjoint(refusals.thrown, last, fields)  # type: ignore[arg-type]
