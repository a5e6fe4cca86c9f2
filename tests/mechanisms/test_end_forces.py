"""Forces at the ends of steps are those whose means over the steps are the scheme's own."""

from dataclasses import replace

import numpy as np
import pytest

from shellmb.running.execute import execute
from shellmb.scene import GROUND, Gravity, Lock, Output, Revolute, RigidBody, Scene

from .test_joints_chain import _everything

ENDS = Output(frames=2, end_forces=True)


@pytest.mark.parametrize(
    ("scheme", "bound"),
    # of second order, and of fourth: a quarter, a sixteenth of it with half the step
    [("ep", 2e-3), pytest.param("ep4", 1e-5, marks=pytest.mark.slow)],
)
def test_all_joints_at_beams_and_shells(scheme: str, bound: float, rod) -> None:
    """Elastic, inertial and constraint forces of all bodies are in them, each by its own form."""
    dt, steps = 2e-4, 8
    scene = replace(_everything(scheme, 0.0, rod), dt=dt, t_end=steps * dt, output=ENDS)
    run = execute(scene)
    names = [name for name in run.rows[0] if name.endswith("_end")]
    assert len(names) == 6 * len(scene.joints)
    end = np.array([run.column(name) for name in names])
    mean = np.array([run.column(name.removesuffix("_end")) for name in names])
    k = np.arange(3, steps)
    # the mean of a cubic through four instants over the middle of its three parts
    cubic = (13 * (end[:, k - 1] + end[:, k]) - (end[:, k - 2] + end[:, k + 1])) / 24
    assert np.abs(cubic - mean[:, k]).max() < bound * np.abs(cubic).max()


def test_a_lock_that_holds_a_weight() -> None:
    """At rest: its torque is that of statics, mean and end alike."""
    scene = Scene(
        "held",
        rigid_bodies=RigidBody("arm", 2.0, (0.01, 0.2, 0.2), com=(0.5, 0, 0)),
        joints=Revolute("pin", GROUND, "arm", at=(0, 0, 0), axis=(0, 1, 0)),
        locks=Lock("pin", (0.0, 1.0)),
        loads=Gravity((0, 0, -10.0)),
        scheme="ep",
        dt=0.01,
        t_end=0.02,
        output=ENDS,
    )
    row = execute(scene).rows[-1]
    # about y, against the weight on the side of positive x
    assert row["pin.lock_torque_end"] == pytest.approx(-10.0, rel=1e-9)
    assert row["pin.lock_torque_end"] == pytest.approx(row["pin.lock_torque"], rel=1e-9)
    assert row["pin.F1_end"] ** 2 + row["pin.F2_end"] ** 2 == pytest.approx(400.0, rel=1e-9)
