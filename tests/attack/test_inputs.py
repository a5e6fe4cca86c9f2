"""What was once accepted without a word, or ended in a traceback, and now gets its sentence.

A table of wrong descriptions with the sentence of each; what is found when the scene is made stands
here, what needs the meshes in `test_bound_inputs.py`.
"""

import numpy as np
import pytest

from shellmb.errors import SceneError
from shellmb.scene import (
    Cylinder,
    EdgeForce,
    Fixed,
    Gravity,
    Isotropic,
    Laminate,
    Lock,
    PathFollowing,
    Ply,
    PlyMaterial,
    PointForce,
    Pressure,
    Probe,
    Rectangle,
    RigidBody,
    Scene,
    Shell,
    Solver,
    StepControl,
    Table,
)
from shellmb.scene.supports import Clamped

STEEL = Isotropic(E=2e11, nu=0.3, thickness=0.01, density=7800)
SQUARE = Rectangle(1, 1)
PLATE = Shell("plate", SQUARE, STEEL)
CARBON = PlyMaterial(E1=138e9, E2=9e9, nu12=0.3, G12=7e9, G13=7e9, G23=3e9)
HELD = (Clamped("left"),)


def shell(**changes):
    return Shell("a", SQUARE, STEEL, **changes)


def scene(*shells, **changes):
    return Scene("s", shells or PLATE, **({"supports": HELD} | changes))


def raising(t):
    raise KeyError("torque")


# texts and truth values are no numbers, numbers and texts no truth values
NO_NUMBERS = {
    "isotropic section: E is True; it must be a number": lambda: Isotropic(True, 0.3, 0.1),
    "isotropic section: E is '2e11'; it must be a number": lambda: Isotropic("2e11", 0.3, 0.1),
    "isotropic section: nu is False; it must be a number": lambda: Isotropic(1, False, 0.1),
    "isotropic section: thickness is True; it must be a number": lambda: Isotropic(
        1, 0.3, np.bool_(True)
    ),
    "point force: force is '019'; it must be a vector of three numbers": lambda: PointForce(
        "left-top", "019"
    ),
    "point force: force is (True, 0, 1); it must be a vector of three numbers": lambda: PointForce(
        "left-top", (True, 0, 1)
    ),
    "edge force: force is ('1', 0, 1); it must be a vector of three numbers": lambda: EdgeForce(
        "left", ("1", 0, 1)
    ),
    "edge force: force is b'019'; it must be a vector of three numbers": lambda: EdgeForce(
        "left", b"019"
    ),
    "edge force: force is {1, 2, 3}; it must be a vector of three numbers": lambda: EdgeForce(
        "left", {3, 1, 2}
    ),
    "edge force: force is {0: 1, 1: 2, 2: 3}; it must be a vector of three numbers": lambda: (
        EdgeForce("left", {0: 1, 1: 2, 2: 3})
    ),
    "gravity: acceleration is '00g'; it must be a vector of three numbers": lambda: Gravity("00g"),
    "pressure: p is '1e3'; it must be a number": lambda: Pressure("1e3"),
    "probe 'p': component is True; it must be a number": lambda: Probe(
        "p", "left-top", component=True
    ),
    "fixed components: displacement[0] is True; it must be a number": lambda: Fixed(
        "left", (True, None, None)
    ),
    "fixed components: displacement[2] is '0'; it must be a number": lambda: Fixed(
        "left", (None, None, "0")
    ),
    "shell 'a': degree is True; it must be 2 or 3": lambda: shell(degree=True),
    "shell 'a': geometry_order is True; it must be a number": lambda: shell(geometry_order=True),
    "shell 'a': mesh[0] is True; it must be a whole number": lambda: shell(mesh=(True, 2)),
    "shell 'a': mesh[1] is '2'; it must be a whole number": lambda: shell(mesh=(2, "2")),
    "shell 'a': mesh is '22'; it must be a tuple": lambda: shell(mesh="22"),
    "shell 'a': direction is '100'; it must be a vector of three numbers": lambda: shell(
        direction="100"
    ),
    "shell 'a': rotary_inertia is 'no'; it must be True or False": lambda: shell(
        rotary_inertia="no"
    ),
    "shell 'a': rigid is 1; it must be True or False": lambda: shell(rigid=1),
    "shell: name is b'a'; it must be a text": lambda: Shell(b"a", SQUARE, STEEL),
    "path following: side is True; it must be a number": lambda: PathFollowing(side=True),
    "time table: values[0] is '1'; it must be a number": lambda: Table((0, 1), ("1", 2)),
    "time table: times is '01'; it must be a tuple": lambda: Table("01", "12"),
    "cylinder: angles[1] is '90'; it must be a number": lambda: Cylinder(1, 1, (0, "90")),
    "rigid body 'r': mass is True; it must be a number": lambda: RigidBody("r", True, (1, 1, 1)),
    "rigid body 'r': inertia is '123'; it must be three finite numbers or three rows of "
    "three": lambda: RigidBody("r", 1, "123"),
    "rigid body 'r': inertia is (True, 1, 1); it must be three finite numbers or three rows of "
    "three": lambda: RigidBody("r", 1, (True, 1, 1)),
    "ply: angle is '0'; it must be a number": lambda: Laminate.from_stacking(
        CARBON, 0.1, ["0", 90]
    ),
    "laminate: shear_correction is True; it must be a number": lambda: Laminate(
        (Ply(CARBON, 0.1),), shear_correction=True
    ),
    "solver: max_iterations is '30'; it must be a whole number": lambda: Solver(
        max_iterations="30"
    ),
    "step control: shrink is True; it must be a number": lambda: StepControl(shrink=True),
    "lock: windows is (0, True); it must be a pair (start, end) of times, or several "
    "pairs": lambda: Lock("hinge", (0, True)),
    "scene 's': dt is True; it must be a number": lambda: scene(scheme="ep", dt=True, t_end=1),
    "scene 's': alpha is '1'; it must be a number": lambda: scene(
        scheme="ed", dt=0.1, t_end=1, alpha="1"
    ),
    "scene 's': assemble is 'yes'; it must be True or False": lambda: scene(assemble="yes"),
    "gravity: time gives '3' at t = 0; it must give a finite number": lambda: scene(
        loads=Gravity(time=lambda t: "3")
    ),
    "gravity: time gives None at t = 0; it must give a finite number": lambda: scene(
        loads=Gravity(time=lambda t: None)
    ),
    "gravity: time fails at t = 0 (KeyError: 'torque'); it must give a finite number": lambda: (
        scene(loads=Gravity(time=raising))
    ),
    "gravity: time fails at t = 0 (ZeroDivisionError: division by zero); it must give a finite "
    "number": lambda: scene(loads=Gravity(time=lambda t: 1 / int(t))),
}

BAD = {**NO_NUMBERS}


@pytest.mark.parametrize("message", BAD)
def test_refused(message):
    with pytest.raises(SceneError) as caught:
        BAD[message]()
    assert str(caught.value) == message


def test_numbers_of_numpy_are_numbers():
    """What is strict about texts is not strict about NumPy, lists and whole numbers."""
    section = Isotropic(np.float32(2.0), np.float64(0.25), np.int64(1))
    assert (section.E, section.nu, section.thickness) == (2.0, 0.25, 1.0)
    assert shell(mesh=np.array([3, 2])).mesh == (3, 2)
    assert shell(mesh=[3, 2]).mesh == (3, 2)
    assert EdgeForce("left", np.array([0, 0, 1])).force == (0.0, 0.0, 1.0)
    assert Table([0, 1], np.array([1, 2])).values == (1.0, 2.0)
    # a truth value switches a load
    assert scene(loads=Gravity(time=lambda t: t > 0.5)).loads[0].time(1.0)
