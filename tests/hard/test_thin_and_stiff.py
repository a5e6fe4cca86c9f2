"""Thickness down to L/100 000, and bodies whose stiffnesses differ by 1e8."""

import numpy as np
import pytest

from shellmb.model.body import constraint_error
from shellmb.scene import (
    GROUND,
    Clamped,
    EdgeForce,
    EdgeMoment,
    InitialVelocity,
    Isotropic,
    Join,
    Prismatic,
    Rectangle,
    RigidBody,
    Scene,
    Shell,
    Spring,
)
from shellmb.simulate.simulation import Simulation
from tests.hard.conftest import EVERY, RIGID

STIFFNESS = 1e-3


def _section(h: float) -> Isotropic:
    """The same bending stiffness and mass per area, whatever the thickness."""
    return Isotropic(E=STIFFNESS / h**3, nu=0.3, thickness=h, density=1 / h)


@pytest.mark.parametrize("h", [1e-3, 1e-5])
def test_strip_rolled_up_in_one_load_step(h: float, worst) -> None:
    """Half a circle by the end moment: membrane stiffness is 1.2e11 that of bending at L/1e5."""
    section = Isotropic(E=STIFFNESS / h**3, nu=0.0, thickness=h)
    moment = np.pi * STIFFNESS / 12
    strip = Shell("strip", Rectangle(1.0, 0.1), section, mesh=(8, 1))
    loads = EdgeMoment("right", (0.0, -moment, 0.0))
    scene = Scene("strip", strip, supports=Clamped("left"), loads=loads, dt=1.0)
    simulation = Simulation(scene)
    simulation.run()
    body = simulation.model.shells["strip"]
    u = simulation.problem.levels["strip"].q.x.array[body.mixed.dofs["u"]].reshape(-1, 3)
    tip = body.mixed.nodes("u")[:, 0] > 1 - 1e-9
    error = np.abs(u[tip] + body.mixed.nodes("u")[tip] * (1, 0, 0) - (0, 0, 2 / np.pi)).max()
    # the tip of the half circle is above the clamp by its diameter; 8 elements of degree 2
    worst("tip off the half circle, over L", float(error), 1e-3)
    worst(
        "unit length of directors", constraint_error(body, simulation.problem.state("strip")), 1e-11
    )
    # it turns directors by more than is safe at once, and is taken in parts; thin or not
    assert simulation.size.rejected == 1 and simulation.step <= 4


@pytest.mark.parametrize(("scheme", "alpha"), EVERY)
def test_thickness_down_to_a_100000th_of_the_length(scheme, alpha, plate, watch, worst) -> None:
    """A plate that swings by a sixth of its length, at steps that resolve bending only."""
    swung = {}
    for h in (1e-3, 1e-5):
        watched = watch(
            plate(
                scheme,
                alpha,
                section=_section(h),
                supports=Clamped("left"),
                loads=EdgeForce("right", (0, 0, 5e-4)),
                dt=0.5,
                t_end=10.0,
            )
        )
        watched.check(worst)
        body = watched.simulation.model.shells["plate"]
        q = watched.simulation.problem.levels["plate"].q.x.array
        swung[h] = float(np.abs(q[body.mixed.dofs["u"]]).max())
    assert swung[1e-3] > 0.15
    # the same thin plate: what differs is the history of membrane waves far above the step
    worst("deflection at L/100000 beside L/1000", abs(swung[1e-5] / swung[1e-3] - 1), 0.02)


@pytest.mark.parametrize(("scheme", "alpha"), EVERY)
@pytest.mark.parametrize("order", ["soft first", "stiff first"])
def test_joined_shells_of_stiffnesses_1_and_1e8(scheme, alpha, order, watch, worst) -> None:
    modulus = (1.0, 1e8) if order == "soft first" else (1e8, 1.0)
    shells = [
        Shell(
            name,
            Rectangle(1.0, 0.5, origin=(x, 0, 0)),
            Isotropic(E=E, nu=0.3, thickness=0.2, density=1.0),
            mesh=(2, 1),
        )
        for name, x, E in zip("ab", (0.0, 1.0), modulus, strict=True)
    ]
    watched = watch(
        Scene(
            "ratio",
            shells,
            joins=Join("a", "b", "right", "left"),
            supports=Clamped("left", body="a"),
            loads=EdgeForce("right", (0, 0, 2e-4), body="b"),
            scheme=scheme,
            alpha=alpha,
            dt=2.0,
            t_end=20.0,
        )
    )
    watched.check(worst)
    assert watched.rejected == 0
    # the whole load is 1e-4 N: it moved by this much
    assert max(watched.given) / 1e-4 > 0.03


@pytest.mark.parametrize(("scheme", "alpha"), RIGID)
def test_springs_of_stiffnesses_1_and_1e8_in_a_row(scheme, alpha, watch, worst) -> None:
    names, x = ("a", "b"), (1.0, 2.0)
    bodies = [
        RigidBody(n, 1.0, (1.0, 1.0, 1.0), position=(p, 0, 0))
        for n, p in zip(names, x, strict=True)
    ]
    guides = [
        Prismatic(f"guide_{n}", GROUND, n, at=(p, 0, 0), axis=(1, 0, 0))
        for n, p in zip(names, x, strict=True)
    ]
    springs = [
        Spring("hard", GROUND, "a", at=(0, 0, 0), second_at=(1, 0, 0), stiffness=1e8),
        Spring("soft", "a", "b", at=(1, 0, 0), second_at=(2, 0, 0), stiffness=1.0),
    ]
    watched = watch(
        Scene(
            "springs",
            rigid_bodies=bodies,
            joints=guides,
            force_elements=springs,
            initial=InitialVelocity(linear=(0.3, 0, 0), body="b"),
            scheme=scheme,
            alpha=alpha,
            dt=0.1,
            t_end=3.0,
        )
    )
    watched.check(worst)
    # the hard spring gives way by 1e-8 of the soft one's stretch, whose frequency is 1 rad/s; the
    # mid-point rule turns by 2 atan(dt/2) a step. The others are of third order at least: dt^3/72 a
    # radian
    x = watched.simulation.problem.levels["rigid bodies"].q.x.array.reshape(-1, 3)[:, 0]
    phase, bound = (60 * np.arctan(0.05), 1e-7) if scheme == "ep" else (3.0, 3 * 0.1**3 / 72)
    worst("motion, of its amplitude", abs(x.max() - 0.3 * np.sin(phase)) / 0.3, bound)
    # the hard spring carries what the soft one does
    moved = np.sort(np.abs(x))[-2]
    worst("hard spring, of its stretch", abs(moved / (1e-8 * x.max()) - 1), 0.05)
