"""Moments at nodes of shells: pure bending, the impulse they give, the work that is booked."""

import math
from typing import Any

import numpy as np
import pytest

from shellmb.running.execute import execute
from shellmb.scene import (
    Clamped,
    EdgeMoment,
    Isotropic,
    Load,
    PointMoment,
    Probe,
    Rectangle,
    Scene,
    Shell,
)


def across(moment: float, **more: Any) -> list[Load]:
    """Moments about y at the three nodes of the right edge, in the weights of a uniform one."""
    nodes = {"right-bottom": 1 / 6, (1.0, 0.5, 0.0): 4 / 6, "right-top": 1 / 6}
    return [PointMoment(node, (0.0, share * moment, 0.0), **more) for node, share in nodes.items()]


def strip(loads: Any, thickness: float = 0.1, **more: Any) -> Scene:
    """A strip of unit length and width without lateral contraction."""
    section = Isotropic(E=1.2e4, nu=0.0, thickness=thickness, density=2.0)
    shell = Shell("strip", Rectangle(1.0, 1.0), section, mesh=(16, 1))
    probes = [
        Probe("x", (1.0, 0.5, 0.0), component=0),
        Probe("z", (1.0, 0.5, 0.0)),
        Probe("M", (0.5, 0.5, 0.0), "bending", 0),
    ]
    return Scene("strip", shell, loads=loads, probes=probes, **more)


def test_end_moments_bend_a_strip_into_half_a_circle() -> None:
    thin = 0.01  # what bending stretches the middle by goes with the square of it
    moment = math.pi * 1.2e4 * thin**3 / 12
    held = {"thickness": thin, "supports": Clamped("left"), "dt": 0.5}
    found = []
    for loads in (across(-moment), EdgeMoment("right", (0, -moment, 0))):
        last = execute(strip(loads, **held)).history.iloc[-1]
        found.append(last[["x", "z", "M"]].to_numpy(float))
    # weights of the edge's own shape functions: the same load
    assert np.allclose(*found, rtol=1e-9)
    # sixteen quadratic elements over half a circle
    assert np.allclose(found[0][:2], (-1.0, 2 / math.pi), rtol=0, atol=2e-3)
    assert abs(found[0][2]) == pytest.approx(moment, rel=1e-3)


# ED and ed3 keep account of angular momentum to their order, whatever acts: fine steps, and a bound
# of twice what was found for a moment and for edge forces that turn the strip alike
EXACT = {
    ("ep", 0.0): (0.1, 1e-9),
    ("ed", 0.0): (0.025, 1e-3),
    ("ed", 0.5): (0.025, 3e-2),
    ("ep4", 0.0): (0.1, 1e-5),
    ("ed3", 0.5): (0.05, 5e-5),
}


@pytest.mark.parametrize(("scheme", "alpha"), EXACT)
def test_free_strip_gets_the_impulse_and_the_work(scheme: str, alpha: float) -> None:
    """A free strip turned by a constant moment: `L = M t`; the work is what its energies gain."""
    moment, t_end = 0.02, 2.0
    dt, bound = EXACT[scheme, alpha]
    scene = strip(across(moment), scheme=scheme, alpha=alpha, dt=dt, t_end=t_end)
    result = execute(scene)
    last = result.history.iloc[-1]
    assert result.summary["energy_balance_error"] < 1e-9
    assert last["angular_momentum_y"] == pytest.approx(moment * t_end, rel=bound)
    # nearly what a rigid strip would have
    inertia = 2.0 * 0.1 * (1 + 0.1**2) / 12
    assert last["work_loads"] == pytest.approx((moment * t_end) ** 2 / (2 * inertia), rel=0.1)
