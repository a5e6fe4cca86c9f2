"""A plate falls on the ground, edge first, and bounces (EP): contact that conserves energy.

A square plate of aluminium spins about its diagonal as it falls. Its edges hit the ground one after
the other, it bends, and what it loses of height it has in vibrations and spin: the sum of all
energies stays what it was to round-off, though a step of 0.5 ms hardly resolves the impacts. The
ground is smooth: along it the plate keeps its momentum.
"""

# KIND: vibrations and motion
# CI: shellmb run bouncing_plate --set t_end=0.15 --check --no-pictures

import numpy as np

from shellmb.scene import (
    Contact,
    Gravity,
    InitialVelocity,
    Isotropic,
    Output,
    Plane,
    Probe,
    Rectangle,
    Scene,
    Shell,
    Solver,
)

SIDE, THICKNESS, DENSITY = 0.3, 2e-3, 2700.0  # [m], [kg/m^3]
HEIGHT, GRAVITY = 0.1, 9.81  # [m], [m/s^2]
AHEAD, SPIN = 0.5, 4.0  # [m/s], [rad/s]
MASS = SIDE**2 * THICKNESS * DENSITY
# what is there at the start, above the ground [J]: of the spin about a diagonal, too
ENERGY = MASS * (GRAVITY * HEIGHT + AHEAD**2 / 2 + SPIN**2 * (SIDE**2 + THICKNESS**2) / 24)


def scene(dt: float = 5e-4, t_end: float = 0.4):
    """The plate.

    Args:
        dt: Time step [s].
        t_end: End of the run [s].
    """
    plate = Shell(
        "plate",
        Rectangle(SIDE, SIDE, origin=(0, 0, HEIGHT)),
        Isotropic(70e9, 0.33, thickness=THICKNESS, density=DENSITY),
        mesh=(3, 3),
    )
    spin = SPIN / np.sqrt(2) * np.array([1.0, 1.0, 0.0])
    # the given velocity is that of the origin: the middle moves ahead
    middle = np.array([SIDE / 2, SIDE / 2, HEIGHT])
    start = np.array([AHEAD, 0.0, 0.0]) - np.cross(spin, middle)
    return Scene(
        "bouncing_plate",
        plate,
        loads=Gravity((0, 0, -GRAVITY)),
        contacts=Contact("ground", Plane(), stiffness=1e8, radius=THICKNESS / 2, smoothing=1e-4),
        initial=InitialVelocity(tuple(map(float, start)), tuple(map(float, spin))),
        probes=Probe("corner_z", "left-bottom", "position", component=2),
        scheme="ep",
        dt=dt,
        t_end=t_end,
        # energies are as exact as each step is solved
        solver=Solver(tolerance=1e-12),
        output=Output(frames=81),
        units="m, kg, s",
    )


def results(run):
    """Measure what is left of energy and momentum, and how deep the ground gives way."""
    energy = run.column("total_energy") - run.column("work_loads")
    ahead, across = run.column("momentum_x"), run.column("momentum_y")
    push, dt = run.column("ground.Fz")[1:], np.diff(run.column("t"))
    up = run.column("momentum_z")
    return {
        "energy": float(energy[0] + MASS * GRAVITY * HEIGHT),
        "energy_change": float(np.ptp(energy)),
        "momentum_change": float(max(np.ptp(ahead), np.ptp(across))),
        "impulse_missing": float(abs(up[-1] - up[0] + MASS * GRAVITY * dt.sum() - push @ dt)),
        "deepest": float(run.column("ground.penetration").max()),
        "highest_contact_energy": float(run.column("ground.energy").max()),
        "highest_strain_energy": float(run.column("strain_energy").max()),
    }


def check(results):
    """Energy, momentum along the ground, and the impulse of the ground, all exact."""
    assert abs(results["energy"] / ENERGY - 1) < 1e-9
    assert results["energy_change"] < 1e-10 * ENERGY
    assert results["momentum_change"] < 1e-10 * MASS
    assert results["impulse_missing"] < 1e-9
    # it has been pushed, and bends
    assert results["highest_contact_energy"] > 0.01 * ENERGY
    assert results["highest_strain_energy"] > 0.05 * ENERGY
    assert 0 < results["deepest"] < 3e-3
