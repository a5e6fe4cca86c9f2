"""Closed forms of strips and beams."""

import math

import numpy as np
import pytest

from shellmb.demos.references import beams
from shellmb.demos.verification import tables
from tests.analytic import solutions


def test_roll_up_table() -> None:
    """Sze, Liu & Lo (2004) sec. 3.2, columns of the exact solution, printed to 1e-3."""
    EI, L = 1.2e6 * 0.1**3 / 12, 12.0
    table = tables.curve("sze32_cantilever_moment")
    tips = [beams.roll_up(f * 2 * math.pi * EI / L, EI, L) for f in table.load]
    along, across = np.array(tips).T
    np.testing.assert_allclose(-along, table.values["minus_U_tip_exact"], atol=5.1e-4)
    np.testing.assert_allclose(across, table.values["W_tip_exact"], atol=5.1e-4)


def test_roll_up_of_a_small_moment_is_linear() -> None:
    along, across = beams.roll_up(1e-6, 2.0, 3.0)
    assert across == pytest.approx(1e-6 * 3.0**2 / (2 * 2.0), rel=1e-9)
    # L theta^2 / 6 with theta = 1.5e-6, not round-off
    assert along == pytest.approx(0.0, abs=1e-11)
    assert beams.roll_up(0.0, 2.0, 3.0) == (0.0, 0.0)


def test_cantilevers() -> None:
    assert beams.cantilever_end_force(2.0, 5.0, 3.0) == pytest.approx(2 * 27 / 15)
    assert beams.cantilever_end_force(2.0, 5.0, 3.0, 7.0) == pytest.approx(2 * 27 / 15 + 6 / 7)
    assert solutions.cantilever_uniform(2.0, 5.0, 3.0) == pytest.approx(2 * 81 / 40)
    assert solutions.cantilever_uniform(2.0, 5.0, 3.0, 7.0) == pytest.approx(2 * 81 / 40 + 9 / 7)


@pytest.mark.parametrize(
    ("ends", "expected"),
    [
        ("clamped-free", [1.87510407, 4.69409113, 7.85475744, 10.99554073]),
        ("free-free", [4.73004074, 7.85320462, 10.99560784, 14.13716549]),
        ("clamped-clamped", [4.73004074, 7.85320462, 10.99560784, 14.13716549]),
        ("hinged-hinged", [math.pi, 2 * math.pi, 3 * math.pi, 4 * math.pi]),
    ],
)
def test_wave_numbers(ends: beams.Ends, expected: list[float]) -> None:
    np.testing.assert_allclose(solutions.wave_numbers(ends, 4), expected, atol=5.1e-9)


def test_high_modes_do_not_overflow() -> None:
    roots = solutions.wave_numbers("clamped-free", 400)
    np.testing.assert_allclose(roots[-1], 399.5 * math.pi, rtol=1e-14)


def test_strip_of_ten_hertz() -> None:
    """The cantilever of Sze et al. 3.1 with rho = 3.1314e-4 (MBDyn's dynamic version of it)."""
    EI, mass = 1.2e6 * 0.1**3 / 12, 3.1314e-4 * 0.1
    omega = solutions.beam_frequencies("clamped-free", 1, EI, 10.0, mass)
    assert omega[0] / (2 * math.pi) == pytest.approx(10.0, rel=1e-4)


def test_lateral_buckling() -> None:
    """Timoshenko & Gere (1961) art. 6.3: 4.013.

    docs/reference/literature.md, tops and frames.
    """
    free, held = beams.lateral_buckling(), beams.lateral_buckling(held=True)
    assert free == pytest.approx(4.013, abs=5e-4)
    assert free == pytest.approx(4.01288, rel=1e-4)
    assert held == pytest.approx(6.98392, rel=4e-4)


@pytest.mark.parametrize("ends", ["clamped-free", "clamped-clamped", "free-free", "hinged-hinged"])
def test_timoshenko_tends_to_the_slender_beam(ends: beams.Ends) -> None:
    slender = solutions.beam_frequencies(ends, 4, 2.0, 3.0, 0.7)
    stiff = beams.timoshenko_frequencies(ends, 4, 2.0, 3.0, 0.7, math.inf)
    # to the tolerance of the search for roots
    np.testing.assert_allclose(stiff, slender, rtol=1e-10)
    soft = beams.timoshenko_frequencies(ends, 4, 2.0, 3.0, 0.7, 50.0, 0.01)
    assert (soft < slender).all()


def test_timoshenko_hinged_is_a_quadratic() -> None:
    """Each wave sin(n pi x / L) has the roots of a quadratic."""
    EI, L, m, S, J = 2.0, 3.0, 0.7, 50.0, 0.01
    found = beams.timoshenko_frequencies("hinged-hinged", 5, EI, L, m, S, J)
    for n, omega in enumerate(found, start=1):
        k2 = (n * math.pi / L) ** 2
        # (S k2 - m w^2) (EI k2 + S - J w^2) = S^2 k2
        roots = np.roots([m * J, -(m * (EI * k2 + S) + J * S * k2), S * k2 * EI * k2])
        assert omega == pytest.approx(math.sqrt(roots.min()), rel=1e-10)


def test_timoshenko_cantilever_above_dunkerleys_bound() -> None:
    """Dunkerley: bending alone and shear alone bound the first frequency from below, closely."""
    found = beams.timoshenko_frequencies("clamped-free", 1, 1.0, 1.0, 1.0, 40.0)[0]
    bending, shear = (
        solutions.beam_frequencies("clamped-free", 1, 1, 1, 1)[0],
        math.pi / 2 * 40**0.5,
    )
    bound = (bending**-2 + shear**-2) ** -0.5
    assert bound < found < 1.02 * bound
