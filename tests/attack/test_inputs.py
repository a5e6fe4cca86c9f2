"""What was once accepted without a word, or ended in a traceback, and now gets its sentence.

A table of wrong descriptions with the sentence of each; what is found when the scene is made stands
here, what needs the meshes in `test_bound_inputs.py`.
"""

import math
import re
import sys
import warnings

from mpi4py import MPI

import numpy as np
import pytest

from shellmb.errors import SceneError, ShellmbWarning
from shellmb.running.memory import check_memory
from shellmb.scene import (
    Cylinder,
    Driven,
    EdgeForce,
    Fixed,
    Gravity,
    InitialVelocity,
    Isotropic,
    Laminate,
    Lock,
    Parametric,
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
    SurfaceForce,
    Table,
    Weld,
)
from shellmb.scene.checks.ignored_settings import check_begin
from shellmb.scene.loads.supports import Clamped
from tests.sentences import other_sentences

STEEL = Isotropic(E=2e11, nu=0.3, thickness=0.01, density=7800)
SQUARE = Rectangle(1, 1)
PLATE = Shell("plate", SQUARE, STEEL)
CARBON = PlyMaterial(E1=138e9, E2=9e9, nu12=0.3, G12=7e9, G13=7e9, G23=3e9)
HELD = (Clamped("left"),)


def shell(**changes):
    return Shell("a", SQUARE, STEEL, **changes)


def scene(*shells, **changes):
    return Scene("s", shells or PLATE, **({"supports": HELD} | changes))


LIGHT = Shell("light", SQUARE, Isotropic(E=2e11, nu=0.3, thickness=0.01))
MOVING = {"scheme": "ep", "dt": 0.1, "t_end": 1.0}


def raising(t):
    raise KeyError("torque")


# texts and truth values are no numbers, numbers and texts no truth values
NO_NUMBERS = {
    "isotropic section: E is True; it must be a number": lambda: Isotropic(
        True, 0.3, thickness=0.1
    ),
    "isotropic section: E is '2e11'; it must be a number": lambda: Isotropic(
        "2e11", 0.3, thickness=0.1
    ),
    "isotropic section: nu is False; it must be a number": lambda: Isotropic(
        1, False, thickness=0.1
    ),
    "isotropic section: thickness is True; it must be a number": lambda: Isotropic(
        1, 0.3, thickness=np.bool_(True)
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
    "shell 'a': model is 1; it must be 'exact', 'floating-frame', Modal(modes=10) or "
    "'rigid'": lambda: shell(model=1),
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
    "laminate: shear_correction is True; it must be a factor greater than 0 or 'energy'": lambda: (
        Laminate((Ply(CARBON, 0.1),), shear_correction=True)
    ),
    "solver: max_iterations is '30'; it must be a whole number": lambda: Solver(
        max_iterations="30"
    ),
    "step control: shrink is True; it must be a number": lambda: StepControl(shrink=True),
    "lock: active is (0, True); it must be a pair (start, end) of times, or several "
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

# what would be left out of the solution without a word
NO_EFFECT = {
    "gravity: it pulls at shell 'light', whose mass is 0; give its section a density, or leave the "
    "load out": lambda: scene(LIGHT, loads=Gravity()),
    "gravity: it pulls at shell 'light', rigid body 'link', whose mass is 0; give its section a "
    "density, or leave the load out": lambda: scene(
        LIGHT,
        rigid_bodies=RigidBody("link", 0, (0, 0, 0)),
        joints=Weld("weld", "link", "ground"),
        loads=Gravity(),
    ),
    "gravity: it pulls at shell 'light', whose mass is 0; give its section a density, or leave the "
    "load out ": lambda: scene(
        PLATE,
        LIGHT,
        supports=[Clamped("left", body=name) for name in ("plate", "light")],
        loads=Gravity(body="light"),
    ),
    "initial velocity: linear is (1.0, 0.0, 0.0) and spin (0.0, 0.0, 0.0); it must be left out, "
    "because scheme 'static' has no velocities as 'ep' and 'ed' have": lambda: scene(
        initial=InitialVelocity((1, 0, 0))
    ),
    "initial velocity: linear is (0.0, 0.0, 0.0) and spin (0.0, 0.0, 2.0); it must be left out, "
    "because scheme 'linear-statics' has no velocities as 'ep' and 'ed' have": lambda: scene(
        initial=InitialVelocity(spin=(0, 0, 2)), scheme="linear-statics"
    ),
    "scene 's': start is 'equilibrium'; it must be left out, because scheme 'static' seeks "
    "equilibria anyway": lambda: scene(start="equilibrium"),
    "shell 'plate': nothing supports it, so it can move rigidly; a scene that starts in "
    "equilibrium must support every shell or join it to one that is supported": lambda: scene(
        supports=(), start="equilibrium", **MOVING
    ),
    "scene 's': dt is 2.0; it must be at most t_end, which is 0.5": lambda: scene(
        scheme="ep", dt=2.0, t_end=0.5
    ),
    "scene 's': dt is 2.0; it must be at most t_end, which is 1.0": lambda: scene(dt=2.0),
    "scene 's': min_dt is 0.2; it must be at most dt, which is 0.1": lambda: scene(
        step_control=StepControl(min_dt=0.2), **MOVING
    ),
}
# supports that would hit a body at the first step; statics moves them there
IMPACTS = {
    "fixed components: displacement[2] is 0.1 at t = 0; with scheme 'ep' it must begin at 0, where "
    "the body is, or the scene must have start='equilibrium'": Fixed("left", (0, 0, 0.1)),
    "driven edge: rotation is 0.2 at t = 0; with scheme 'ep' it must begin at 0, where the body "
    "is, or the scene must have start='equilibrium'": Driven("left", rotation=lambda t: 0.2 + t),
    "driven edge: translation is (1, 0, 0) at t = 0; with scheme 'ep' it must begin at 0, where "
    "the body is, or the scene must have start='equilibrium'": Driven(
        "left", translation=lambda t: (1, 0, 0)
    ),
}

FUNCTIONS = {
    "surface force: force fails (IndexError: index 3 is out of bounds for axis 0 with size 3); it "
    "must be written for an array of positions": lambda: scene(loads=SurfaceForce(lambda x: x[3])),
    "surface force: force fails (ZeroDivisionError: division by zero); it must be written for an "
    "array of positions": lambda: scene(loads=SurfaceForce(lambda x: 1 / 0)),
    "parametric surface: map fails (KeyError: 'radius'); it must be written for arrays xi and "
    "eta": lambda: Parametric(lambda xi, eta: {}["radius"]).position(np.zeros(3), np.zeros(3)),
    "parametric surface: map fails (only 0-dimensional arrays can be converted to Python scalars); "
    "it must be written for arrays xi and eta": lambda: Parametric(
        lambda xi, eta: (math.cos(xi), eta, 0 * eta)
    ).position(np.zeros(3), np.zeros(3)),
    "edge force: at is ('left', 'left'); it must name each edge once": lambda: EdgeForce(
        ("left", "left"), (0, 0, 1)
    ),
    "clamped edge: at is ('left', 'top', 'left'); it must name each edge once": lambda: Clamped(
        ("left", "top", "left")
    ),
    "fixed components: at is ('left', 'left'); it must name each edge once": lambda: Fixed(
        ["left", "left"], (0, 0, 0)
    ),
}

BAD = {**NO_NUMBERS, **NO_EFFECT, **FUNCTIONS}


def test_refused():
    assert not other_sentences(BAD)


@pytest.mark.parametrize("message", IMPACTS)
def test_impacts_of_supports(message):
    impact = scene(supports=IMPACTS[message], **MOVING)
    with pytest.raises(SceneError) as caught:
        check_begin(impact)
    assert str(caught.value) == message
    check_begin(scene(supports=IMPACTS[message]))
    check_begin(scene(supports=IMPACTS[message], start="equilibrium", **MOVING))


@pytest.mark.parametrize("core", [1.0, 1e-1, 1e-2, 1e-5])
def test_a_soft_core_with_a_factor_is_doubted(core):
    """By the layers' shear flexibility: the core's in the limit, which the factor does not see."""
    faces, soft = 7e10, core * 2.7e10
    skin = PlyMaterial(faces, faces, nu12=0.3, G12=2.7e10, G13=2.7e10, G23=2.7e10)
    middle = PlyMaterial(core * faces, core * faces, nu12=0.3, G12=soft, G13=soft, G23=soft)
    plies = (Ply(skin, 1e-3), Ply(middle, 2e-2), Ply(skin, 1e-3))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        section = Laminate(plies)
    energy = Laminate(plies, shear_correction="energy")
    ratio = section.G[0, 0] / energy.G[0, 0]
    assert [str(w.message) for w in caught] == (
        []
        if core >= 0.1
        else [
            f"laminate: shear_correction is 0.8333, with which it is {ratio:.2g} times as stiff "
            "against transverse shear as its plies in equilibrium are; it should be 'energy', "
            "unless the factor belongs to these plies"
        ]
    )
    assert all(w.category is ShellmbWarning for w in caught)
    if core == 1e-5:
        # thin faces: shear force over the core alone, G (d^2 / c), d between the faces' middles
        assert energy.G[0, 0] == pytest.approx(soft * 0.021**2 / 0.02, rel=1e-2)
        assert ratio > 1e3


def test_usual_laminates_are_not_doubted():
    for stacking in ("[0]", "[0/90]s", "[45/-45]4", "[0/90/45/-45/45/-45]s"):
        Laminate.from_stacking(CARBON, 1e-4, stacking)


def test_weight_of_a_part_without_mass_is_doubted():
    held = [Clamped("left", body=name) for name in ("plate", "light")]
    with pytest.warns(ShellmbWarning, match="gravity: it does not pull at 'light', which has no"):
        scene(PLATE, LIGHT, supports=held, loads=Gravity())


def test_a_new_scheme_leaves_out_what_it_cannot_have():
    moving = scene(scheme="ed", dt=0.1, t_end=1, alpha=0.5, initial=InitialVelocity((0, 0, 1)))
    assert moving.with_options(scheme="ep").alpha is None
    static = moving.with_options(scheme="static")
    assert (static.initial, static.alpha) == ((), None)
    # a load step longer than the new end is the default one
    assert scene(t_end=1.0, scheme="linear-statics").with_options(t_end=0.5).dt == 0.5
    assert scene(dt=0.25).with_options(t_end=0.1).dt == pytest.approx(0.01)


def test_numbers_of_numpy_are_numbers():
    """What is strict about texts is not strict about NumPy, lists and whole numbers."""
    section = Isotropic(np.float32(2.0), np.float64(0.25), thickness=np.int64(1))
    assert (section.E, section.nu, section.thickness) == (2.0, 0.25, 1.0)
    assert shell(mesh=np.array([3, 2])).mesh == (3, 2)
    assert shell(mesh=[3, 2]).mesh == (3, 2)
    assert EdgeForce("left", np.array([0, 0, 1])).force == (0.0, 0.0, 1.0)
    assert Table([0, 1], np.array([1, 2])).values == (1.0, 2.0)


# Kind: what Python can make a number of, and nobody means as one
NO_NUMBERS = {
    "truth value": (lambda t: t > 0.5, "gives False at t = 0"),
    "text": (lambda t: "1", "gives '1' at t = 0"),
    "complex": (lambda t: 1j, "gives 1j at t = 0"),
    "array": (lambda t: np.array([t]), "gives [0.0] at t = 0"),
    "nothing": (lambda t: None, "gives None at t = 0"),
    "exit": (lambda t: sys.exit(), "fails at t = 0 (SystemExit"),
    "exit with 0": (lambda t: sys.exit(0), "fails at t = 0 (SystemExit"),
}


@pytest.mark.parametrize("given", NO_NUMBERS)
def test_factors_of_loads_are_numbers(given):
    function, said = NO_NUMBERS[given]
    with pytest.raises(SceneError, match=re.escape(f"gravity: time {said}")):
        scene(loads=Gravity(time=function))


@pytest.mark.parametrize(
    ("force", "said"),
    [
        (lambda x: np.ones_like(x) * 1j, "gives complex numbers"),
        (lambda x: x > 0, "gives truth values"),
        (lambda x: (x[0], x[1], x[2] > 0), "gives truth values"),
        (lambda x: sys.exit(), "fails (SystemExit"),
    ],
)
def test_loads_over_positions_are_numbers(force, said):
    with pytest.raises(SceneError, match=re.escape(f"surface force: force {said}")):
        scene(loads=SurfaceForce(force))


@pytest.mark.parametrize(
    ("times", "said"),
    [
        ({"dt": 1e300, "t_end": 1e300}, "dt is 1e+300; it must be between 1e-100 and 1e+100"),
        ({"dt": 1e-300, "t_end": 1e-299}, "dt is 1e-300; it must be between"),
    ],
)
def test_steps_are_of_a_size(times, said):
    with pytest.raises(SceneError, match=re.escape(said)):
        scene(scheme="ep", **times)


def test_steps_without_end_are_refused_before_anything_is_built():
    endless = scene(scheme="ep", dt=1e-12, t_end=1.0)
    with pytest.raises(SceneError, match=r"which are 1e\+12 steps; they must be at most 1e\+08"):
        check_memory(endless, MPI.COMM_SELF)
