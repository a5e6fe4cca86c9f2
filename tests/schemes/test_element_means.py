"""Columns of force elements are the means over a step that the equations of the step have.

The kind: a value at the end of a step where a mean is due. Shown by what only the mean obeys: the
balance of momentum of the step.
"""

import numpy as np
import pytest
import ufl

from shellmb.running.execute import execute
from shellmb.scene import (
    GROUND,
    InitialVelocity,
    JointDamper,
    JointSpring,
    JointStop,
    Motor,
    Output,
    Probe,
    Revolute,
    RigidBody,
    Scene,
)

SCHEMES = [("ep", 0.0), ("ed", 1.0), ("ep4", 0.0), ("ed3", 0.5)]
INERTIA, DT = 0.5, 0.05


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_impulses_of_all_elements(scheme: str, alpha: float) -> None:
    """They change the spin of a wheel by their means times the step, to their signs."""
    scene = Scene(
        "wheel",
        rigid_bodies=RigidBody("wheel", 2.0, (0.3, 0.3, INERTIA)),
        joints=Revolute("hub", GROUND, "wheel", at=(0, 0, 0), axis=(0, 0, 1)),
        force_elements=[
            JointSpring("linear", "hub", 8.0),
            JointSpring("hard", "hub", potential=lambda x: 3 * x**4),
            JointDamper("damper", "hub", 0.2),
            JointStop("stop", "hub", upper=0.3, stiffness=200.0, smoothing=0.05),
            Motor("motor", "hub", law=lambda x, rate, t: ufl.sin(9 * t) - 0.1 * rate),
        ],
        initial=InitialVelocity(spin=(0, 0, 3.0)),
        probes=Probe("spin", "origin", "angular_velocity", 2, body="wheel"),
        output=Output(end_forces=True),
        scheme=scheme,
        alpha=alpha,
        dt=DT,
        t_end=0.6,
    )
    rows = execute(scene).history
    resisting = rows[[f"{name}.torque" for name in ("linear", "hard", "damper", "stop")]]
    mean = rows["motor.torque"] - resisting.sum(axis=1)
    gained = INERTIA * np.diff(rows["spin"])
    # steps of 0.15 rad: velocities of EP and ED at their ends are those that directors allow to the
    # square of that; ep4 and ed3 keep the angular momentum to their order, found 1e-4 and 5e-4
    near = 5e-3 if scheme in ("ep4", "ed3") else 2e-2
    scale = np.abs(gained).max()
    np.testing.assert_allclose(DT * mean[1:], gained, rtol=0, atol=near * scale)
    # values at the ends follow from the coordinate there
    x = rows["hub.rotation"]
    np.testing.assert_allclose(rows["linear.torque_end"][1:], 8 * x[1:], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(rows["hard.torque_end"][1:], 12 * x[1:] ** 3, rtol=1e-9, atol=1e-12)
    # another number than the mean
    assert np.abs(rows["linear.torque_end"] - rows["linear.torque"])[1:].max() > 0.1
