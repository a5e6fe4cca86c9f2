"""Lateral buckling: plate, beam and rod by one another."""

import numpy as np
import pytest

from shellmb.demos.references.beams import lateral_buckling
from shellmb.demos.references.lateral import Strip, beam_critical_load, plate_critical_load, rod_tip

STRIP = Strip(1.0, 0.08, 2e-3, 210e9, 0.25)


def test_stiffnesses_and_load_of_the_papers_plate() -> None:
    """Values of docs/reference/literature.md, examples."""
    assert STRIP.weak == pytest.approx(11.2)
    assert STRIP.torsion == pytest.approx(17.6378, rel=1e-4)
    unit = lateral_buckling() * np.sqrt(STRIP.weak * STRIP.torsion)
    assert unit == pytest.approx(56.40, abs=0.01)
    # the deflection in the plane raises it by (EI + GJ) / (2 EI1)
    ratio = beam_critical_load(STRIP, lateral_buckling()) / unit
    assert ratio - 1 == pytest.approx((11.2 + 17.6378) / 2 / STRIP.strong, rel=1e-2)


def test_the_plate_tends_to_the_beam_as_it_gets_longer() -> None:
    """The clamped edge matters over lengths of the height: its share falls like b/L."""
    excess = []
    for length in (1.0, 2.0, 4.0):
        strip = Strip(length, 0.08, 1e-6, 210e9, 0.25)
        beam = lateral_buckling() * np.sqrt(strip.weak * strip.torsion) / length**2
        excess.append(plate_critical_load(strip) / beam - 1)
    assert excess[0] > excess[1] > excess[2] > 0
    assert excess[1] / excess[2] == pytest.approx(2.0, rel=0.2)


def test_the_plate_by_more_terms() -> None:
    coarse, fine = (plate_critical_load(STRIP, terms) for terms in ((14, 6), (24, 8)))
    # an upper bound that falls
    assert fine < coarse < 1.001 * fine


@pytest.mark.parametrize("wagner", [False, True])
def test_the_rod_leaves_the_plane_behind_the_critical_load(wagner: bool) -> None:
    critical = beam_critical_load(STRIP, lateral_buckling())
    below, _ = rod_tip(STRIP, 0.9 * critical, np.array([0.1, 0.9, 0.05]) * critical, wagner)
    assert abs(below[1]) < 1e-6
    guess = np.cross([0.95, 0.3, -0.1], [0.0, 0.0, -1.1 * critical])
    above, moment = rod_tip(STRIP, 1.1 * critical, guess, wagner)
    assert above[1] > 0.2
    # about the clamped end the force has the moment of the reaction
    place = above + np.array([STRIP.length, 0.0, 0.0])
    np.testing.assert_allclose(
        moment, np.cross(place, [0.0, 0.0, -1.1 * critical]), atol=1e-6 * critical
    )
    square = [rod_tip(STRIP, r * critical, moment, wagner)[0][1] ** 2 for r in (1.01, 1.02)]
    # a pitchfork: the square of the amplitude grows like the load beyond the critical one
    assert square[1] / square[0] == pytest.approx(2.0, rel=0.05)
