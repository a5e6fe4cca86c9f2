"""What cannot go on says so: which field or joint, at what time, why.

More of these are elsewhere: Newton's method that does not converge in `simulate/test_control.py`,
redundant, contradictory and open joints at the start in `mechanisms/test_start.py`, what a failed
run leaves in `run/test_execute.py`, the words of the solver in `system/test_block_system.py`.
"""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from shellmb.errors import ConvergenceError, SceneError, ShellmbError
from shellmb.scene import (
    GROUND,
    Clamped,
    Driver,
    EdgeForce,
    Fixed,
    InitialVelocity,
    Revolute,
    RigidBody,
    Scene,
    Spherical,
    StepControl,
    Universal,
)
from shellmb.simulate.simulation import Simulation

Z = (0.0, 0.0, 1.0)
Point = tuple[float, float, float]


def _fails(scene: Scene) -> tuple[ShellmbError, float]:
    """The error, and the time it names."""
    with pytest.raises(ShellmbError) as caught:
        Simulation(scene).run()
    found = re.search(r"t = ([-+0-9.e]+)", str(caught.value))
    assert found, str(caught.value)
    return caught.value, float(found.group(1))


def _bar(name: str, a: Point, b: Point) -> RigidBody:
    angle = math.atan2(b[1] - a[1], b[0] - a[0])
    middle = tuple(np.add(a, b) / 2)
    return RigidBody(name, 1.0, (0.001, 0.02, 0.02), middle, rotation=(0, 0, angle))


def test_a_mechanism_that_locks_names_the_multiplier_and_the_time() -> None:
    """Three bars of 0.5 on a base of 1.2: the crank turns until the other two are in line.

    `(1.2 - 0.5 cos a)^2 + (0.5 sin a)^2 = 1` there: beyond `cos a = 0.575` there is no position.
    """
    a, b, c, d = (0.0, 0.0, 0.0), (0.5, 0.0, 0.0), (0.85, math.sqrt(0.1275), 0.0), (1.2, 0.0, 0.0)
    bars = [_bar("crank", a, b), _bar("coupler", b, c), _bar("rocker", c, d)]
    joints = [
        Revolute("A", GROUND, "crank", at=a, axis=Z),
        Spherical("B", "crank", "coupler", at=b),
        Universal("C", "coupler", "rocker", at=c, axis=Z, second_axis=(1, 0, 0)),
        Revolute("D", "rocker", GROUND, at=d, axis=Z),
    ]
    driver = Driver("motor", "A", rotation=lambda t: t)
    parts = {"rigid_bodies": bars, "joints": joints, "drivers": driver}
    error, t = _fails(Scene("toggle", **parts, scheme="ep", dt=0.02, t_end=1.5))
    assert t == pytest.approx(math.acos(0.575), abs=0.02)
    assert isinstance(error, ConvergenceError)
    assert error.field is not None and error.field.startswith("multiplier of")


def test_a_free_motion_in_statics_names_the_body(plate) -> None:
    """Held at one node, a plate turns about it; more of that in `attack/test_mechanisms_static`."""
    scene = plate("static", t_end=1.0, dt=1.0, supports=Fixed("left-bottom", (0.0, 0.0, 0.0)))
    with pytest.raises(SceneError, match="shell 'plate' can turn about x, y and z through"):
        Simulation(replace(scene, loads=EdgeForce("right", (0, 0, 1e-4))))


def test_a_load_that_is_no_number_names_the_time(plate) -> None:
    loads = EdgeForce("right", (0, 0, 1e-4), time=lambda t: math.nan if 0.6 < t < 0.7 else 1.0)
    scene = plate("ep", supports=Clamped("left"), loads=loads, dt=0.1, t_end=1.0)
    scene = replace(scene, step_control=StepControl(min_dt=0.05))
    _, t = _fails(scene)
    assert 0.5 < t < 0.7


def test_a_joint_that_begins_to_act_while_it_is_open_is_named() -> None:
    """The body has fallen away from where the joint is."""
    body = RigidBody("stone", 1.0, (1.0, 1.0, 1.0))
    scene = Scene(
        "catch",
        rigid_bodies=body,
        joints=Spherical("hook", GROUND, "stone", at=(0, 0, 0), active=(0.5, 1.0)),
        initial=InitialVelocity(linear=(0.0, 0.2, 0.0)),
        scheme="ep",
        dt=0.1,
        t_end=1.0,
    )
    error, t = _fails(scene)
    assert t == pytest.approx(0.5) and "'hook'" in str(error)
