"""Sections of beams against closed forms."""

import dataclasses

import numpy as np
import pytest

from shellmb.scene import CircularSection, GeneralSection, RectangularSection, TubularSection


def test_rectangle_is_the_textbook_one():
    E, nu, b, h, rho = 3.0, 0.25, 0.2, 0.5, 7.0
    section = RectangularSection(E, nu, width=b, height=h, density=rho)
    G, C = E / 2.5, section.stiffness
    expected = (E * b * h, 5 / 6 * G * b * h, 5 / 6 * G * b * h)
    np.testing.assert_allclose(C.diagonal()[:3], expected, rtol=1e-14)
    np.testing.assert_allclose(C.diagonal()[4:], (E * b * h**3 / 12, E * h * b**3 / 12), rtol=1e-14)
    np.testing.assert_array_equal(C, np.diag(C.diagonal()))
    m, first, second = section.mass
    assert m == pytest.approx(rho * b * h)
    assert first == (0, 0)
    np.testing.assert_allclose(second, (rho * h * b**3 / 12, 0, rho * b * h**3 / 12))
    assert section.size == h


@pytest.mark.parametrize(
    ("ratio", "constant"),
    # Timoshenko and Goodier, Theory of Elasticity, art. 109, table of k_1; four digits are given
    [(1.0, 0.1406), (1.2, 0.166), (1.5, 0.196), (2.0, 0.229), (3.0, 0.263), (10.0, 0.312)],
)
def test_torsion_of_rectangles(ratio, constant):
    wide = RectangularSection(1.0, 0.0, width=2 * ratio, height=2.0)
    tall = RectangularSection(1.0, 0.0, width=2.0, height=2 * ratio)
    # the table gives three or four digits
    assert wide.torsion_constant / (ratio * 16) == pytest.approx(constant, abs=6e-4)
    assert tall.torsion_constant == wide.torsion_constant
    assert wide.stiffness[3, 3] == pytest.approx(wide.torsion_constant / 2)


def test_torsion_series_is_summed_up():
    """The square to ten digits, and the limit of a narrow strip, 1/3 - 0.21 b/a."""
    square = RectangularSection(1.0, 0.0, width=1.0, height=1.0).torsion_constant
    n = np.arange(1, 20001, 2.0)
    terms = np.tanh(np.minimum(n * np.pi / 2, 300)) / n**5
    assert square == pytest.approx((1 - 192 / np.pi**5 * terms.sum()) / 3, rel=1e-12)
    strip = RectangularSection(1.0, 0.0, width=1.0, height=1e-6).torsion_constant
    assert strip == pytest.approx(1e-18 / 3 * (1 - 0.63025e-6), rel=1e-9)


def test_circle_and_tube():
    E, nu, r, t, rho = 2.0, 0.3, 0.5, 0.1, 3.0
    circle, tube = (
        CircularSection(E, nu, radius=r, density=rho),
        TubularSection(E, nu, radius=r, thickness=t, density=rho),
    )
    inner = r - t
    G = E / (2 * (1 + nu))
    for section, a, i in (
        (circle, np.pi * r**2, np.pi / 4 * r**4),
        (tube, np.pi * (r**2 - inner**2), np.pi / 4 * (r**4 - inner**4)),
    ):
        C = section.stiffness.diagonal()
        np.testing.assert_allclose(C[[0, 3, 4, 5]], (E * a, 2 * G * i, E * i, E * i), rtol=1e-13)
        m, first, second = section.mass
        np.testing.assert_allclose((m, *first), (rho * a, 0, 0))
        np.testing.assert_allclose(second, (rho * i, 0, rho * i), rtol=1e-13)
        assert section.size == 2 * r


def test_shear_corrections_of_cowper():
    """Full circle 6(1+nu)/(7+6nu), thin tube 2(1+nu)/(4+3nu): his table, 0.886 and 0.531 at 0.3."""
    circle = CircularSection(1.0, 0.3, radius=1.0)
    assert circle.shear_factors[0] == pytest.approx(7.8 / 8.8)
    thin = TubularSection(1.0, 0.3, radius=1.0, thickness=1e-5)
    # the wall is not infinitely thin
    assert thin.shear_factors[0] == pytest.approx(2.6 / 4.9, rel=1e-4)
    given = CircularSection(1.0, 0.3, radius=1.0, shear_correction=0.9)
    assert given.stiffness[1, 1] == pytest.approx(0.9 * np.pi / 2.6)


def test_shear_modulus_in_place_of_poissons_ratio():
    by_nu, by_G = (
        CircularSection(2.6, 0.3, radius=1.0),
        CircularSection(2.6, None, radius=1.0, G=1.0),
    )
    np.testing.assert_allclose(by_nu.stiffness, by_G.stiffness, rtol=1e-14)
    thick = RectangularSection(1.0, None, width=1.0, height=1.0, G=5.0)
    assert thick.stiffness[1, 1] == pytest.approx(5 * 5 / 6)


def test_offset_by_quadrature():
    """Energy of random strains of the moved section: its axial part integrated point by point."""
    E, b, h, rho, y = 3.0, 0.2, 0.5, 2.0, (0.3, -0.4)
    section = RectangularSection(E, 0.0, width=b, height=h, density=rho, offset=y)
    x, w = np.polynomial.legendre.leggauss(3)
    y2, y3 = (c.ravel() for c in np.meshgrid(y[0] + b / 2 * x, y[1] + h / 2 * x))
    area = np.outer(w, w).ravel() * b * h / 4
    for G1, K2, K3 in np.random.default_rng(0).normal(size=(5, 3)):
        strains = np.array([G1, 0, 0, 0, K2, K3])
        axial = G1 + y3 * K2 - y2 * K3
        assert strains @ section.stiffness @ strains == pytest.approx(E * area @ axial**2)
    m, first, second = section.mass
    np.testing.assert_allclose(m, rho * area.sum())
    np.testing.assert_allclose(first, (rho * area @ y2, rho * area @ y3))
    np.testing.assert_allclose(second, [rho * area @ f for f in (y2 * y2, y2 * y3, y3 * y3)])


def test_offset_twist_shears_the_centroid():
    """A twist K1 about the line moves the centroid by (-y3, y2) K1, against its shear stiffness."""
    plain = RectangularSection(1.0, 0.3, width=0.2, height=0.5)
    moved = RectangularSection(1.0, 0.3, width=0.2, height=0.5, offset=(0.3, -0.4))
    twist = np.array([0, 0.0, 0, 1.0, 0, 0])
    at_centroid = np.array([0, 0.4, 0.3, 1.0, 0, 0])
    expected = at_centroid @ plain.stiffness @ at_centroid
    assert twist @ moved.stiffness @ twist == pytest.approx(expected)
    # rotating the whole about the centroid instead costs the torsion only
    free = np.array([0, -0.4, -0.3, 1.0, 0, 0])
    assert free @ moved.stiffness @ free == pytest.approx(plain.stiffness[3, 3])


def test_general_section():
    section = GeneralSection(
        [1e6, 5e5, 5e5, 10, 20, 30], 2.0, first_moments=(0.1, 0.2), second_moments=(1.0, 0.5, 2.0)
    )
    np.testing.assert_array_equal(section.stiffness, np.diag([1e6, 5e5, 5e5, 10, 20, 30]))
    assert section.mass == (2.0, (0.1, 0.2), (1.0, 0.5, 2.0))
    assert section.size == pytest.approx(np.sqrt(12 * 30 / 1e6))
    assert GeneralSection(section.stiffness, size=0.5).size == 0.5
    assert dataclasses.replace(section) == section
    assert hash(dataclasses.replace(section)) == hash(section)
    assert dataclasses.replace(section, size=1.0) != section
    assert section != 3
    with pytest.raises(ValueError, match="read-only"):
        section.stiffness[0, 0] = 1


def test_general_section_holds_any_coupling():
    shape = RectangularSection(210e9, 0.3, width=1e-3, height=5e-2, density=7800, offset=(0.5, 0.1))
    m, first, second = shape.mass
    section = GeneralSection(shape.stiffness, m, first_moments=first, second_moments=second)
    np.testing.assert_allclose(section.stiffness, shape.stiffness, rtol=1e-14)
