"""Free plate, thrown into a tumbling flight by a pulse of force and moment (EP).

After the pulse nothing acts on the plate any more: energy, linear and angular momentum are
constant, however strongly it bends, and the scheme keeps them so over a thousand steps.
"""

# KIND: vibrations and motion

import numpy as np

from shellmb.scene import (
    EdgeForce,
    EdgeMoment,
    Isotropic,
    Output,
    Probe,
    Rectangle,
    Scene,
    Shell,
    Table,
)

LENGTH, WIDTH = 0.3, 0.06  # [m]
PULSE = 4e-3  # [s]


def scene(force: float = 40.0, moment: float = 1.5, steps: int = 1000, dt: float = 2e-4):
    """The plate.

    Args:
        force: Largest force on an edge [N].
        moment: Largest moment on the other edge [N m].
        steps: Number of time steps.
        dt: Time step [s].
    """
    aluminium = Isotropic(E=70e9, nu=0.3, thickness=1e-3, density=2700.0)
    plate = Shell("plate", Rectangle(LENGTH, WIDTH), aluminium, mesh=(6, 2))
    pulse = Table((0.0, PULSE / 2, PULSE), (0.0, 1.0, 0.0))
    along, across = 0.3 * force / LENGTH, force / WIDTH
    return Scene(
        "tumbling_plate",
        plate,
        loads=(
            EdgeForce("right", (0.2 * across, 0.1 * across, across), time=pulse),
            EdgeForce("top", (0, 0, along), time=pulse),
            EdgeMoment("left", (0, moment / WIDTH, 0), time=pulse),
        ),
        probes=(
            Probe("corner_x", "right-top", component=0),
            Probe("corner_z", "right-top", component=2),
        ),
        scheme="ep",
        dt=dt,
        t_end=steps * dt,
        output=Output(frames=61),
        units="m, kg, s",
    )


def results(run):
    """Measure how well everything is conserved, and how far the plate bends."""
    summary, history = run.summary, run.history
    measured = {
        name: summary[name]
        for name in (
            "energy_balance_error",
            "linear_momentum_drift",
            "angular_momentum_drift",
            "director_max",
        )
    }
    flight = history["t"] > PULSE * (1 + 1e-9)
    if flight.any():
        energy = history["total_energy"][flight]
        measured["energy_variation_in_flight"] = float(np.ptp(energy) / energy.mean())
        measured["strain_energy_share"] = float(np.max(history["strain_energy"][flight] / energy))
    return measured


def check(results):
    """Round-off everywhere; a plate that does not bend would prove nothing."""
    assert results["energy_balance_error"] < 1e-9
    # schemes that do not keep momenta say nothing of them
    for name in ("linear_momentum_drift", "angular_momentum_drift"):
        assert results.get(name, 0.0) < 1e-9
    assert results["energy_variation_in_flight"] < 1e-9
    assert results["director_max"] < 1e-11
    assert results["strain_energy_share"] > 0.05
