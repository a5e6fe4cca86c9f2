"""What a good scene of several kinds of bodies offers."""

import math

import pytest

from shellmb.errors import SceneError
from shellmb.scene import (
    Beam,
    Clamped,
    Cylindrical,
    Driver,
    FollowerForce,
    FollowerMoment,
    Gravity,
    InitialVelocity,
    Isotropic,
    JointDamper,
    JointSpring,
    Line,
    LineForce,
    Lock,
    Motor,
    PointForce,
    PointMoment,
    Pressure,
    Probe,
    Rectangle,
    RectangularSection,
    Revolute,
    RigidBody,
    Scene,
    Screw,
    Shell,
    Spherical,
    Weld,
)

Z = (0, 0, 1)
BEAM = Beam(
    "beam",
    Line((0, 0, 0), (1, 0, 0)),
    RectangularSection(1.0, 0.3, width=0.1, height=0.1, density=1.0),
)
CRANK = RigidBody("crank", 1, (1, 1, 1), position=(1, 0, 0), points={"pin": (1, 0, 0)})
PLATE = Shell("plate", Rectangle(1, 1), Isotropic(1.0, 0.3, thickness=0.01, density=1.0))
JOINTS = (
    Revolute("hinge", "crank", "beam", axis=Z),
    Cylindrical("guide", "ground", "crank", at=(2, 0, 0), axis=Z),
    Screw("screw", "beam", "crank", at="start", second_at="pin", axis=Z, pitch=0.01),
)


def scene(**kwargs):
    parts = {"beams": BEAM, "rigid_bodies": [CRANK], "joints": JOINTS} | kwargs
    return Scene("s", PLATE, scheme="ed", dt=1, t_end=9, **parts)


def test_bodies_are_found():
    s = scene()
    assert s.bodies == (PLATE, BEAM, CRANK)
    assert s.body("crank") is CRANK
    assert s.shell() is PLATE
    assert s.joint("hinge") is JOINTS[0]
    with pytest.raises(SceneError, match="there is no joint 'x'; the scene has 'hinge', 'guide'"):
        s.joint("x")
    with pytest.raises(SceneError, match="scene: body is missing; it must be one of 'plate'"):
        s.body()


def test_items_find_their_bodies():
    s = scene()
    assert s.bodies_of(Gravity()) == s.bodies
    assert s.bodies_of(InitialVelocity()) == s.bodies
    assert s.bodies_of(Gravity(body="crank")) == (CRANK,)
    assert s.bodies_of(Probe("p", "pin", body="crank")) == (CRANK,)
    # the only body of a kind that can carry the load
    assert s.bodies_of(Pressure(1.0)) == (PLATE,)
    assert s.bodies_of(LineForce(Z)) == (BEAM,)
    for load in (PointMoment, FollowerForce, FollowerMoment):
        assert s.bodies_of(load("end", Z, body="beam")) == (BEAM,)
    assert s.bodies_of(PointForce("pin", Z, body="crank")) == (CRANK,)
    assert s.bodies_of(Clamped("start", body="beam")) == (BEAM,)


def test_coordinates_of_joints():
    s = scene()
    assert s.coordinates_of(Driver("d", "guide", math.sin)) == ("rotation",)
    assert s.coordinates_of(Driver("d", "guide", math.sin, math.sin)) == ("rotation", "translation")
    assert s.coordinates_of(Lock("guide", (0, 1))) == ("rotation", "translation")
    assert s.coordinates_of(Lock("guide", (0, 1), "translation")) == ("translation",)
    assert s.coordinates_of(JointSpring("k", "hinge", 1.0)) == ("rotation",)
    assert s.coordinates_of(JointDamper("k", "screw", 1.0)) == ("rotation",)
    motor = Motor("m", "guide", lambda x, rate, t: 1.0, "translation")
    assert s.coordinates_of(motor) == ("translation",)


def test_a_single_part_stands_for_a_tuple_of_one():
    s = scene(
        joints=Revolute("hinge", "crank", axis=Z),
        drivers=Driver("d", "hinge", math.sin),
        force_elements=JointSpring("k", "hinge", potential=lambda x: x**4),
    )
    assert [len(part) for part in (s.beams, s.joints, s.drivers, s.force_elements)] == [1, 1, 1, 1]
    assert (s.assemble, s.start, s.redundant) == (False, "given", "error")


def test_no_shells_are_needed():
    s = Scene("top", rigid_bodies=CRANK, joints=Spherical("ball", "crank"), t_end=1, dt=1)
    assert s.shells == ()
    assert s.body() is CRANK
    assert s.with_options(dt=0.5).dt == 0.5


def test_options_reach_beams():
    s = scene().with_options(mesh=(3, 5), degree=3)
    assert (s.beams[0].elements, s.beams[0].degree) == (3, 3)
    assert (s.shells[0].mesh, s.shells[0].degree) == ((3, 5), 3)
    only_cell = scene().with_options(cell="tri")
    assert only_cell.beams == (BEAM,)


def test_options_reach_a_single_body():
    before = scene()
    only_beam = before.with_options(mesh=(3, 5), degree=3, cell="tri", body=BEAM.name)
    assert (only_beam.beams[0].elements, only_beam.beams[0].degree) == (3, 3)
    assert only_beam.shells == before.shells
    only_shell = before.with_options(mesh=(3, 5), body=before.shells[0].name)
    assert (only_shell.shells[0].mesh, only_shell.beams) == ((3, 5), (BEAM,))
    with pytest.raises(SceneError, match="body is 'crank'; it must be one of the scene's shells"):
        before.with_options(degree=3, body="crank")


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        (None, None),
        ((0, 1), ((0.0, 1.0),)),
        ([(0, 1), (2, math.inf)], ((0.0, 1.0), (2.0, math.inf))),
    ],
)
def test_windows(given, kept):
    assert Weld("w", "crank", active=given).active == kept


def test_joints_know_what_they_leave_free():
    assert [j.freedoms for j in JOINTS] == [
        ("rotation",),
        ("rotation", "translation"),
        ("rotation",),
    ]
    assert Spherical("ball", "crank").freedoms == ()
    assert Weld("w", "crank").said == "weld 'w'"
