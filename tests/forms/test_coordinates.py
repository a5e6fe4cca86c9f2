"""Relative coordinates: the discrete gradient of an angle, and the equations they obey."""

import numpy as np
import pytest
import ufl

from shellmb.forms.constraints import coordinates
from shellmb.forms.constraints.joints import Place


def value(expression: ufl.core.expr.Expr) -> float:
    return float(ufl.algorithms.expand_derivatives(ufl.as_ufl(expression)))


def vector(values: np.ndarray) -> ufl.core.expr.Expr:
    return ufl.as_vector([ufl.as_ufl(float(v)) for v in values])


def direction(angle: float, length: float = 1.0) -> np.ndarray:
    return length * np.array([np.cos(angle), np.sin(angle)])


def place(angle: float, x: tuple[float, float, float] = (0, 0, 0)) -> Place:
    """A place turned about the third axis."""
    e = [[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    return Place(vector(np.array(x)), tuple(vector(np.array(v)) for v in e))


# on both sides of the switch between quotient and series, and close to half a turn
ANGLES = [0.0, 1e-12, 1e-6, 9.99e-4, 1.01e-3, 0.3, -1.2, 2.0, 3.1, -3.14]


@pytest.mark.parametrize("delta", ANGLES)
@pytest.mark.parametrize("lengths", [(1.0, 1.0), (0.7, 1.3)])
def test_gradient_along_the_increment_is_the_increment(
    delta: float, lengths: tuple[float, float]
) -> None:
    start, end = direction(0.4, lengths[0]), direction(0.4 + delta, lengths[1])
    found = coordinates.increment_gradient(vector(start), vector(end), vector(end - start))
    assert value(coordinates.increment(vector(start), vector(end))) == pytest.approx(
        delta, abs=5e-15
    )
    # a product of numbers of order one, near half a turn divided by a sine of 1e-3
    assert value(found) == pytest.approx(delta, abs=3e-12)


def test_gradient_at_one_state_is_the_derivative() -> None:
    at, change = direction(0.7, 1.2), np.array([0.3, -0.5])
    h = 1e-6
    angles = [np.arctan2(*(at + s * h * change)[::-1]) for s in (-1, 1)]
    exact = (angles[1] - angles[0]) / (2 * h)
    for found in (
        coordinates.angle_change(vector(at), vector(change)),
        coordinates.increment_gradient(vector(at), vector(at), vector(change)),
    ):
        # the central difference: round-off of angles over h
        assert value(found) == pytest.approx(exact, rel=50 * np.finfo(float).eps / h)


@pytest.mark.parametrize("turns", [-3, 0, 1, 40])
@pytest.mark.parametrize("step", [-3.1, -1.2, 0.0, 2.5])
def test_rotation_counts_turns(turns: int, step: float) -> None:
    """From the angle at the start of a step, and by itself up to whole turns."""
    before = 0.7 + 2 * np.pi * turns
    first, second = place(0.2), place(0.2 + 0.7 + step)
    # some units in the last place of angles of some hundred radians
    exact = {"abs": 5e-12}
    for off in (0.0, 0.1, 2 * np.pi, -9.0):
        x = ufl.as_ufl(before + step + off)
        gap = coordinates.rotation_gap(first, second, x, ufl.as_ufl(before))
        assert value(gap) == pytest.approx(off, **exact)
        gap = coordinates.rotation_gap(first, second, x, x)
        assert value(gap) == pytest.approx(np.angle(np.exp(1j * off)), **exact)


def test_translation_and_distance() -> None:
    first, second = place(0.2, (1, 0, 1)), place(0.9, (1, 3, 5))
    assert value(coordinates.translation_gap(first, second, ufl.as_ufl(4.5))) == 0.5
    assert value(coordinates.distance_gap(first, second, ufl.as_ufl(5.0), ufl.as_ufl(5.0))) == 0
    gap = coordinates.distance_gap(first, second, ufl.as_ufl(5.0 + 1e-5), ufl.as_ufl(5.0))
    # up to the square of the change over twice the length
    assert value(gap) == pytest.approx(1e-5, rel=2e-6)
