"""Natural strains that come and go at once, in steps that do not land on it."""

from typing import Any

import numpy as np
import pytest

from shellmb.observers.account.energy import EnergyAccount
from shellmb.observers.account.momentum import Momentum
from shellmb.scene import (
    Beam,
    BeamNaturalStrain,
    InitialVelocity,
    Line,
    NaturalStrain,
    RectangularSection,
    Scene,
)
from tests.hard.conftest import EVERY

# with the spin a step turns the bodies by 0.1 rad
STEP, END, SPIN = 0.1, 4.0, (0.5, -0.6, 0.6)


def shock(t: float) -> float:
    """On and off, seven times, never where a step ends."""
    return float(np.floor(t / 0.5771) % 2)


# at the faces they are 14 %
@pytest.mark.filterwarnings("ignore:.*natural strain at the faces reaches")
@pytest.mark.parametrize(("scheme", "alpha"), EVERY)
@pytest.mark.parametrize("body", ["quad", "tri", "beam"])
def test_heat_that_is_switched_in_a_spin(scheme, alpha, body, plate, watch, worst) -> None:
    """Strains of 5 %, and curvatures that bend the length of the body by 0.5 rad."""
    moving: dict[str, Any] = {
        "initial": InitialVelocity((0.1, 0.2, -0.3), SPIN),
        "dt": STEP,
        "t_end": END,
    }
    if body == "beam":
        section = RectangularSection(E=1.0, nu=0.3, width=0.3, height=0.2, density=1.0)
        natural = BeamNaturalStrain(0.05, (0.2, 0.5, -0.3), shock)
        rod = Beam("rod", Line((0, 0, 0), (1, 0, 0)), section, elements=2, natural=natural)
        scene = Scene("rod", beams=rod, scheme=scheme, alpha=alpha, **moving)
    else:
        heat = NaturalStrain((0.05, 0.02, 0.03), (0.5, -0.3, 0.2), shock)
        scene = plate(scheme, alpha, cell=body, natural=heat, **moving)
    account = EnergyAccount()
    momentum = Momentum(account)
    watched = watch(scene, account, momentum)
    watched.check(worst)
    drifting = ("momentum", "angular momentum") if scheme == "ep" else ("momentum",)
    for kind in drifting:
        size = np.linalg.norm(momentum.values[kind])
        worst(f"{kind} drift, of 1", momentum.drift[kind] / size, 1e-10)
    # heat did work
    assert np.ptp(watched.given) > 1e-3 * watched.energy.largest
