"""What a good scene offers: defaults, look-ups, options; no solver is imported for it."""

import subprocess
import sys

import numpy as np
import pytest

from shellmb.scene import (
    Clamped,
    Cylinder,
    Disc,
    Driven,
    Fixed,
    Gravity,
    Hyperelastic,
    InitialVelocity,
    Isotropic,
    Join,
    Pressure,
    Probe,
    Ramp,
    Rectangle,
    Scene,
    Shell,
    Sine,
    Sphere,
    Step,
    StepControl,
    SurfaceForce,
    Table,
)
from shellmb.scene.loads.supports import at_rest, moves

STEEL = Isotropic(E=2e11, nu=0.3, thickness=0.01, density=7800)
PLATE = Shell("plate", Rectangle(2, 1), STEEL)
WALL = Shell("wall", Rectangle(1, 1, axis1=(0, 0, 1)), STEEL)


class MyScheme:
    name = "mine"
    dynamic = True
    stages = ("j", "f")


def test_static_times_are_filled_in():
    scene = Scene("s", PLATE, supports=Clamped("left"))
    assert (scene.static, scene.scheme_name, scene.dt, scene.t_end) == (True, "static", 0.1, 1.0)
    assert Scene("s", PLATE, supports=Clamped("left"), t_end=5).dt == 0.5
    linear = Scene("s", PLATE, supports=Clamped("left"), scheme="linear-statics")
    assert (linear.static, linear.dt, linear.t_end) == (True, 1.0, 1.0)


def test_options_replace_what_is_given_only():
    scene = Scene("s", [PLATE], supports=[Clamped("left")], loads=[Pressure(3.0)])
    other = scene.with_options(scheme="ed", alpha=0.5, dt=0.01, t_end=2, mesh=(3, 4), cell="tri")
    assert (other.scheme, other.alpha, other.dt, other.t_end) == ("ed", 0.5, 0.01, 2.0)
    assert (other.shells[0].mesh, other.shells[0].cell) == ((3, 4), "tri")
    assert other.loads == scene.loads
    assert scene.with_options() == scene
    assert scene.shells[0].mesh == (8, 8)


def test_scheme_objects():
    scene = Scene(
        "s",
        PLATE,
        scheme=MyScheme(),
        dt=0.1,
        t_end=1,
        step_control=StepControl(jump_tolerance=1e-3),
    )
    assert (scene.static, scene.scheme_name) == (False, "mine")


def test_items_find_their_bodies():
    join = Join("plate", "wall", "left", "bottom")
    scene = Scene("s", [PLATE, WALL], supports=Clamped("right", body="plate"), joins=[join])
    assert scene.shell("wall") is WALL
    assert scene.bodies_of(Gravity()) == (PLATE, WALL)
    assert scene.bodies_of(InitialVelocity(body="wall")) == (WALL,)
    assert scene.bodies_of(Probe("p", (0, 0, 0), body="plate")) == (PLATE,)


def test_support_reaches_through_joins():
    third = Shell("third", Rectangle(1, 1), STEEL)
    joins = [Join("plate", "wall", "left", "bottom"), Join("third", "wall", "left", "top")]
    Scene("s", [PLATE, WALL, third], supports=Clamped("right", body="third"), joins=joins)


def test_numpy_is_welcome():
    section = Isotropic(np.float64(2e11), np.float32(0.25), thickness=np.array(0.01))
    assert (section.E, section.nu, section.thickness) == (2e11, 0.25, 0.01)
    assert SurfaceForce(np.arange(3)).force == (0.0, 1.0, 2.0)
    assert Shell("a", Rectangle(1, 1), STEEL, mesh=np.array([2, 3])).mesh == (2, 3)
    assert Fixed(np.zeros(3), (0, None, Sine(1.0))).at == (0.0, 0.0, 0.0)


def test_a_function_is_given_whatever_its_truth_value():
    """Kind: a constant of NumPy's polynomials is a function, and false as a list of length 0 is."""
    level = np.poly1d([0.5])
    assert not level
    driven, fixed = Driven("left", rotation=level), Fixed("left", displacement=(level, 0, None))
    assert moves(driven) and moves(fixed) and not (at_rest(driven) or at_rest(fixed))
    assert at_rest(Fixed("left", displacement=(0, 0, None))) and at_rest(Clamped("left"))


def test_forces_may_depend_on_position():
    load = SurfaceForce(lambda x: np.stack([0 * x[0], 0 * x[0], np.sin(x[0])]))
    Scene("s", PLATE, supports=Clamped("left"), loads=load)


@pytest.mark.parametrize(
    ("function", "values"),
    [
        (Step(1.0), (0.0, 1.0, 1.0)),
        (Ramp(2.0, start=0.5), (0.0, 0.25, 1.0)),
        (Table((0.5, 1.5), (2.0, 4.0)), (2.0, 3.0, 4.0)),
        (Sine(0.25, start=0.5), (0.0, np.sin(np.pi / 4), 0.0)),
    ],
)
def test_time_functions(function, values):
    got = [function(t) for t in (0.0, 1.0, 2.5)]
    np.testing.assert_allclose(got, values, atol=1e-14)
    assert all(type(v) is float for v in got)


@pytest.mark.parametrize(
    ("surface", "edges", "points"),
    [
        (Cylinder(1, 2, (0, 90)), {"left", "right", "bottom", "top"}, 4),
        (Cylinder(1, 2), {"bottom", "top"}, 2),
        (Sphere(1, (18, 90), (0, 90)), {"left", "right", "bottom", "top"}, 4),
        (Sphere(1), {"top"}, 2),
        (Disc(1), {"top"}, 2),
        (Disc(1, (0, 90)), {"left", "right", "top"}, 3),
    ],
)
def test_names_follow_the_shape(surface, edges, points):
    assert set(surface.edges) == edges
    assert len(surface.points) == points


@pytest.mark.parametrize(
    "surface",
    [
        Rectangle(2, 3, (1, 2, 3), (0, 1, 0), (0, 0, 2)),
        Cylinder(2, 3, (20, 120), (1, 0, 0), (0, 1, 0), (0, 0, 1)),
        Sphere(2, (18, 90), (30, 130), (1, 2, 3)),
        Disc(2, (10, 200), (0, 0, 1), (0, 1, 0), (0, 0, 1)),
    ],
)
def test_normals_are_unit_and_normal(surface):
    xi, eta = np.random.default_rng(0).uniform(0.1, 0.9, (2, 20))
    x, h = surface.position(xi, eta), 1e-6
    n = surface.normal(x)
    np.testing.assert_allclose((n * n).sum(axis=0), 1, rtol=1e-14)
    for du, dv in ((h, 0), (0, h)):
        along = surface.position(xi + du, eta + dv) - surface.position(xi - du, eta - dv)
        np.testing.assert_allclose((along * n).sum(axis=0) / h, 0, atol=1e-8)


def test_hyperelastic_mass():
    section = Hyperelastic(lambda e, p: e, {"mu": 1.0}, thickness=0.2, density=3.0, stiffness=1.0)
    np.testing.assert_allclose(section.mass, (0.6, 0.0, 3.0 * 0.2**3 / 12))


def test_a_scene_needs_no_solver():
    code = (
        "import sys, shellmb.scene\n"
        "bad = {'dolfinx', 'ufl', 'petsc4py', 'mpi4py', 'gmsh', 'scipy'} & set(sys.modules)\n"
        "assert not bad, bad"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
