"""Damping that is out of all proportion, and a thin damped blade that spins."""

from dataclasses import replace

import numpy as np
import pytest

from shellmb.scene import Clamped, InitialVelocity, Isotropic, PointForce
from shellmb.simulate.simulation import BaseObserver, Simulation
from tests.hard.conftest import SOFT

SLOW = pytest.mark.slow
# of the cantilever, rad/s
LOWEST = 0.203


class Places(BaseObserver):
    """Displacements of all nodes of the plate at the ends of steps."""

    def __init__(self) -> None:
        self.found: list[np.ndarray] = []

    def accepted(self, simulation: Simulation) -> None:
        nodes = simulation.model.shells["plate"].mixed.dofs["u"]
        self.found.append(simulation.problem.levels["plate"].q.x.array[nodes])


@pytest.mark.parametrize(
    ("scheme", "alpha"),
    [("ep", 0.0), *(pytest.param(name, 1.0, marks=SLOW) for name in ("ed", "ed3"))],
)
@pytest.mark.parametrize("speed", [0.2, pytest.param(20.0, marks=SLOW)])
def test_overdamped_plate_creeps_back_in_long_steps(
    scheme, alpha, speed, plate, watch, worst
) -> None:
    # tau w = 200 for the slowest mode, a fifth of its period a step: a blow stops at once, and what
    # it has bent creeps back
    tau, dt = 200 / LOWEST, 0.2 * 2 * np.pi / LOWEST
    watched = watch(
        plate(
            scheme,
            alpha,
            section=replace(SOFT, stiffness_damping=tau),
            supports=Clamped("left"),
            initial=InitialVelocity(linear=(0.0, 0.0, speed)),
            dt=dt,
            t_end=105 * dt,
        ),
        places := Places(),
    )
    watched.check(worst)
    assert watched.rejected == 0
    assert np.all(np.diff(watched.total) < 0)
    if speed < 1:
        # small displacements creep back as exp(-t/tau). In EP velocities alternate meanwhile, as
        # those of stiff vibrations do: the mean of three steps is what creeps, by
        # (1 - dt/(2 tau))/(1 + dt/(2 tau)) a step, which is exp(-dt/tau) to 1e-4
        u = np.array(places.found)
        creeping = np.linalg.norm(u[:-2] + 2 * u[1:-1] + u[2:], axis=1) / 4
        rate = -np.log(creeping[-1] / creeping[5]) / ((len(creeping) - 6) * dt)
        worst("rate of creeping back, off 1/tau", abs(rate * tau - 1), 1e-3)


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
