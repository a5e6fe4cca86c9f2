"""What contacts, potentials and stops cannot be, and steps that are too long for them."""

from typing import Any

import pytest
import ufl

from shellmb.errors import SceneError
from shellmb.running.execute import execute
from shellmb.scene import (
    GROUND,
    Ball,
    Contact,
    InitialVelocity,
    Isotropic,
    JointSpring,
    JointStop,
    Plane,
    Potential,
    Rectangle,
    Revolute,
    RigidBody,
    Rod,
    Scene,
    Shell,
)

PLATE = Shell(
    "plate", Rectangle(0.4, 0.3), Isotropic(70e9, 0.3, thickness=2e-3, density=2700.0), mesh=(1, 1)
)
BODY = RigidBody("ball", 1.0, (1.0, 1.0, 1.0), position=(0, 0, 1.0))


def contact(**more: Any) -> Contact:
    return Contact(**{"name": "floor", "obstacle": Plane(), "stiffness": 1e4} | more)


def scene(scheme: str = "ep", **more: Any) -> Scene:
    return Scene(
        "refused", **{"rigid_bodies": BODY, "scheme": scheme, "dt": 1.0, "t_end": 1.0} | more
    )


def hinged(stop: Any, scheme: str = "ep", *others: Any) -> Scene:
    hinge = Revolute("hinge", GROUND, "ball", at=(0, 0, 0), axis=(0, 1, 0))
    return scene(scheme, joints=hinge, force_elements=(stop, *others))


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: contact(stiffness=-1.0), "contact 'floor': stiffness is -1.0; .* greater than 0"),
        (lambda: contact(obstacle="floor"), "contact 'floor': obstacle is 'floor'"),
        (lambda: Plane(normal=(0, 0, 0)), r"plane: normal is \(0, 0, 0\); it must not be zero"),
        (lambda: Rod((0, 0, 0), (0, 0, 0), 1.0), "rod: axis is .*; it must not be zero"),
        (lambda: Ball((0, 0, 0), -1.0), "ball: radius is -1.0; it must be greater than 0"),
        (lambda: contact(friction=0.3), "friction is 0.3 and slip_speed is missing"),
        (lambda: contact(slip_speed=0.1), "slip_speed is 0.1 and friction is 0"),
        (
            lambda: contact(obstacle=Ball((0, 0, 0), 0.1, inside=True), radius=0.2),
            "radius is 0.2; it must be less than that of the ball",
        ),
        (lambda: scene(contacts=contact(body="bell")), "contact 'floor': there is no .* 'bell'"),
        (lambda: scene(contacts=contact(at="lug")), "has no point 'lug'"),
        (
            lambda: scene(rigid_bodies=(), shells=PLATE, contacts=contact(at="edge")),
            "shell 'plate' has no edge or point 'edge'; its edges are 'left'",
        ),
        (
            lambda: scene(rigid_bodies=(), shells=PLATE, contacts=contact(at=("left", "left-top"))),
            "it must be edges and areas, or points, and not both",
        ),
        (lambda: scene(contacts=(contact(), contact())), "another potential, contact, joint, el"),
        (lambda: scene("linear-dynamics", contacts=contact()), "displacements are small"),
        (
            lambda: scene("static", contacts=contact(relative_damping=0.1)),
            "relative_damping is 0.1; it must be 0",
        ),
        (lambda: JointStop("s", "hinge", stiffness=1.0), "neither lower nor upper is given"),
        (lambda: JointStop("s", "hinge", 1.0, 0.5, stiffness=1.0), "lower is 1.0 and upper 0.5"),
        (lambda: JointStop("s", "hinge", 0.1, stiffness=1.0), "0 is between them"),
        (lambda: JointStop("s", "hinge", -1.0, stiffness=-1.0), "stiffness is -1.0"),
        (
            lambda: hinged(JointStop("s", "hinge", -1.0, stiffness=1.0), "linear-dynamics"),
            "joint stop 's': with scheme 'linear-dynamics'",
        ),
        (
            lambda: hinged(JointStop("s", "hingo", -1.0, stiffness=1.0)),
            "joint stop 's': there is no joint 'hingo'",
        ),
        (
            lambda: Potential("p", lambda at, p: 0, parameters={"k": "soft"}),
            "potential 'p': parameters is 'soft'; it must be a number",
        ),
    ],
)
def test_descriptions(make, says) -> None:
    with pytest.raises(SceneError, match=says):
        make()


@pytest.mark.parametrize(
    ("more", "says"),
    [
        (
            {"contacts": contact(radius=1.2)},
            r"1 of 1 points of 'ball' start in the plane, the one at \(0, 0, 1\) by 0.2 m; it must "
            "start outside, or preloaded must be True",
        ),
        (
            {"potentials": Potential("p", lambda at, p: at.x)},
            "potential 'p': energy .* returns an expression of shape",
        ),
        (
            {"potentials": Potential("p", lambda at, p: p["k"], parameters={"k": 1.0})},
            "depends neither on at.x nor on at.u or at.directors",
        ),
        (
            {"potentials": Potential("p", lambda at, p: p["c"] * ufl.dot(at.u, at.u))},
            "potential 'p': energy .* fails",
        ),
    ],
)
def test_what_only_the_model_knows(more, says) -> None:
    with pytest.raises(SceneError, match=says):
        execute(scene(**more))


def test_a_spring_and_a_stop_may_share_a_coordinate() -> None:
    spring = JointSpring("spring", "hinge", stiffness=1.0)
    hinged(JointStop("s", "hinge", -1.0, 1.0, stiffness=1.0), "ep", spring)


@pytest.mark.parametrize(("dt", "warns"), [(1e-3, False), (1e-2, True)])
def test_a_step_through_an_obstacle_is_said(dt, warns) -> None:
    """A ball of 2 cm passes in 10 ms at 10 m/s: unseen, within one step; with 1 ms it rebounds."""
    small = contact(obstacle=Ball((0, 0, 0.955), 0.02), stiffness=1e6)
    start = InitialVelocity(linear=(0, 0, -10.0))
    result = execute(scene(contacts=small, initial=start, dt=dt, t_end=0.02))
    found = [w for w in result.warnings if "contact 'floor'" in w.says and "wrong side" in w.says]
    assert bool(found) == warns
    assert (result.history.momentum_z.iloc[-1] < 0) == warns
