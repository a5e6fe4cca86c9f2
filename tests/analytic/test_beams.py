"""Closed forms of strips and beams."""

import math

import numpy as np
import pytest

from shellmb.analytic import beams
from shellmb.verify import tables


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
    assert along == pytest.approx(0.0, abs=1e-11)
    assert beams.roll_up(0.0, 2.0, 3.0) == (0.0, 0.0)


def test_cantilevers() -> None:
    assert beams.cantilever_end_force(2.0, 5.0, 3.0) == pytest.approx(2 * 27 / 15)
    assert beams.cantilever_end_force(2.0, 5.0, 3.0, 7.0) == pytest.approx(2 * 27 / 15 + 6 / 7)
    assert beams.cantilever_uniform(2.0, 5.0, 3.0) == pytest.approx(2 * 81 / 40)
    assert beams.cantilever_uniform(2.0, 5.0, 3.0, 7.0) == pytest.approx(2 * 81 / 40 + 9 / 7)


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
    np.testing.assert_allclose(beams.wave_numbers(ends, 4), expected, atol=5.1e-9)


def test_high_modes_do_not_overflow() -> None:
    roots = beams.wave_numbers("clamped-free", 400)
    np.testing.assert_allclose(roots[-1], 399.5 * math.pi, rtol=1e-14)


def test_strip_of_ten_hertz() -> None:
    """The cantilever of Sze et al. 3.1 with rho = 3.1314e-4 (MBDyn's dynamic version of it)."""
    EI, mass = 1.2e6 * 0.1**3 / 12, 3.1314e-4 * 0.1
    omega = beams.beam_frequencies("clamped-free", 1, EI, 10.0, mass)
    assert omega[0] / (2 * math.pi) == pytest.approx(10.0, rel=1e-4)
