"""Pictures: what they are made of, and that they leave the run alone."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from shellmb.observers.files.described import describe
from shellmb.scene import Driver, Revolute, RigidBody, Scene, Spherical
from shellmb.show.plots import ENERGIES, MANY, energies, joint_plots

FREED = """
import gc, weakref
gc.disable()
from shellmb.running.execute import execute
from shellmb.scene import *
arm = RigidBody("arm", 2.0, (0.01, 0.2, 0.2), com=(0.5, 0, 0))
pin = Revolute("pin", "ground", "arm", at=(0, 0, 0), axis=(0, 1, 0))
scene = Scene("pendulum", rigid_bodies=arm, joints=pin, scheme="ep", dt=1e-3, t_end=4e-3,
              loads=Gravity((0, 0, -9.81)), output=Output(frames=2))
run = execute(scene, "out")
kept = weakref.ref(run.simulation)
del run
print("kept" if kept() else "freed")
"""


def test_a_run_is_freed_as_soon_as_nobody_uses_it(tmp_path):
    """Where pictures are drawn as on the other ranks; in a process that imports matplotlib anew."""
    result = subprocess.run(
        [sys.executable, "-c", FREED], cwd=tmp_path, capture_output=True, text=True, timeout=240
    )
    assert result.returncode == 0, result.stderr
    assert (tmp_path / "out" / "energy.png").stat().st_size > 0
    assert result.stdout == "freed\n"


def chain(count):
    """So many pendulums, the first one driven."""
    bodies = [RigidBody(f"b{k}", 1.0, (1, 1, 1), position=(k, 0, 0)) for k in range(count)]
    joints = [Revolute("pin", "ground", "b0", at=(0, 0, 0), axis=(0, 0, 1))]
    joints += [Spherical(f"s{k}", "ground", f"b{k}", at=(k, 0, 0)) for k in range(1, count)]
    drivers = Driver("motor", "pin", rotation=lambda t: t)
    return Scene(
        "chain",
        rigid_bodies=bodies,
        joints=joints,
        drivers=drivers,
        scheme="ep",
        dt=1,
        t_end=2,
        units="mm, t, s",
    )


def history(scene, force, moment):
    """Two steps in which each joint carries `force[k]` and `moment[k]`."""
    nothing = float("nan")
    table = {"t": [0.0, 1.0, 2.0], "pin.rotation": [0.0, 1.0, 2.0]}
    table["motor.torque"] = [nothing, 3.0, -4.0]
    for joint, f, m in zip(scene.joints, force, moment, strict=True):
        for letter, value in (("F", f), ("M", m)):
            table |= {f"{joint.name}.{letter}{k}": [nothing, 0.0, 0.0] for k in (2, 3)}
            table[f"{joint.name}.{letter}1"] = [nothing, value, -value]
    return pd.DataFrame(table)


def test_joints_are_shown_by_unit_without_round_off():
    scene = chain(2)
    plots = joint_plots(history(scene, [2.0, 1e-14], [1e-15, 0.0]), describe(scene), 1.0)
    shown = {plot.label: list(plot.curves) for plot in plots}
    assert shown == {
        "rotation [rad]": ["pin.rotation"],
        "torque [N mm]": ["motor.torque"],
        "|mean force in joint| [N]": ["pin"],
    }
    np.testing.assert_array_equal(plots[-1].curves["pin"], [np.nan, 2.0, 2.0])


def test_of_many_joints_the_largest_are_shown():
    scene = chain(MANY + 3)
    force = np.arange(1.0, MANY + 4)
    plot = joint_plots(history(scene, force, 0 * force), describe(scene), 1.0)[-1]
    assert list(plot.curves) == [f"s{k}" for k in range(3, MANY + 3)]
    assert plot.hidden == 3


@pytest.mark.parametrize("drivers", [True, False])
def test_each_energy_has_its_own_label(drivers):
    """With drivers, their work and that of supports are one curve, and no other is named so."""
    scene = chain(2)
    scene = scene if drivers else replace(scene, drivers=())
    t = np.linspace(0.0, 1.0, 40)
    columns = [*ENERGIES, "energy_balance"]
    table = pd.DataFrame({name: (k + 1.0) * t for k, name in enumerate(columns)} | {"t": t})
    above = energies(table, describe(scene)).axes[0]
    curves = {str(line.get_label()): np.asarray(line.get_ydata()) for line in above.lines}
    supports = "work of supports, drivers" if drivers else "work of supports"
    labels = ENERGIES | {"work_supports": supports}
    assert set(curves) == set(labels.values())
    for name, label in labels.items():
        np.testing.assert_array_equal(curves[label], table[name])
