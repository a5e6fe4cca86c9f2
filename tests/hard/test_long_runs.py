"""100 000 steps without drift of the energy law or of constraints; 1000 of them in CI.

A rod hangs from a ball joint, a soft plate hangs from the rod by a corner and falls from the side:
large rotations, joints, directors and deformations for ever.
"""

import pytest

from shellmb.scene import GROUND, Gravity, Rectangle, RigidBody, Scene, Shell, Spherical
from tests.hard.conftest import EVERY

STEPS = [1_000, pytest.param(100_000, marks=pytest.mark.slow)]
# of rounding errors of either sign, which the largest energy of a fall and the number of steps know
ENERGY = {1_000: 1e-11, 100_000: 1e-9}


@pytest.mark.parametrize("steps", STEPS)
@pytest.mark.parametrize(("scheme", "alpha"), EVERY)
def test_many_steps(scheme: str, alpha: float, steps: int, plate, watch, worst) -> None:
    dt = 0.2
    section = plate("ep", dt=1.0, t_end=1.0).shells[0].section
    scene = Scene(
        "swing",
        Shell("plate", Rectangle(1.0, 0.5, origin=(0.5, 0, 0)), section, mesh=(1, 1)),
        rigid_bodies=RigidBody(
            "rod", 0.1, (1e-4, 2e-3, 2e-3), position=(0.25, 0, 0), points={"tip": (0.25, 0, 0)}
        ),
        joints=[
            Spherical("top", GROUND, "rod", at=(0, 0, 0)),
            Spherical("corner", "rod", "plate", at="tip", second_at="left-bottom"),
        ],
        loads=Gravity((0.0, 0.0, -0.02)),
        scheme=scheme,
        alpha=alpha,
        dt=dt,
        t_end=steps * dt,
    )
    watched = watch(scene)
    watched.check(worst, ENERGY[steps])
    assert watched.simulation.step >= steps
    # chaotic as the motion is, now and then Newton's method wants half a step
    worst("steps that had to be repeated", watched.rejected, steps // 200)
