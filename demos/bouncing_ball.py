"""A ball full of air bounces on the ground and spins (EP): a gas that is shut in, and contact.

A thin rubber ball is pumped up as the motion begins, so that it breathes, and hits smooth ground
while it spins about a slanted axis. Air, skin, contact and motion exchange energy, whose sum stays
to round-off; so does the angular momentum about the vertical line through its middle, because
neither the air nor the ground can exert a moment there.
"""

# KIND: vibrations and motion
# CI: shellmb run bouncing_ball --check --no-pictures

import numpy as np

from shellmb.scene import (
    Contact,
    EnclosedVolume,
    Gas,
    Gravity,
    InitialVelocity,
    Isotropic,
    Output,
    Plane,
    Probe,
    Scene,
    Shell,
    Solver,
    Sphere,
)

RADIUS, THICKNESS, DENSITY = 0.11, 3e-3, 1300.0  # [m], [m], [kg/m^3]
AIR, OUTSIDE, EXPONENT = 1.3e5, 1.0e5, 1.4  # [Pa], [Pa]
GAP, SPEED, SPIN = 5e-3, 1.0, (5.0, 0.0, 20.0)  # [m], [m/s], [rad/s]
E, NU = 1e7, 0.45  # [Pa]
GRAVITY = 9.81  # [m/s^2]


def scene(dt: float = 5e-4, t_end: float = 0.04):
    """The ball.

    Args:
        dt: Time step [s].
        t_end: End of the run [s].
    """
    height = RADIUS + GAP
    ball = Shell(
        "ball",
        Sphere(RADIUS, polar=(0, 180), origin=(0, 0, height)),
        Isotropic(E, NU, thickness=THICKNESS, density=DENSITY),
        mesh=(3, 3),
    )
    # the given velocity is that of the origin: the middle falls straight down
    start = np.array([0.0, 0.0, -SPEED]) - np.cross(SPIN, (0, 0, height))
    return Scene(
        "bouncing_ball",
        ball,
        loads=Gravity((0, 0, -GRAVITY)),
        volumes=EnclosedVolume("air", gas=Gas(AIR, EXPONENT, ambient=OUTSIDE)),
        contacts=Contact("ground", Plane(), stiffness=2e6, radius=THICKNESS / 2, smoothing=1e-3),
        initial=InitialVelocity(tuple(map(float, start)), SPIN),
        probes=Probe("pole_z", "pole", "position", component=2),
        scheme="ep",
        dt=dt,
        t_end=t_end,
        # energies are as exact as each step is solved
        solver=Solver(tolerance=1e-12),
        output=Output(frames=41),
        units="m, kg, s",
    )


def results(run):
    """Measure what changes though it must not, and the bounce."""
    energy = run.column("total_energy") - run.column("work_loads")
    volume, over = run.column("air.volume"), run.column("air.pressure")
    law = (over + OUTSIDE) * volume**EXPONENT / (AIR * volume[0] ** EXPONENT)
    push, up = run.column("ground.Fz")[1:], run.column("momentum_z")
    dt = np.diff(run.column("t"))
    weight = -up[0] / SPEED * GRAVITY
    return {
        "energy_change": float(np.ptp(energy)),
        "gas_energy": float(np.ptp(run.column("air.energy"))),
        "spin_change": float(np.ptp(run.column("angular_momentum_z"))),
        "spin": float(run.column("angular_momentum_z")[0]),
        "gas_law_error": float(np.abs(law - 1).max()),
        "impulse_missing": float(abs(up[-1] - up[0] + weight * dt.sum() - push @ dt)),
        "rebound": float(up[-1] / -up[0]),
        "largest_volume": float(volume.max() / volume[0]),
        "dt": float(dt[0]),
        "breath": _period(run.column("t"), volume),
    }


def _period(t, volume):
    """Mean time from one passage of the mean volume upwards to the next."""
    x = volume - volume.mean()
    k = np.flatnonzero((x[:-1] < 0) & (x[1:] >= 0))
    at = t[k] - x[k] * (t[k + 1] - t[k]) / (x[k + 1] - x[k])
    return float(np.diff(at).mean())


def check(results):
    """Energy, spin, the law of the gas and the impulse of the ground are exact; it bounces."""
    assert results["gas_energy"] > 5.0
    assert results["energy_change"] < 1e-11 * results["gas_energy"]
    assert results["spin_change"] < 1e-13 * results["spin"]
    assert results["gas_law_error"] < 1e-12
    assert results["impulse_missing"] < 1e-11
    # hardly anything is left in the skin, and it leaves the ground
    assert 0.97 < results["rebound"] < 1
    assert 1.1 < results["largest_volume"] < 1.2
    # rho h w^2 = 2 E h/((1 - nu) R^2) + 3 gamma p/R of a thin sphere, and what EP makes of it
    stiffness = 2 * E * THICKNESS / ((1 - NU) * RADIUS**2) + 3 * EXPONENT * AIR / RADIUS
    rate = np.sqrt(stiffness / (DENSITY * THICKNESS))
    period = np.pi * results["dt"] / np.arctan(rate * results["dt"] / 2)
    # amplitudes of 4 % of the radius
    assert abs(results["breath"] / period - 1) < 0.02
