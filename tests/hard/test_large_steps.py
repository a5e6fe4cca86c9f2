"""Steps a thousand times the longest period: no blow-up, and ED decays."""

import numpy as np
import pytest

from shellmb.scene import Clamped, EdgeForce, InitialVelocity
from tests.hard.conftest import EVERY, LATER

# 3.516 sqrt(E I / (m L^4)) of the cantilever is 0.203 rad/s
LONGEST = 2 * np.pi / 0.203
# of the mesh of 2 x 1 elements, whose highest frequency is about 20 rad/s
SHORTEST = 2 * np.pi / 20
SCHEMES = [("ep", 0.0), ("ed", 0.0), ("ed", 0.5), ("ed", 1.0), *LATER]
STEPS = 20


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_swung_cantilever_in_steps_of_1000_longest_periods(
    scheme, alpha, plate, watch, worst
) -> None:
    dt = 1e3 * LONGEST
    watched = watch(
        plate(
            scheme,
            alpha,
            supports=Clamped("left"),
            initial=InitialVelocity(linear=(0.0, 0.0, 0.05)),
            dt=dt,
            t_end=STEPS * dt,
        )
    )
    watched.check(worst)
    # EP4 damps nothing and has two states to find in a step: 7 of its steps take halves
    assert watched.rejected <= (STEPS if scheme == "ep4" else 0)
    left = watched.total[-1] / watched.total[0]
    if alpha:
        # two steps do; (1 - alpha)/(1 + alpha) is the ratio of amplitudes in each
        worst("energy left in ED with alpha > 0, of 1", left, 1e-12)
    else:
        worst("change of energy in EP and ED with alpha = 0, of 1", abs(left - 1), 1e-9)


@pytest.mark.parametrize(("scheme", "alpha"), EVERY)
def test_sudden_load_in_steps_of_1000_longest_periods(scheme, alpha, plate, watch, worst) -> None:
    """The load carries the tip a quarter of the length; ED with alpha > 0 comes to rest there."""
    dt = 1e3 * LONGEST
    watched = watch(
        plate(
            scheme,
            alpha,
            supports=Clamped("left"),
            loads=EdgeForce("right", (0, 0, 5e-4)),
            dt=dt,
            t_end=STEPS * dt,
        )
    )
    watched.check(worst)
    assert watched.rejected == 0
    if alpha:
        kinetic = watched.energy.values["kinetic_energy"] / watched.energy.largest
        worst("kinetic energy left at the equilibrium, of the largest", kinetic, 1e-9)


@pytest.mark.parametrize(("scheme", "alpha"), EVERY)
def test_free_plate_in_steps_of_1000_shortest_periods(scheme, alpha, plate, watch, worst) -> None:
    """It turns by 1.6 rad in a step, about an axis that is none of its own."""
    dt = 1e3 * SHORTEST
    watched = watch(
        plate(
            scheme,
            alpha,
            initial=InitialVelocity(linear=(1e-3, -2e-3, 3e-3), spin=(3e-3, 4e-3, -2e-3)),
            dt=dt,
            t_end=STEPS * dt,
        )
    )
    watched.check(worst)
