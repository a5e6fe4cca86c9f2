"""Every impossible beam, curve, section, rigid body, joint and force element has its sentence."""

import numpy as np

from shellmb.scene import (
    AlongEdge,
    AlongLine,
    Arc,
    Beam,
    CircularArc,
    CircularSection,
    Cylindrical,
    Damper,
    Distance,
    Driver,
    FollowerForce,
    FollowerLineForce,
    GeneralSection,
    Glue,
    InPlane,
    JointDamper,
    JointSpring,
    Line,
    LineForce,
    LineMoment,
    Lock,
    Motor,
    ParametricCurve,
    Planar,
    PointMoment,
    Prismatic,
    Probe,
    RectangularSection,
    Revolute,
    RigidBody,
    Screw,
    ShellRevolute,
    Spherical,
    Spring,
    TubularSection,
    Universal,
    Weld,
)
from tests.sentences import other_sentences

NAN = float("nan")
BAR = RectangularSection(1.0, 0.3, width=0.1, height=0.1)
ROD = Line((0, 0, 0), (1, 0, 0))
JOINT = "name, first, second, at, second_at, mass, active"
ONES = np.ones((3, 3))


def mass_of(mass, first, second=(0.0, 0.0, 0.0)):
    return GeneralSection((1,) * 6, mass, first_moments=first, second_moments=second)


BAD = {
    # curves
    "line: start and end are both (1.0, 2.0, 3.0); they must differ": lambda: Line(
        (1, 2, 3), (1, 2, 3)
    ),
    "line: end is (0, 1); it must be a vector of three numbers": lambda: Line((0, 0, 0), (0, 1)),
    "circular arc: angle_rad is 0.0; it must not be zero and at most a turn of 2 pi": lambda: (
        CircularArc((0, 0, 0), (1, 0, 0), (0, 0, 1), 0)
    ),
    "circular arc: angle_rad is -7.0; it must not be zero and at most a turn of 2 pi": lambda: (
        CircularArc((0, 0, 0), (1, 0, 0), (0, 0, 1), -7)
    ),
    "circular arc: axis is (0, 0, 0); it must not be zero": lambda: CircularArc(
        (0, 0, 0), (1, 0, 0), (0, 0, 0), 1
    ),
    "circular arc: start (0.0, 0.0, 2.0) is on the axis; it must be beside it": lambda: CircularArc(
        (0, 0, 0), (0, 0, 2), (0, 0, 1), 1
    ),
    "arc: (0.0, 0.0, 0.0), (1.0, 0.0, 0.0) and (2.0, 0.0, 0.0) are on a line; they must be three "
    "points of a circle": lambda: Arc((0, 0, 0), (1, 0, 0), (2, 0, 0)),
    "parametric curve: function returns an array of shape (231,) for 231 points; it must be (3, "
    "231)": lambda: ParametricCurve(lambda xi: xi),
    "parametric curve: function fails (it has complex numbers); it must give (3, 231) numbers for "
    "231 points": lambda: ParametricCurve(lambda xi: np.stack([1j * xi] * 3)),
    "parametric curve: function returns a number that is not finite": lambda: ParametricCurve(
        lambda xi: NAN * np.stack([xi] * 3)
    ),
    "parametric curve: function stands still; X_,xi must not be zero": lambda: ParametricCurve(
        lambda xi: np.stack([xi**2] * 3)
    ),
    "parametric curve: function is 3; it must be a function": lambda: ParametricCurve(3),
    "curve along an edge: shell is missing; its parameters are shell, edge": lambda: AlongEdge(
        edge="left"
    ),
    "curve along a line: start and end are both 'a'; they must differ": lambda: AlongLine(
        "s", "a", "a"
    ),
    "curve along a line: end is (1, 2); it must be the name of a point or finite coordinates (x, "
    "y, z)": lambda: AlongLine("s", "a", (1, 2)),
    # sections
    "rectangular section: nu is None and G is None; exactly one of them must be given, the other "
    "None": lambda: RectangularSection(1, None, width=1, height=1),
    "circular section: nu is 0.3 and G is 1.0; exactly one of them must be given, the other "
    "None": lambda: CircularSection(1, 0.3, radius=1, G=1),
    "rectangular section: nu is 0.6; it must be at most 0.5": lambda: RectangularSection(
        1, 0.6, width=1, height=1
    ),
    "rectangular section: width is 0; it must be greater than 0": lambda: RectangularSection(
        1, 0.3, width=0, height=1
    ),
    "rectangular section: offset has the wrong number of entries": lambda: RectangularSection(
        1, 0.3, width=1, height=1, offset=(1,)
    ),
    "tubular section: thickness is 1.0; it must be less than the radius 1.0, or use "
    "CircularSection": lambda: TubularSection(1, 0.3, radius=1, thickness=1),
    "general section: stiffness is (1, 2); it must be 6 by 6 finite numbers, or the 6 of a "
    "diagonal": lambda: GeneralSection([1, 2]),
    "general section: stiffness is 'stiff'; it must be 6 by 6 finite numbers, or the 6 of a "
    "diagonal": lambda: GeneralSection("stiff"),
    "general section: stiffness[0, 1] is 0.5 and [1, 0] is 0; it must be symmetric": lambda: (
        GeneralSection(np.eye(6) + 0.5 * np.eye(6, k=1) * (np.arange(6) == 1))
    ),
    "general section: stiffness has the diagonal [1.0, 1.0, 1.0, 1.0, 1.0, 0.0] and is not "
    "positive definite; it must be": lambda: GeneralSection((1, 1, 1, 1, 1, 0)),
    "general section: stiffness has the diagonal [1.0, 1.0, 1.0, 1.0, 1.0, 1.0] and is not "
    "positive definite; it must be": lambda: GeneralSection(np.ones((6, 6))),
    "general section: mass_per_length 1.0 with first_moments (1.0, 0.0) and second_moments (0.5, "
    "0.0, 1.0) belong to no distribution of mass; their matrix [[m, s2, s3], [s2, I22, I23], [s3, "
    "I23, I33]] must be positive semidefinite": lambda: mass_of(1, (1, 0), (0.5, 0, 1)),
    "general section: mass_per_length 0.0 with first_moments (1e-12, 0.0) and second_moments (0.0, "
    "0.0, 0.0) belong to no distribution of mass; their matrix [[m, s2, s3], [s2, I22, I23], [s3, "
    "I23, I33]] must be positive semidefinite": lambda: mass_of(0, (1e-12, 0)),
    # beams
    "beam 'b': elements is 0; it must be greater than 0": lambda: Beam("b", ROD, BAR, 0),
    "beam 'b': degree is 1; it must be 2 or 3": lambda: Beam("b", ROD, BAR, degree=1),
    "beam 'b': curve is 'line'; it must be a curve": lambda: Beam("b", "line", BAR),
    "beam 'b': up is (2.0, 0.0, 0.0), which is tangential at xi = 0; it must have a part across "
    "the beam everywhere": lambda: Beam("b", ROD, BAR, up=(2, 0, 0)),
    "beam 'b': up is (0, 0, 0); it must not be zero": lambda: Beam("b", ROD, BAR, up=(0, 0, 0)),
    "beam 'b': up is (0.0, 0.0, 1.0); it must be left out along a shell, whose director is "
    "d3": lambda: Beam("b", AlongEdge("s", "left"), BAR, up=(0, 0, 1)),
    "beam 'b': elements is 2; it must be at least 3 around a closed curve": lambda: Beam(
        "b", CircularArc((0, 0, 0), (1, 0, 0), (0, 0, 1), 2 * np.pi), BAR, 2
    ),
    "glue: kind is 'weld'; it must be 'revolute' or 'director'": lambda: Glue("b", "s", "weld"),
    # rigid bodies
    "rigid body 'r': mass is -1; it must be at least 0": lambda: RigidBody("r", -1, (1, 1, 1)),
    "rigid body 'r': inertia is (1, 1); it must be three finite numbers or three rows of "
    "three": lambda: RigidBody("r", 1, (1, 1)),
    "rigid body 'r': inertia is ((1.0, 0.5, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)); it must be "
    "symmetric": lambda: RigidBody("r", 1, ((1, 0.5, 0), (0, 1, 0), (0, 0, 1))),
    "rigid body 'r': inertia has the principal moments -1, 1, 1; none of them must be "
    "negative": lambda: RigidBody("r", 1, (1, 1, -1)),
    "rigid body 'r': inertia has the principal moments 1, 1, 2.5; each must be at most the sum of "
    "the other two": lambda: RigidBody("r", 1, (1, 2.5, 1)),
    "rigid body 'r': rotation is ((1.0, 1.0, 1.0), (1.0, 1.0, 1.0), (1.0, 1.0, 1.0)); its columns "
    "must be orthonormal and right-handed": lambda: RigidBody("r", 1, (1, 1, 1), rotation=ONES),
    "rigid body 'r': rotation is ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0)); its columns "
    "must be orthonormal and right-handed": lambda: RigidBody(
        "r", 1, (1, 1, 1), rotation=np.diag([1, 1, -1])
    ),
    "rigid body 'r': a point is named 'center'; it must have another name than 'origin' and "
    "'center', which every body has": lambda: RigidBody(
        "r", 1, (1, 1, 1), points={"center": (0, 0, 0)}
    ),
    "rigid body 'r': there is no point 'tip'; its points are 'origin', 'center', or give "
    "coordinates": lambda: RigidBody("r", 1, (1, 1, 1)).place("tip"),
    # joints
    "spherical joint 'j': first and second are both 'a'; they must differ": lambda: Spherical(
        "j", "a", "a"
    ),
    "weld 'j': first and second are both 'ground'; they must differ": lambda: Weld("j", "ground"),
    f"revolute joint 'j': axis is missing; its parameters are {JOINT}, axis": lambda: Revolute(
        "j", "a"
    ),
    "prismatic joint 'j': axis is (0, 0, 0); it must not be zero": lambda: Prismatic(
        "j", "a", axis=(0, 0, 0)
    ),
    "cylindrical joint 'j': mass is -1; it must be at least 0": lambda: Cylindrical(
        "j", "a", mass=-1, axis=(0, 0, 1)
    ),
    "planar joint 'j': normal is 'z'; it must be a vector of three numbers": lambda: Planar(
        "j", "a", normal="z"
    ),
    f"in-plane joint 'j': normal is missing; its parameters are {JOINT}, normal": lambda: InPlane(
        "j", "a"
    ),
    "universal joint 'j': axis (0.0, 0.0, 1.0) and second_axis (0.0, 1.0, 1.0) are not "
    "perpendicular; they must be": lambda: Universal(
        "j", "a", axis=(0, 0, 1), second_axis=(0, 1, 1)
    ),
    "screw joint 'j': pitch is 0.0; it must not be zero, or use Revolute": lambda: Screw(
        "j", "a", axis=(0, 0, 1), pitch=0
    ),
    "distance joint 'j': length is 0; it must be greater than 0": lambda: Distance(
        "j", "a", length=0
    ),
    "shell revolute joint 'j': axis is (0, 0, 0); it must not be zero": lambda: ShellRevolute(
        "j", "a", "s", axis=(0, 0, 0)
    ),
    "weld 'j': at is (1, 2); it must be the name of a point, finite coordinates (x, y, "
    "z), or an Offset": lambda: Weld("j", "a", at=(1, 2)),
    "weld 'j': active is 3; it must be a pair (start, end) of times, or several pairs": lambda: (
        Weld("j", "a", active=3)
    ),
    "weld 'j': active is ((0, 2), (1, 3)); its times must increase from each start to its end to "
    "the next start": lambda: Weld("j", "a", active=((0, 2), (1, 3))),
    "lock: active is (); it must be a pair (start, end) of times, or several pairs": lambda: Lock(
        "j", ()
    ),
    "lock: active is (2, 1); its times must increase from each start to its end to the next "
    "start": lambda: Lock("j", (2, 1)),
    # drivers and force elements
    "driver 'd': neither rotation nor translation is given; give one at least": lambda: Driver(
        "d", "j"
    ),
    "driver 'd': rotation is 3; it must be a function": lambda: Driver("d", "j", 3),
    "joint spring 'k': of stiffness and potential neither is given; it must be exactly "
    "one": lambda: JointSpring("k", "j"),
    "joint spring 'k': of stiffness and potential both are given; it must be exactly one": lambda: (
        JointSpring("k", "j", 1.0, abs)
    ),
    "joint spring 'k': coordinate is 'angle'; it must be 'rotation' or 'translation'": lambda: (
        JointSpring("k", "j", 1.0, coordinate="angle")
    ),
    "joint damper 'k': of damping and law neither is given; it must be exactly one": lambda: (
        JointDamper("k", "j")
    ),
    "motor 'm': law is 3; it must be a function": lambda: Motor("m", "j", 3),
    "spring 'k': of stiffness and potential neither is given; it must be exactly one": lambda: (
        Spring("k", "a", "b", "tip", "tip")
    ),
    "spring 'k': length is 1; it must be left out with a potential, which is a function of the "
    "whole length": lambda: Spring("k", "a", "b", "tip", "tip", potential=abs, length=1),
    "spring 'k': first and second are both 'a'; they must be two bodies": lambda: Spring(
        "k", "a", "a", "tip", "top", 1.0
    ),
    "damper 'k': of damping and law both are given; it must be exactly one": lambda: Damper(
        "k", "a", "b", "tip", "tip", 1.0, abs
    ),
    "damper 'k': first and second are both 'a'; they must be two bodies": lambda: Damper(
        "k", "a", "a", "tip", "top", 1.0
    ),
    # loads and probes
    "line force: force is (0, 1); it must be a vector of three numbers": lambda: LineForce((0, 1)),
    "follower line force: components is (0, 0, nan); every component must be finite": lambda: (
        FollowerLineForce((0, 0, NAN))
    ),
    "line moment: moment is 1; it must be a vector of three numbers": lambda: LineMoment(1),
    "point moment: at is (1, 2); it must be the name of a point, finite coordinates (x, y, z), "
    "or an Offset": lambda: PointMoment((1, 2), (0, 0, 1)),
    "follower force: components is missing; its parameters are at, components, body, "
    "time": lambda: FollowerForce("end"),
    "probe 'p': quantity is 'torque'; it must be 'displacement', 'position', 'velocity', "
    "'director', 'rotation', 'angular_velocity', 'force', 'moment', "
    "'membrane', 'bending' or 'shear'": lambda: Probe("p", "end", "torque"),
}


def test_messages():
    assert not other_sentences(BAD)
