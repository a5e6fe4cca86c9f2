"""Closed forms of isotropic plates against the tables and the textbook's numbers."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from shellmb.demos.references.plates import (
    Plate,
    circle_point_deflection,
    circle_uniform_deflection,
    rectangle_point_deflection,
    rectangle_uniform_deflection,
)
from shellmb.demos.verification import tables
from tests.analytic.solutions import (
    plate_wave_frequencies,
    rectangle_frequencies,
    rectangle_uniform_moment,
)

A = 2.0  # side of the square: not one, so that a wrong power of it shows
Q = 3.0


def square(a_over_h: float, shear_correction: float = 5 / 6) -> Plate:
    return Plate(7e9, 0.3, A / a_over_h, density=1500.0, shear_correction=shear_correction)


@pytest.mark.parametrize("a_over_h", [5, 10, 20, 50, 100, 1000])
def test_square_uniform(a_over_h: float) -> None:
    plate = square(a_over_h)
    w = rectangle_uniform_deflection(plate, A, A, Q) * plate.bending / (Q * A**4)
    # half a unit of the table's last digit, not round-off
    assert w == pytest.approx(tables.plate_deflection("SSSS hard", a_over_h), abs=5.1e-10)
    moment = rectangle_uniform_moment(plate, A, A, Q) / (Q * A**2)
    assert moment == pytest.approx(4.788638e-2, abs=5.1e-9)


def test_thin_square_uniform() -> None:
    plate = square(10, math.inf)
    w = rectangle_uniform_deflection(plate, A, A, Q) * plate.bending / (Q * A**4)
    # half a unit of the last digit, not round-off
    assert w == pytest.approx(4.062353e-3, abs=5.1e-10)


def test_long_rectangle_is_a_strip() -> None:
    plate = Plate(7e9, 0.3, 0.1)
    strip = 5 * Q * A**4 / (384 * plate.bending) + Q * A**2 / (8 * plate.shear)
    assert rectangle_uniform_deflection(plate, A, 8 * A, Q) == pytest.approx(strip, rel=1e-4)
    # the moment that bends the fibres across the strip; the other is nu times as large
    across = rectangle_uniform_moment(plate, A, 8 * A, Q)
    along = rectangle_uniform_moment(plate, 8 * A, A, Q)
    assert (across, along) == pytest.approx((Q * A**2 / 8, plate.nu * Q * A**2 / 8), rel=1e-3)


def test_thin_square_point() -> None:
    plate = square(100)
    w = rectangle_point_deflection(plate, A, A, Q) * plate.bending / (Q * A**2)
    assert w == pytest.approx(0.01160084, abs=5.1e-9)  # docs/reference/literature.md


def test_thin_rectangle_point_is_navier_s_double_series() -> None:
    plate, b = square(100), 2 * A
    m, n = np.meshgrid(np.arange(1, 2000, 2), np.arange(1, 2000, 2))
    k2 = (np.pi * m / A) ** 2 + (np.pi * n / b) ** 2
    navier = 4 * Q / (A * b * plate.bending) * (1 / k2**2).sum()
    # the double series, of positive terms, still lacks 5e-7 of its sum
    assert rectangle_point_deflection(plate, A, b, Q) == pytest.approx(navier, rel=1e-6)


def test_point_force_does_not_care_about_the_order_of_the_sides() -> None:
    plate = square(100)
    one, other = (rectangle_point_deflection(plate, *ab, Q) for ab in ((A, 3 * A), (3 * A, A)))
    assert one == pytest.approx(other, rel=1e-9)


@pytest.mark.parametrize("a_over_h", [5, 10, 20, 100, 1000])
def test_square_frequencies(a_over_h: float) -> None:
    plate = square(a_over_h)
    table = plate_wave_frequencies(a_over_h)
    omega = rectangle_frequencies(plate, A, A, list(table))
    scaled = omega * A**2 * math.sqrt(plate.density * plate.thickness / plate.bending)
    # half a unit of the table's last digit, not round-off
    np.testing.assert_allclose(scaled, list(table.values()), rtol=0, atol=5.1e-7)


def test_thin_square_frequencies() -> None:
    plate = square(10, math.inf)
    modes = [(1, 1), (1, 2), (2, 2)]
    omega = rectangle_frequencies(plate, A, A, modes, rotary_inertia=False)
    scaled = omega * A**2 * math.sqrt(plate.density * plate.thickness / plate.bending)
    np.testing.assert_allclose(scaled, np.pi**2 * np.array([2, 5, 8]), rtol=1e-14)


def test_nafems_fv52() -> None:
    """Thick simply supported square, 10 m, t = 1 m: 45.897, 109.44, 167.89 Hz.

    NAFEMS' values are Mindlin's with his factor pi^2/12, 0.03 to 0.1 % below those for 5/6.
    """
    plate = Plate(200e9, 0.3, 1.0, density=8000.0, shear_correction=math.pi**2 / 12)
    hertz = rectangle_frequencies(plate, 10, 10, [(1, 1), (1, 2), (2, 2)]) / (2 * math.pi)
    np.testing.assert_allclose(hertz, [45.897, 109.44, 167.89], rtol=5e-5)


def test_circle_uniform() -> None:
    """Formulas of docs/reference/literature.md, `(16/5) h^2 / (a^2 (1 - nu))` for kappa = 5/6."""
    plate, a, nu = Plate(7e9, 0.3, 0.2), 1.5, 0.3
    unit = Q * a**4 / (64 * plate.bending)
    by_shear = 16 / 5 * plate.thickness**2 / (a**2 * (1 - nu))
    clamped = circle_uniform_deflection(plate, a, Q, clamped=True)
    hinged = circle_uniform_deflection(plate, a, Q, clamped=False)
    assert clamped == pytest.approx(unit * (1 + by_shear), rel=1e-14)
    assert hinged == pytest.approx(unit * ((5 + nu) / (1 + nu) + by_shear), rel=1e-14)


@pytest.mark.parametrize("clamped", [True, False])
def test_circle_meets_its_edge_conditions(clamped: bool) -> None:
    plate, a, step = Plate(7e9, 0.3, 0.2, shear_correction=math.inf), 1.5, 1e-3

    def w(r: float) -> float:
        return circle_uniform_deflection(plate, a, Q, clamped, r)

    slope = (w(a + step) - w(a - step)) / (2 * step)
    curvature = (w(a + step) - 2 * w(a) + w(a - step)) / step**2
    assert w(a) == 0.0
    free = slope if clamped else curvature + plate.nu * slope / a
    assert abs(free) < 1e-5 * Q * a**2 / plate.bending


@pytest.mark.parametrize("clamped", [True, False])
def test_circle_point_is_reciprocal_to_the_uniform_load(clamped: bool) -> None:
    """Betti: the work of the uniform load on the point force's deflection, and the other way."""
    plate, a = Plate(7e9, 0.3, 0.2, shear_correction=math.inf), 1.5

    def work(r: float) -> float:
        return 2 * math.pi * r * Q * circle_point_deflection(plate, a, 5.0, clamped, r)

    integral, _ = quad(work, 0, a)
    assert integral == pytest.approx(5.0 * circle_uniform_deflection(plate, a, Q, clamped))
