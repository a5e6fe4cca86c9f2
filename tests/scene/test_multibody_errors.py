"""Every impossible connection of bodies gives its own sentence, before anything is built."""

from dataclasses import replace

import numpy as np
import pytest

from shellmb.scene import (
    AlongEdge,
    AlongLine,
    Beam,
    Clamped,
    Cylindrical,
    Distance,
    Driven,
    Driver,
    Fixed,
    FollowerForce,
    Glue,
    Gravity,
    InPlane,
    Isotropic,
    JointSpring,
    Line,
    LineForce,
    Lock,
    Motor,
    PointForce,
    Prismatic,
    Probe,
    Rectangle,
    RectangularSection,
    Revolute,
    RigidBody,
    Scene,
    Shell,
    ShellRevolute,
    Spherical,
    Spring,
    Universal,
    Weld,
)
from tests.sentences import other_sentences

NAN = float("nan")
Z = (0, 0, 1)
TIP = (1, 0, 0)
BAR = RectangularSection(1.0, 0.3, width=0.1, height=0.1, density=1.0)
BEAM = Beam("beam", Line((0, 0, 0), TIP), BAR)
LIGHT = Beam("beam", Line((0, 0, 0), TIP), RectangularSection(1.0, 0.3, width=0.1, height=0.1))
CRANK = RigidBody("crank", 1, (1, 1, 1), points={"pin": (1, 0, 0)})
PLATE = Shell("plate", Rectangle(1, 1), Isotropic(1.0, 0.3, thickness=0.01, density=1.0))
SOLID = replace(PLATE, model="rigid")
RIB = Beam("rib", AlongEdge("plate", "left"), BAR)
HINGE = Revolute("hinge", "crank", axis=Z)
SLIDE = Prismatic("slide", "crank", axis=Z)
BOTH = Cylindrical("both", "crank", axis=Z)
SHELL_END = (
    "is shell 'plate', whose nodes have no frame; it must be the ground, a rigid body or a beam, "
    "connected to it by a Weld (it is the second) or, to a shell, a ShellRevolute joint or an "
    "EdgeHinge along its edge"
)


def moving(*bodies, **kwargs):
    of = {kind: tuple(b for b in bodies if isinstance(b, kind)) for kind in (Shell, Beam)}
    rigid = tuple(b for b in bodies if isinstance(b, RigidBody))
    times = {"scheme": "ep", "dt": 0.1, "t_end": 1.0} | kwargs
    return Scene("s", of[Shell], beams=of[Beam], rigid_bodies=rigid, **times)


def at_rest(*bodies, **kwargs):
    return moving(*bodies, scheme="static", **kwargs)


BAD = {
    # names
    "scene 's': 2 bodies are named 'crank'; each must have a name of its own": lambda: moving(
        CRANK, replace(BEAM, name="crank")
    ),
    "scene 's': a beam is named 'ground'; it must have another name, because this one is "
    "reserved": lambda: moving(replace(BEAM, name="ground")),
    "scene 's': 2 joints are named 'hinge'; each must have a name of its own": lambda: moving(
        CRANK, joints=[HINGE, HINGE]
    ),
    "scene 's': 2 drivers are named 'd'; each must have a name of its own": lambda: moving(
        CRANK, joints=[HINGE, SLIDE], drivers=[Driver("d", "hinge", abs), Driver("d", "slide", abs)]
    ),
    "scene 's': 2 force elements are named 'k'; each must have a name of its own": lambda: moving(
        CRANK,
        joints=HINGE,
        force_elements=[JointSpring("k", "hinge", 1), JointSpring("k", "hinge", 2)],
    ),
    "scene 's': joints[0] is 3; it must be a joint": lambda: moving(CRANK, joints=3),
    "scene 's': force_elements[0] is 3; it must be an element": lambda: moving(
        CRANK, force_elements=3
    ),
    "scene 's': start is 'rest'; it must be 'given' or 'equilibrium'": lambda: moving(
        CRANK, start="rest"
    ),
    # ends of joints
    "revolute joint 'j': there is no body 'wheel'; the scene has 'beam', 'crank'": lambda: moving(
        BEAM, CRANK, joints=Revolute("j", "wheel", axis=Z, at=TIP)
    ),
    "weld 'j': there is no rigid body 'wheel'; the scene has 'crank'": lambda: moving(
        CRANK, joints=Weld("j", "crank", "wheel")
    ),
    "weld 'j': rigid body 'crank' has no point 'nut'; its points are 'origin', 'center', 'pin', or "
    "give coordinates": lambda: moving(CRANK, joints=Weld("j", "crank", at="nut")),
    "weld 'j': beam 'beam' has no point 'tip'; its points are 'start', 'end', or give "
    "coordinates": lambda: moving(
        BEAM, CRANK, joints=Weld("j", "crank", "beam", at="pin", second_at="tip")
    ),
    "weld 'j': shell 'plate' has no point 'tip'; its points are 'left-bottom', 'right-bottom', "
    "'left-top', 'right-top', or give coordinates": lambda: moving(
        PLATE, CRANK, joints=Weld("j", "crank", "plate", at="pin", second_at="tip")
    ),
    "weld 'j': the ground has no point 'pin'; it must be given by coordinates (x, y, z)": lambda: (
        moving(CRANK, joints=Weld("j", "ground", "crank", at="pin"))
    ),
    "weld 'j': at is missing; it must be given where the first body is the ground": lambda: moving(
        CRANK, joints=Weld("j", "ground", "crank")
    ),
    "weld 'j': at is missing; it must be given where the first body is beam 'beam'": lambda: moving(
        BEAM, joints=Weld("j", "beam")
    ),
    f"revolute joint 'j': second {SHELL_END}": lambda: moving(
        PLATE, CRANK, joints=Revolute("j", "crank", "plate", axis=Z)
    ),
    f"universal joint 'j': first {SHELL_END}": lambda: moving(
        PLATE, CRANK, joints=Universal("j", "plate", "crank", at=TIP, axis=Z, second_axis=(1, 0, 0))
    ),
    f"weld 'j': first {SHELL_END}": lambda: moving(
        PLATE, CRANK, joints=Weld("j", "plate", "crank", at=TIP)
    ),
    f"in-plane joint 'j': first {SHELL_END}": lambda: moving(
        PLATE, CRANK, joints=InPlane("j", "plate", "crank", at=TIP, normal=Z)
    ),
    f"shell revolute joint 'j': first {SHELL_END}": lambda: moving(
        PLATE, CRANK, joints=ShellRevolute("j", "plate", "crank", at=TIP)
    ),
    "shell revolute joint 'j': second is rigid body 'crank'; it must be a shell, or use "
    "Weld": lambda: moving(BEAM, CRANK, joints=ShellRevolute("j", "beam", "crank", at=TIP)),
    "shell revolute joint 'j': second is the ground; it must be a shell, or use Weld": lambda: (
        moving(BEAM, joints=ShellRevolute("j", "beam", at=TIP))
    ),
    "distance joint 'j': second_at is missing; it must be the other end of the distance": lambda: (
        moving(CRANK, joints=Distance("j", "crank", length=1))
    ),
    "spherical joint 'j': active has the window (1, 2); it must begin between 0 and the scene's "
    "end 1": lambda: moving(CRANK, joints=Spherical("j", "crank", active=(1, 2))),
    "spherical joint 'j': active has the window (-1, 2); it must begin between 0 and the scene's "
    "end 1": lambda: moving(CRANK, joints=Spherical("j", "crank", active=(-1, 2))),
    # coordinates
    "driver 'd': there is no joint 'lock'; the scene has 'hinge'": lambda: moving(
        CRANK, joints=HINGE, drivers=Driver("d", "lock", abs)
    ),
    "motor 'm': there is no joint 'hinge'; the scene has none": lambda: moving(
        CRANK, force_elements=Motor("m", "hinge", abs)
    ),
    "driver 'd': weld 'w' has no coordinate to act on; it must be a revolute, prismatic, "
    "cylindrical or screw joint": lambda: moving(
        CRANK, joints=Weld("w", "crank"), drivers=Driver("d", "w", abs)
    ),
    "lock of joint 'w': weld 'w' has no coordinate to act on; it must be a revolute, prismatic, "
    "cylindrical or screw joint": lambda: moving(
        CRANK, joints=Weld("w", "crank"), locks=Lock("w", (0, 1))
    ),
    "driver 'd': revolute joint 'hinge' has no translation; it must be 'rotation'": lambda: moving(
        CRANK, joints=HINGE, drivers=Driver("d", "hinge", translation=abs)
    ),
    "joint spring 'k': prismatic joint 'slide' has no rotation; it must be 'translation'": lambda: (
        moving(
            CRANK, joints=SLIDE, force_elements=JointSpring("k", "slide", 1, coordinate="rotation")
        )
    ),
    "motor 'm': coordinate is missing; cylindrical joint 'both' has both 'rotation' and "
    "'translation'": lambda: moving(CRANK, joints=BOTH, force_elements=Motor("m", "both", abs)),
    "driver 'e': the rotation of joint 'hinge' is already prescribed by driver 'd'; it must be "
    "prescribed once": lambda: moving(
        CRANK, joints=HINGE, drivers=[Driver("d", "hinge", abs), Driver("e", "hinge", abs)]
    ),
    "lock of joint 'both': the translation of joint 'both' is already prescribed by driver 'd'; it "
    "must be prescribed once": lambda: moving(
        CRANK, joints=BOTH, drivers=Driver("d", "both", None, abs), locks=Lock("both", (0, 1))
    ),
    "lock of joint 'hinge': the rotation of joint 'hinge' is already prescribed by lock of joint "
    "'hinge'; it must be prescribed once": lambda: moving(
        CRANK, joints=HINGE, locks=[Lock("hinge", (0, 0.5)), Lock("hinge", (0.6, 0.8))]
    ),
    "driver 'd': rotation gives nan at t = 0; it must give a finite number": lambda: moving(
        CRANK, joints=HINGE, drivers=Driver("d", "hinge", lambda t: NAN)
    ),
    "lock of joint 'hinge': active has the window (-2, 3); it must begin at 0 or later": lambda: (
        moving(CRANK, joints=HINGE, locks=Lock("hinge", (-2, 3)))
    ),
    # springs between points
    "spring 'k': there is no body 'wheel'; the scene has 'beam', 'crank'": lambda: moving(
        BEAM, CRANK, force_elements=Spring("k", "beam", "wheel", "end", TIP, 1.0)
    ),
    "spring 'k': rigid body 'crank' has no point 'nut'; its points are 'origin', 'center', 'pin', "
    "or give coordinates": lambda: moving(
        CRANK, force_elements=Spring("k", "ground", "crank", TIP, "nut", 1.0)
    ),
    # glue
    "beam 'rib': it runs along shell 'plate' and is not glued to it; the scene must have "
    "Glue('rib', 'plate')": lambda: moving(PLATE, RIB),
    "beam 'rib': there is no body 'plate'; the scene has none": lambda: moving(RIB),
    "glue: there is no beam 'girder'; the scene has 'rib'": lambda: moving(
        PLATE, RIB, glues=Glue("girder", "plate")
    ),
    "glue: 'plate' is a shell; it must be a beam": lambda: moving(
        PLATE, RIB, glues=Glue("plate", "rib")
    ),
    "glue: beam 'beam' does not run along shell 'plate'; its curve must be AlongEdge or AlongLine "
    "of that shell": lambda: moving(PLATE, BEAM, glues=Glue("beam", "plate")),
    "glue: beam 'rib' has degree 3; it must be 2, that of shell 'plate'": lambda: moving(
        PLATE, replace(RIB, degree=3), glues=Glue("rib", "plate")
    ),
    "glue: beam 'rib' is glued twice; it must be glued once": lambda: moving(
        PLATE, RIB, glues=[Glue("rib", "plate"), Glue("rib", "plate", "director")]
    ),
    "beam 'rib': shell 'plate' has no edge 'north'; its edges are 'left', 'right', 'bottom', "
    "'top'": lambda: moving(
        PLATE, replace(RIB, curve=AlongEdge("plate", "north")), glues=Glue("rib", "plate")
    ),
    "beam 'rib': shell 'plate' has no point 'tip'; its points are 'left-bottom', 'right-bottom', "
    "'left-top', 'right-top', or give coordinates": lambda: moving(
        PLATE, replace(RIB, curve=AlongLine("plate", TIP, "tip")), glues=Glue("rib", "plate")
    ),
    # supports, loads, probes
    "clamped edge: beam 'beam' has no edge 'left'; its edges are 'start', 'end'": lambda: moving(
        BEAM, supports=Clamped("left")
    ),
    "scene 's': drivers[0] is Lock(joint='slide', active=((1.0, 2.0),), coordinate=None...; it "
    "must be a driver; what this is, belongs into locks=": lambda: moving(
        drivers=Lock("slide", active=(1.0, 2.0))
    ),
    "clamped edge: 'crank' is a rigid body; it must be a shell or beam or own body": lambda: moving(
        CRANK, supports=Clamped("left", body="crank")
    ),
    "driven edge: 'beam' is a beam; it must be a shell or own body": lambda: moving(
        BEAM, supports=Driven("start", rotation=abs, body="beam")
    ),
    "fixed components: beam 'beam' has no edge or point 'tip'; its edges are 'start', 'end', its "
    "points 'start', 'end', or give coordinates": lambda: moving(
        BEAM, supports=Fixed("tip", (0, 0, 0))
    ),
    "fixed components: director is (0.0, None, None) on beam 'beam'; it must be left out, because "
    "only a shell has one: use Clamped or a joint to the ground": lambda: moving(
        BEAM, supports=Fixed("end", director=(0, None, None))
    ),
    "line force: it acts on a beam; the scene has none": lambda: moving(
        CRANK, loads=LineForce((0, 0, 1))
    ),
    "line force: 'crank' is a rigid body; it must be a beam": lambda: moving(
        CRANK, BEAM, loads=LineForce((0, 0, 1), body="crank")
    ),
    "follower force: 'plate' is a shell; it must be a beam or rigid body": lambda: moving(
        PLATE, BEAM, loads=FollowerForce(TIP, (0, 0, 1), body="plate")
    ),
    "point force: body is missing; it must be one of 'plate', 'beam', 'crank'": lambda: moving(
        PLATE, BEAM, CRANK, loads=PointForce(TIP, (0, 0, 1))
    ),
    "point force: rigid body 'crank' has no point 'nut'; its points are 'origin', 'center', 'pin', "
    "or give coordinates": lambda: moving(CRANK, loads=PointForce("nut", (0, 0, 1))),
    "gravity: there is no body 'wheel'; the scene has 'beam', 'crank'": lambda: moving(
        CRANK, BEAM, loads=Gravity(body="wheel")
    ),
    "probe 'p': quantity is 'bending' and the body beam 'beam'; it must be a shell; of a beam "
    "record force and moment": lambda: moving(BEAM, probes=Probe("p", "end", "bending")),
    "probe 'p': component is 2; it must be 0 (13), 1 (23) or 'norm' for the shear": lambda: moving(
        PLATE, probes=Probe("p", "left-top", "shear")
    ),
    "probe 'p': quantity is 'rotation' and the body shell 'plate'; it must be a beam or a rigid "
    "body; of a shell record the director": lambda: moving(
        PLATE, probes=Probe("p", "left-top", "rotation")
    ),
    "probe 'p': quantity is 'force' and the body rigid body 'crank'; it must be a beam; "
    "of a shell record membrane, bending and shear": lambda: moving(
        CRANK, probes=Probe("p", "pin", "force")
    ),
    # what makes a solution possible
    "beam 'beam': its mass per length is 0; it must be greater than 0 with scheme 'ep', so give "
    "its section a density": lambda: moving(LIGHT),
    "rigid body 'crank': its mass is 0; it must be greater than 0 with scheme 'ep'": lambda: moving(
        replace(CRANK, mass=0)
    ),
    "rigid body 'crank': nothing supports it, so it can move rigidly; a static scene must support "
    "every body or connect it to one that is supported": lambda: at_rest(
        BEAM, CRANK, supports=Clamped("start")
    ),
}


def test_messages():
    assert not other_sentences(BAD)


SHELL_JOINTS = {
    "spherical, shell first": Spherical("j", "plate", "crank", at=TIP),
    "spherical, shell second": Spherical("j", "crank", "plate"),
    "distance": Distance("j", "plate", "crank", at=TIP, second_at="pin", length=0.1),
    "in plane": InPlane("j", "crank", "plate", normal=Z),
    "weld": Weld("j", "crank", "plate"),
    "shell revolute": ShellRevolute("j", "crank", "plate"),
    "shell revolute on the ground": ShellRevolute("j", "ground", "plate", at=TIP),
}


@pytest.mark.parametrize("name", SHELL_JOINTS)
def test_joints_that_a_shells_node_has(name):
    moving(PLATE, CRANK, joints=SHELL_JOINTS[name])


def test_a_rigid_shell_has_a_frame():
    moving(SOLID, CRANK, joints=Revolute("j", "plate", "crank", at="right-top", axis=Z))
    moving(SOLID, probes=Probe("p", "left-top", "rotation"))


@pytest.mark.parametrize(
    "connection",
    [
        {"joints": Revolute("j", "crank", "beam", at="pin", axis=Z)},
        {"joints": Spherical("j", "ground", "crank", at=TIP)},
        {"force_elements": Spring("k", "beam", "crank", "end", "pin", 1.0, length=1)},
    ],
)
def test_in_statics_joints_and_springs_support(connection):
    at_rest(BEAM, CRANK, supports=Clamped("start"), **connection)


def test_in_statics_a_glue_supports():
    scene = at_rest(PLATE, RIB, glues=Glue("rib", "plate"), supports=Clamped("left", body="plate"))
    np.testing.assert_equal(scene.with_options(mesh=(3, 4), degree=3).beams[0].elements, 3)
