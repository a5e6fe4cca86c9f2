"""Curves: positions, tangents, lengths, names."""

import numpy as np
import pytest

from shellmb.scene import AlongEdge, AlongLine, Arc, CircularArc, Curve, Line, ParametricCurve

QUARTER = np.pi / 2


def helix(xi):
    return np.stack([2 * np.cos(3 * xi), 2 * np.sin(3 * xi), 0.5 * xi])


def ring(xi):
    return np.stack([np.cos(2 * np.pi * xi), np.sin(2 * np.pi * xi), 0 * xi])


CURVES = {
    "line": (Line((1, 2, 3), (4, 6, 3)), 5.0, (1, 2, 3), (4, 6, 3)),
    "quarter": (
        CircularArc((0, 0, 7), (2, 0, 1), (0, 0, 5), QUARTER),
        2 * QUARTER,
        (2, 0, 1),
        (0, 2, 1),
    ),
    "backwards": (
        CircularArc((0, 0, 0), (2, 0, 0), (0, 0, 1), -3 * QUARTER),
        6 * QUARTER,
        (2, 0, 0),
        (0, 2, 0),
    ),
    "short arc": (
        Arc((3, 0, 0), (3 * np.cos(0.3), 3 * np.sin(0.3), 0), (0, 3, 0)),
        3 * QUARTER,
        (3, 0, 0),
        (0, 3, 0),
    ),
    "long arc": (Arc((0, 0, 1), (0, -1, 0), (0, 1, 0)), 3 * QUARTER, (0, 0, 1), (0, 1, 0)),
    "helix": (ParametricCurve(helix), np.sqrt(36 + 0.25), helix(0), helix(1)),
}


@pytest.mark.parametrize("name", CURVES)
def test_ends_length_and_tangent(name):
    curve, length, start, end = CURVES[name]
    assert curve.length == pytest.approx(length, rel=1e-10)
    assert not curve.closed
    assert curve.point_names == ("start", "end")
    np.testing.assert_allclose(curve.points["start"], start, atol=1e-14)
    np.testing.assert_allclose(curve.points["end"], end, atol=1e-14)
    xi = np.linspace(0.001, 0.999, 21)
    chord = curve.position(xi + 1e-4) - curve.position(xi - 1e-4)
    # a chord leans by the square of its angle, here below (5e-4)^2
    np.testing.assert_allclose(
        curve.tangent(xi), chord / np.linalg.norm(chord, axis=0), rtol=0, atol=1e-6
    )
    np.testing.assert_allclose(np.linalg.norm(curve.tangent(xi), axis=0), 1, rtol=1e-14)


def test_the_arc_passes_its_middle():
    middle = (np.cos(0.4), np.sin(0.4) * 0.6, np.sin(0.4) * 0.8)
    arc = Arc((1, 0, 0), middle, (-1, 0, 0))
    np.testing.assert_allclose(arc.position(np.array([0.4 / np.pi])).ravel(), middle, atol=1e-14)
    assert arc.circle.radius == pytest.approx(1)


def test_the_derivative_of_a_function_is_exact_up_to_the_ends():
    """From points inside [0, 1] only, where alone the function is asked."""

    def cubic(xi):
        assert xi.min() >= 0
        assert xi.max() <= 1
        return np.stack([xi, xi**2, xi**3])

    xi = np.linspace(0, 1, 11)
    exact = np.stack([np.ones_like(xi), 2 * xi, 3 * xi**2])
    # round-off of the positions over the spacing 2e-3 of the points
    np.testing.assert_allclose(
        ParametricCurve(cubic).tangent(xi), exact / np.linalg.norm(exact, axis=0), atol=1e-12
    )


@pytest.mark.parametrize(
    "curve", [CircularArc((0, 0, 0), (1, 0, 0), (0, 0, 1), 2 * np.pi), ParametricCurve(ring)]
)
def test_closed_curves_have_a_start_only(curve):
    assert curve.closed
    assert curve.point_names == ("start",)
    assert set(curve.points) == {"start"}
    assert curve.length == pytest.approx(2 * np.pi, rel=1e-10)


@pytest.mark.parametrize("curve", [AlongEdge("a", "left"), AlongLine("a", "left-top", (1, 0, 0))])
def test_lines_of_a_shell_are_known_by_its_mesh(curve):
    assert curve.shell == "a"
    assert curve.point_names == ("start", "end")
    assert not curve.closed
    assert curve.points == {}
    with pytest.raises(NotImplementedError, match="known by a shell's mesh only"):
        curve.position(np.zeros(1))


def test_a_curve_of_ones_own():
    class Parabola(Curve):
        def position(self, xi):
            return np.stack([xi, xi**2 / 2, 0 * xi])

    exact = (np.sqrt(2) + np.arcsinh(1)) / 2
    assert Parabola().length == pytest.approx(exact, rel=1e-11)
    assert Line((0, 0, 0), (1, 0, 0)).straight
    assert not Parabola().straight
