"""Two plates meet in the air and part again: contact of a shell with a shell (EP).

A plate turns and flies on another one, which is at rest. The nodes of the first touch the faces
of the second, which bends and is thrown away. Nothing else acts: energy and both momenta are as
before, whatever the step.
"""

# KIND: mechanisms

import numpy as np

from shellmb.scene import (
    Contact,
    Faces,
    InitialVelocity,
    Isotropic,
    Output,
    Rectangle,
    Scene,
    Shell,
    Solver,
)

SIDE, THICKNESS, DENSITY = 0.2, 5e-3, 2700.0  # [m], [m], [kg/m^3]
SPEED, SPIN = 0.5, (0.6, -0.4, 2.0)  # [m/s], [rad/s]
STIFFNESS, SMOOTHING = 1e8, 2e-5  # [N/m^3], [m]


def scene(dt: float = 1e-4, t_end: float = 3.5e-3):
    """A plate that flies on another one.

    Args:
        dt: Time step [s].
        t_end: End of the run [s].
    """
    plate = Isotropic(70e9, 0.3, thickness=THICKNESS, density=DENSITY)
    high = (0.05, 0.03, THICKNESS + 2e-4)
    return Scene(
        "meeting_plates",
        [
            Shell("at rest", Rectangle(SIDE, SIDE), plate, mesh=(3, 3)),
            Shell("flying", Rectangle(SIDE, SIDE, origin=high), plate, mesh=(3, 3)),
        ],
        contacts=Contact(
            "touch",
            Faces("at rest", THICKNESS),
            STIFFNESS,
            "flying",
            radius=THICKNESS / 2,
            smoothing=SMOOTHING,
        ),
        initial=InitialVelocity((0, 0, -SPEED), SPIN, body="flying"),
        scheme="ep",
        dt=dt,
        t_end=t_end,
        solver=Solver(tolerance=1e-11),
        output=Output(frames=41),
        units="m, kg, s",
    )


def results(run):
    """Measure what was stored and given back, and what the impact has changed."""
    energy, stored = run.column("total_energy"), run.column("touch.energy")
    momenta = {
        kind: np.array([run.column(f"{kind}_{a}") for a in "xyz"])
        for kind in ("momentum", "angular_momentum")
    }
    impulse = DENSITY * THICKNESS * SIDE**2 * SPEED
    return {
        "stored": float(stored.max() / energy[0]),
        "stored_at_end": float(stored[-1]),
        "energy_change": float(abs(energy / energy[0] - 1).max()),
        "momentum_change": float(abs(momenta["momentum"].T - momenta["momentum"][:, 0]).max())
        / impulse,
        "angular_momentum_change": float(
            abs(momenta["angular_momentum"].T - momenta["angular_momentum"][:, 0]).max()
        )
        / (impulse * SIDE),
        "thrown": float((run.column("touch.Fz")[1:] * np.diff(run.column("t"))).sum() / impulse),
        "depth": float(run.column("touch.penetration").max()),
        "energy_balance_error": run.summary["energy_balance_error"],
    }


def check(results):
    """Both have parted, and energy and momenta are as before."""
    assert results["stored"] > 0.05
    assert results["stored_at_end"] == 0
    assert results["energy_change"] < 1e-10
    assert results["momentum_change"] < 1e-11
    assert results["angular_momentum_change"] < 1e-11
    # of masses alone that meet without loss it would be one
    assert 0.3 < results["thrown"] < 1
    assert 1e-5 < results["depth"] < THICKNESS / 5
    assert results["energy_balance_error"] < 1e-10
