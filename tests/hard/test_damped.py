"""Damping that is out of all proportion, and a thin damped blade that spins."""

from dataclasses import replace

import numpy as np
import pytest

from shellmb.scene import Clamped, InitialVelocity, Isotropic, PointForce
from tests.hard.conftest import SOFT

SLOW = pytest.mark.slow
# of the cantilever, rad/s
LOWEST = 0.203


@pytest.mark.parametrize(
    ("scheme", "alpha"),
    [("ep", 0.0), *(pytest.param(name, 1.0, marks=SLOW) for name in ("ed", "ed3"))],
)
def test_overdamped_plate_creeps_back_in_long_steps(scheme, alpha, plate, watch, worst) -> None:
    # tau w = 200 for the slowest mode, a fifth of its period a step: a blow stops at once, and what
    # it has bent creeps back
    tau, dt = 200 / LOWEST, 0.2 * 2 * np.pi / LOWEST
    watched = watch(
        plate(
            scheme,
            alpha,
            section=replace(SOFT, stiffness_damping=tau),
            supports=Clamped("left"),
            initial=InitialVelocity(linear=(0.0, 0.0, 20.0)),
            dt=dt,
            t_end=105 * dt,
        )
    )
    watched.check(worst)
    assert watched.rejected == 0
    assert np.all(np.diff(watched.total) < 0)
    if alpha:
        # as exp(-t/tau); in EP velocities alternate meanwhile, as those of stiff vibrations do
        rate = -np.log(watched.total[-1] / watched.total[5]) / (100 * dt)
        worst("rate of creeping back, off 1/tau", abs(rate * tau / 2 - 1), 2e-2)


@pytest.mark.parametrize("scheme", ["ep", pytest.param("ep4", marks=SLOW)])
def test_thin_damped_blade_spins(scheme, plate, watch, worst) -> None:
    # a 10000th of its length thick: what bending damps must not see the turn
    thin = Isotropic(E=1e4, nu=0.3, thickness=1e-4, density=1.0, stiffness_damping=0.1)
    spin = InitialVelocity(spin=(0.1, 0.0, 1.0))
    watched = watch(plate(scheme, 0.0, section=thin, initial=spin, dt=0.05, t_end=5.0))
    watched.check(worst)
    total = np.array(watched.total)
    worst("energy lost in the second half of a turn", 1 - total[-1] / total[50], 1e-6)


@pytest.mark.parametrize("scheme", ["ep", pytest.param("ep4", marks=SLOW)])
def test_damped_plate_turns_sixteen_times(scheme, plate, watch, worst) -> None:
    # in steps of 0.1 rad; when it has stretched by what pulls it outwards, nothing is left to damp
    spin = InitialVelocity(spin=(0.0, 0.0, 0.2))
    section = replace(SOFT, stiffness_damping=2.0)
    watched = watch(plate(scheme, 0.0, section=section, initial=spin, dt=0.5, t_end=500.0))
    watched.check(worst)
    total = np.array(watched.total)
    lost = abs(1 - total[-1] / total[len(total) // 2])
    worst("energy lost in the last eight turns", lost, 1e-10)


@pytest.mark.parametrize(
    ("scheme", "alpha"),
    [("ep", 0.0), *(pytest.param(*pair, marks=SLOW) for pair in (("ep4", 0.0), ("ed", 1.0)))],
)
def test_overdamped_thin_plate_tumbles(scheme, alpha, plate, watch, worst) -> None:
    # a 1000th of its length thick, tau w = 1e5 or more: it is struck at a corner, and turns by 0.6
    # rad in a step. It can hardly bend, and does not feel that it turns
    thin = Isotropic(E=1e4, nu=0.3, thickness=1e-3, density=1.0, stiffness_damping=1e6)
    blow = PointForce((1.0, 0.5, 0.0), (0, 0, 1e-3), time=lambda t: float(t < 1.0))
    spin = InitialVelocity(spin=(2.0, 0.3, 1.0))
    more = {"section": thin, "initial": spin, "loads": blow, "dt": 0.1, "t_end": 20.0}
    watched = watch(plate(scheme, alpha, **more))
    watched.check(worst)
    total = np.array(watched.total)
    if not alpha:
        lost = abs(1 - total[-1] / total[len(total) // 2])
        worst("energy lost in the second half", lost, 1e-8)
