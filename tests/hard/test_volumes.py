"""Volumes that shells enclose, in steps that are far too long for what happens in them."""

import numpy as np
import pytest

from shellmb.observers.account.energy import EnergyAccount
from shellmb.observers.account.momentum import Momentum
from shellmb.scene import (
    EnclosedVolume,
    Gas,
    InitialVelocity,
    Isotropic,
    Scene,
    Shell,
    Solver,
    Sphere,
)

STEEL = Isotropic(210e9, 0.3, thickness=2e-3, density=7850.0)
RUBBER = Isotropic(2e6, 0.45, thickness=2e-3, density=1100.0)
AIR = 1e5
# rad
TURN = 0.1
# skin, what fills it, and the step
BALLS = {
    # 100 bar; a step is half the period in which a thin ball breathes, 0.44 ms
    "steel": (STEEL, Gas(1e7, ambient=AIR), 2e-4),
    # 100 mbar above that outside blow it up to 1.2 times its volume within 5 ms
    "rubber": (RUBBER, Gas(1.1e5, ambient=AIR), 5e-4),
    # a liquid does not let the volume change at all
    "liquid": (RUBBER, None, 2e-3),
}
CASES = [
    pytest.param(
        *scheme, ball, marks=[] if ball == "rubber" and scheme[0] == "ep" else pytest.mark.slow
    )
    for scheme in (("ep", 0.0), ("ed", 1.0), ("ep4", 0.0), ("ed3", 1.0))
    for ball in BALLS
]


@pytest.mark.parametrize(("scheme", "alpha", "ball"), CASES)
def test_filled_balls_fly_and_spin(scheme, alpha, ball, watch, worst) -> None:
    """They move by 0.07 to 0.7 of their radius in a step."""
    skin, gas, dt = BALLS[ball]
    account = EnergyAccount()
    momenta = Momentum(account)
    spin = TURN / dt * np.array([1.0, 2.0, -1.0]) / np.sqrt(6)
    watched = watch(
        Scene(
            "ball",
            Shell("ball", Sphere(0.3, polar=(0, 180)), skin, mesh=(2, 2)),
            volumes=EnclosedVolume("inside", gas=gas),
            initial=InitialVelocity((100.0, -30.0, 20.0), tuple(map(float, spin))),
            solver=Solver(tolerance=1e-11),
            scheme=scheme,
            dt=dt,
            t_end=20 * dt,
            **({"alpha": alpha} if alpha else {}),
        ),
        account,
        momenta,
    )
    watched.check(worst)
    if not alpha:
        change = np.ptp(watched.total) / watched.energy.largest
        worst("change of energy in EP and EP4, of the largest", change, 1e-9)
    for kind in ("momentum", "angular momentum") if scheme == "ep" else ("momentum",):
        size = np.linalg.norm(momenta.values[kind])
        worst(f"{kind} drift, of 1", momenta.drift[kind] / size, 1e-10)
