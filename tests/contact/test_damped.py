"""Damped contact pushes or lets go, however fast it opens, and its damping only takes energy.

The kind: a damper beside a spring, which pulls where a body leaves faster than the spring does. The
damping here is so strong that the force would change its sign soon.
"""

from typing import Any

import numpy as np
import pytest

from shellmb.running.execute import execute
from shellmb.scene import (
    GROUND,
    Ball,
    Contact,
    InitialVelocity,
    JointStop,
    Plane,
    PointForce,
    Prismatic,
    RigidBody,
    Scene,
)

SLOW = pytest.mark.slow
SCHEMES = [
    ("ep", 0.0),
    ("ed", 1.0),
    *(pytest.param(*s, marks=SLOW) for s in (("ep4", 0.0), ("ed3", 1.0))),
]
BODY = RigidBody("ball", 2.0, (0.1, 0.1, 0.1))
# in a well of 0.1 m at a speed of 3 m/s `chi dp/dt` is up to 15
CHI, K, DEEP = 5.0, 2e4, 0.02


def pulled(scheme: str, alpha: float, **more: Any) -> Scene:
    """Pressed into an obstacle at the start, and drawn out of it ever faster."""
    away = PointForce((0, 0, 0), (0, 0, 4e3), time=lambda t: 50 * t)
    return Scene(
        "pulled",
        rigid_bodies=BODY,
        loads=away,
        initial=InitialVelocity(linear=(0, 0, -1.0)),
        scheme=scheme,
        alpha=alpha,
        dt=1e-3,
        t_end=0.04,
        **more,
    )


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
@pytest.mark.parametrize(
    "obstacle", [Plane(point=(0, 0, DEEP)), Ball((0, 0, DEEP - 1.0), 1.0)], ids=["plane", "ball"]
)
def test_contact_never_pulls(obstacle: Any, scheme: str, alpha: float) -> None:
    floor = Contact("floor", obstacle, K, relative_damping=CHI, preloaded=True)
    found = execute(pulled(scheme, alpha, contacts=floor))
    force, depth = found.column("floor.Fz")[1:], found.column("floor.penetration")
    assert depth[0] == pytest.approx(DEEP) and depth[-1] == 0.0
    size = np.abs(force).max()
    assert size > K * DEEP
    # in EP4 and ED3 damping takes the push in the middle of a step, and the push is a mean: they
    # differ in the step in which contact ends; otherwise it is round-off
    assert force.min() > -(1e-3 if scheme in ("ep4", "ed3") else 1e-9) * size
    lost = found.column("floor.loss")
    assert np.all(np.diff(lost) > -1e-12 * lost[-1]) and lost[-1] > 1.0
    assert found.summary["energy_balance_error"] < 1e-10
    # the impulses are what momentum is: of the load 4e3 * 50 t^2/2, at the means of steps
    steps = np.diff(found.column("momentum_z"))
    t = 1e-3 * (np.arange(len(steps)) + 0.5)
    np.testing.assert_allclose(steps / 1e-3 - 2e5 * t, force, atol=1e-6 * size)


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_stops_never_pull(scheme: str, alpha: float) -> None:
    rail = Prismatic("rail", GROUND, "ball", at=(0, 0, 0), axis=(0, 0, 1))
    stop = JointStop("stop", "rail", lower=-1e-9, stiffness=K, relative_damping=CHI)
    found = execute(pulled(scheme, alpha, joints=rail, force_elements=stop))
    steps = np.diff(found.column("momentum_z"))
    t = 1e-3 * (np.arange(len(steps)) + 0.5)
    force = steps / 1e-3 - 2e5 * t
    size = np.abs(force).max()
    assert size > 10.0 and force.min() > -(1e-2 if scheme in ("ep4", "ed3") else 1e-6) * size
    # it was left behind fast enough to be pulled, had it been a damper
    assert found.column("momentum_z")[-1] > 2 * 1.0
    work = found.column("work_terms")
    assert found.summary["energy_balance_error"] < 1e-10
    assert np.all(np.diff(work - found.column("dissipation")) < 1e-12 * 2e5)
