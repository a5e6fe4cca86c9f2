"""One plate split in two that are coupled: the whole, to round-off; or the energy that it makes.

The kind: any two motions that share nodes, forces and moments being inputs and places outputs.
"""

import numpy as np
import pytest

import shellmb as sm
from shellmb.demos.coupled_halves import DT, Half, Implicit, explicit, halves, off, plate


def test_implicitly_coupled_halves_are_the_whole() -> None:
    """In EP, whose steps have no states in between at which the halves would have to meet, too."""
    coupled, whole = Implicit(), sm.SceneMotion(plate())
    for step in range(5):
        coupled.step()
        whole.trial(DT)
        whole.accept()
        assert off(coupled, whole) < 1e-12
        assert np.abs(whole.nodes("plate").displacement).max() > 1e-4 * (step + 1)
    one, two = (half.motion.outputs for half in coupled.halves)
    for name in ("total_energy", "dissipation"):
        assert one[name] + two[name] == pytest.approx(whole.outputs[name], rel=1e-10, abs=1e-14)
    # what one puts in the other gets: coupling makes no energy
    assert abs(one["work_inputs"]) > 1e-3 * one["total_energy"]
    assert one["work_inputs"] + two["work_inputs"] == pytest.approx(0.0, abs=1e-12)


def test_explicit_coupling_shows_the_energy_it_makes() -> None:
    """Of first order in the step, while each side closes its own balance."""
    assert explicit(DT) / explicit(DT / 2) == pytest.approx(2.0, rel=0.15)
    half: Half = halves()[0]
    for k in range(4):
        half.tried(np.full(15, 0.1 * k))
        half.motion.accept()
    assert abs(half.motion.outputs["energy_balance"]) < 1e-12
