"""Impacts: restitution and how long they last, with steps that resolve them and that do not."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from shellmb.scene import (
    Ball,
    Contact,
    Fixed,
    Gravity,
    InitialVelocity,
    Isotropic,
    Plane,
    Prismatic,
    Rectangle,
    Rod,
    Scene,
    Shell,
)
from tests import scenes

from .conftest import MASS, RADIUS, SPEED, STIFFNESS

SCHEMES = [("ep", 0.0), ("ep4", 0.0), ("ed", 1.0), ("ed3", 1.0)]


def _slow(*values: Any) -> Any:
    return pytest.param(*values, marks=pytest.mark.slow)


LASTS = np.pi * np.sqrt(MASS / STIFFNESS)


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_a_ball_bounces_with_restitution_one(scheme, alpha, run, ball) -> None:
    """The half period of an oscillator; a step of 1 ms is 1/31 of it."""
    found = run(ball(scheme, alpha, 1e-3)).history
    last = found.momentum_z.iloc[-1] / (MASS * SPEED)
    if alpha == 0:
        assert abs(last - 1) < 1e-10
    else:
        # (omega dt)^4/72 of the energy of an oscillator in a step, or less: 1e-5 in an impact
        assert 1 - 1e-3 < last <= 1
    deepest = SPEED * np.sqrt(MASS / STIFFNESS)
    assert_allclose(found["floor.penetration"].max(), deepest, rtol=2e-3)
    # to a step at either end
    height = found["floor.penetration"].to_numpy()
    assert abs(np.count_nonzero(height) * 1e-3 - LASTS) < 1.5e-3
    # the impulse is that of the mean forces
    assert_allclose(found["floor.Fz"].iloc[1:].sum() * 1e-3, MASS * SPEED * (1 + last), rtol=1e-9)


@pytest.mark.parametrize(
    ("scheme", "alpha"), [SCHEMES[0], SCHEMES[2], *(_slow(*s) for s in SCHEMES[1::2])]
)
@pytest.mark.parametrize("smoothing", [0.0, _slow(0.01)])
def test_steps_as_long_as_the_impact(scheme, alpha, smoothing, run, ball) -> None:
    """Energy is exact however long the step; the run says that the impact is coarse."""
    result = run(ball(scheme, alpha, 0.03, t_end=0.24, smoothing=smoothing))
    last = result.history.momentum_z.iloc[-1] / (MASS * SPEED)
    assert abs(last - 1) < 1e-10 if alpha == 0 else 0 <= last < 1
    assert any(w.watch == "contact" and "'floor'" in w.says for w in result.warnings)


@pytest.mark.parametrize(
    "obstacle",
    [
        Plane(point=(0, 0, 0), normal=(0.3, 0, 1)),
        Ball((0.02, 0.01, -0.5), 0.5),
        Rod((0.02, 0, -0.5), (0, 1, 0), 0.5),
        Ball((0.1, 0, 1.0), 1.0, inside=True),
        Rod((0.1, 0, 1.0), (0, 1, 0), 1.0, inside=True),
    ],
    ids=["plane", "ball", "rod", "in a ball", "in a rod"],
)
def test_obstacles_keep_the_momenta_that_they_leave_free(obstacle, run, ball) -> None:
    """EP: along a plane, along the axis of a rod, and about its axis or the centre of a ball."""
    start = InitialVelocity(linear=(0.5, 0.3, -SPEED))
    found = run(
        ball("ep", 0.0, 4e-3, t_end=0.4, obstacle=obstacle, initial=start, position=(0, 0, 0.2))
    )
    names = [f"{kind}_{a}" for kind in ("momentum", "angular_momentum") for a in "xyz"]
    p, about = np.split(found.history[names].to_numpy(), 2, axis=1)
    assert np.ptp(p[:, 2]) > MASS * SPEED
    if isinstance(obstacle, Plane):
        along = np.cross(np.cross(obstacle.normal, (1, 0, 0)), obstacle.normal)
        assert np.ptp(p @ along) < 1e-10 and np.ptp(p[:, 1]) < 1e-10
        return
    center = obstacle.center if isinstance(obstacle, Ball) else obstacle.point
    about = about - np.cross(center, p)
    free = range(3) if isinstance(obstacle, Ball) else (1,)
    assert all(np.ptp(about[:, k]) < 1e-10 for k in free)
    if isinstance(obstacle, Rod):
        assert np.ptp(p[:, 1]) < 1e-10


@pytest.mark.parametrize(
    ("scheme", "alpha"), [("ep", 0.0), pytest.param("ep4", 0.0, marks=pytest.mark.slow)]
)
def test_restitution_with_damping(scheme, alpha, run, ball) -> None:
    """`F (1 + chi dp/dt)`: `v dv/(1 + chi v) = -F dp/m` gives the rebound whatever the force."""
    chi = 0.2
    result = run(ball(scheme, alpha, 1e-3, relative_damping=chi, smoothing=0.005))
    end = result.history.iloc[-1]
    rebound = end.momentum_z / MASS

    def fallen(v: float) -> float:
        return v / chi - np.log(1 + chi * v) / chi**2

    assert 0.5 < rebound / SPEED < 0.8
    # EP is of second order, a step 1/31 of the impact: 2.1e-3
    assert_allclose(fallen(-rebound), fallen(SPEED), rtol=4e-3)
    lost = MASS * (SPEED**2 - rebound**2) / 2
    assert_allclose([end["floor.loss"], end.dissipation], lost, rtol=1e-10)


def plate(scheme: str, alpha: float, dt: float, **more: Any) -> Scene:
    """A plate that falls on a plane with one corner first; a bounce takes a few ms."""
    section = Isotropic(70e9, 0.3, thickness=2e-3, density=2700.0)
    return scenes.plate_scene(
        scheme,
        alpha,
        section=section,
        size=(0.4, 0.3),
        mesh=(2, 2),
        contacts=Contact("floor", Plane(point=(0, 0, -0.01), normal=(0.1, 0, 1)), 1e7),
        initial=InitialVelocity(linear=(0.5, 0, -1.0), spin=(1.0, 2.0, 0)),
        dt=dt,
        t_end=25 * dt,
        **more,
    )


@pytest.mark.parametrize(
    ("scheme", "alpha"),
    [*SCHEMES[:1], *(pytest.param(*s, marks=pytest.mark.slow) for s in SCHEMES[1:])],
)
@pytest.mark.parametrize("dt", [2e-3, 8e-3])
def test_a_plate_bounces(scheme, alpha, dt, run) -> None:
    """Rebound and vibration; steps of 8 ms do not resolve the impact of a corner."""
    found = run(plate(scheme, alpha, dt)).history
    energy = found.total_energy
    if alpha == 0:
        assert np.ptp(energy) < 1e-10 * energy.iloc[0]
    assert found.potential_energy.max() > 1e-3 * energy.iloc[0]
    along = found.momentum_x * 1.0 - 0.1 * found.momentum_z
    assert np.ptp(along) < 1e-10 and np.ptp(found.momentum_y) < 1e-10
    assert found.momentum_z.iloc[-1] > 0


def test_static_force_of_a_penetration(run, ball) -> None:
    """Edges and a corner of a plate pressed by a given way: `k (p - s/2)` per length."""
    depth, k, s = 3e-3, 1e6, 1e-3
    section = Isotropic(70e9, 0.3, thickness=0.01, density=2700.0)
    sheet = Shell("sheet", Rectangle(0.4, 0.3), section, mesh=(2, 2))
    held = Fixed(("left", "right", "bottom", "top"), displacement=(0, 0, -depth))
    for on, size in (("left", 0.3), (("left", "right"), 0.6), ("left-bottom", 1.0)):
        contact = Contact("floor", Plane(), k, at=on, smoothing=s)
        scene = Scene("press", shells=sheet, supports=held, contacts=contact, dt=1.0)
        end = run(scene).history.iloc[-1]
        assert_allclose(end["floor.normal"], k * (depth - s / 2) * size, rtol=1e-9)
        energy = k * ((depth - s / 2) ** 2 + s**2 / 12) / 2 * size
        assert_allclose(end["floor.energy"], energy, rtol=1e-9)


def test_radius_of_a_ball_in_the_balance_of_a_weight(run, ball) -> None:
    """Held up by a plane alone, in equilibrium: m g = k p, the radius above."""
    (body,) = ball("ep", 0.0, 1e-3, position=(0, 0, RADIUS - 1e-4)).rigid_bodies
    scene = Scene(
        "rest",
        rigid_bodies=body,
        joints=Prismatic("guide", "ground", "ball", at=body.position, axis=(0, 0, 1)),
        loads=Gravity(),
        contacts=Contact("floor", Plane(), STIFFNESS, radius=RADIUS, preloaded=True),
    )
    end = run(scene).history.iloc[-1]
    assert_allclose(end["floor.penetration"], MASS * 9.81 / STIFFNESS, rtol=1e-9)
    assert_allclose(end["floor.Fz"], MASS * 9.81, rtol=1e-9)
