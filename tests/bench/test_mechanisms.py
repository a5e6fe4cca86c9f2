"""Mechanisms of the comparison with other codes: their exact motions, and ours."""

import importlib.util

import numpy as np
import pytest

from tests.bench.peers.dynamics.history import difference
from tests.bench.peers.mechanisms.linkages import STEP, CrankAndCoupler, FourBar
from tests.bench.peers.mechanisms.runs import Exact, ExudynRun, OurRun
from tests.bench.peers.mechanisms.scenes import START


@pytest.mark.parametrize("linkage", [CrankAndCoupler(), FourBar()])
def test_bars_move_as_the_points_of_a_linkage(linkage):
    """Complex steps of points that are found from lengths give the velocities of all centres."""
    points = linkage.points(START + STEP * 1j)
    (x, y), (u, v) = [(np.imag(a) / STEP, np.imag(b) / STEP) for a, b in points]
    crank, coupler, *_ = linkage.bars(START)
    np.testing.assert_allclose(crank.moved, (x / 2, y / 2), atol=1e-14)
    np.testing.assert_allclose(coupler.moved, ((x + u) / 2, (y + v) / 2), atol=1e-14)
    (a, b), (c, d) = linkage.points(START)
    np.testing.assert_allclose(np.hypot(c - a, d - b), linkage.coupler, rtol=1e-14)
    # the coupler turns as its ends move across it
    across = ((c - a) * (v - y) - (d - b) * (u - x)) / linkage.coupler**2
    assert coupler.turned == pytest.approx(across, rel=1e-13)


@pytest.mark.parametrize("name", ["chain3", "slider_crank", "four_bar"])
def test_our_runs_are_near_the_exact_motion(name):
    """Of fourth order: half the step leaves a sixteenth, within a factor of two."""
    truth = Exact(name, 0.0).run()
    errors = [difference(OurRun(name, dt).run(), truth)[0] for dt in (0.02, 0.01)]
    assert errors[0] < 1e-3
    assert 8 < errors[0] / errors[1] < 32


@pytest.mark.skipif(importlib.util.find_spec("exudyn") is None, reason="the extra 'peers'")
@pytest.mark.parametrize("name", ["slider_crank", "heavy_top"])
def test_another_code_has_the_same_mechanism(name):
    found, truth = ExudynRun(name, 1e-4).run(), Exact(name, 0.0).run()
    assert difference(found, truth)[0] < 1e-4


@pytest.mark.skipif(importlib.util.find_spec("exudyn") is None, reason="the extra 'peers'")
def test_another_code_has_the_same_flexible_mechanism():
    """Both converge to one motion: with these steps and meshes 1.4e-4 is left, bending is 0.09."""
    name = "flexible_slider_crank"
    found, ours = ExudynRun(name, 5e-4, finer=2).run(), OurRun(name, 0.01).run()
    rigid = Exact("slider_crank", 0.0).run()
    assert difference(ours, rigid)[0] > 0.05
    assert difference(ours, found)[0] < 1e-3
