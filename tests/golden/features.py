"""More scenes whose runs are frozen: a joint in all schemes, and what shells may have.

They are as small as those of `scenes`, and most of them compile forms of other tests.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from shellmb.scene import (
    AlongEdge,
    Beam,
    CircularSection,
    Contact,
    Driver,
    EdgeForce,
    EnclosedVolume,
    Gas,
    Glue,
    Gravity,
    InitialVelocity,
    JointDamper,
    JointSpring,
    Line,
    NaturalStrain,
    Plane,
    PointForce,
    Pressure,
    Probe,
    Rectangle,
    Revolute,
    RigidBody,
    Scene,
    Shell,
    ShellDamping,
    ShellRevolute,
    Spherical,
    Weld,
)
from tests.contact.test_faces import plates
from tests.golden.scenes import (
    BEAM,
    EXACT,
    SOFT,
    Kinds,
    beam,
    chain,
    contact,
    hyperelastic,
    joint,
    modal,
    named,
    probes,
    shell,
    stepped,
    triangles,
)
from tests.model.test_volumes import ball, octant


def hinge(scheme: str) -> Scene:
    """A beam on a hinge with a spring and a damper, and a weight on a ball joint at its end."""
    size = 1e-3 if scheme == "static" else 1e-2
    # at rest nothing would hold a ball joint
    end = Weld if scheme == "static" else Spherical
    return Scene(
        "hinge",
        beams=Beam("beam", Line((0, 0, 0), (1, 0.2, 0)), BEAM, elements=2),
        rigid_bodies=RigidBody("weight", 0.2, (0.01, 0.02, 0.015), position=(1.0, 0.2, -0.2)),
        joints=(
            Revolute("axle", "ground", "beam", at=(0, 0, 0), axis=(0.2, 1.0, 0.3)),
            end("ball", "beam", "weight", at=(1, 0.2, 0)),
        ),
        force_elements=(
            JointSpring("spring", "axle", 0.05),
            *(() if scheme == "static" else (JointDamper("damper", "axle", damping=0.01),)),
        ),
        loads=(
            Gravity((0, 0, -size), body="weight"),
            PointForce("end", (0, 0, -size), body="beam", time=lambda t: math.cos(t)),
        ),
        probes=probes("center", "position", "rotation", body="weight"),
        **stepped(scheme, 0.2, 2 if scheme == "static" else 6),
    )


def panel(scheme: str) -> Scene:
    """A shell on a driven arm by eq. (35), with a rib that is glued to its edge."""
    rod = CircularSection(E=1.0, nu=0.3, radius=0.1, density=1.0)
    return Scene(
        "panel",
        Shell("plate", Rectangle(1.0, 0.5), SOFT, mesh=(2, 1)),
        beams=Beam("rib", AlongEdge("plate", "right"), rod),
        glues=Glue("rib", "plate", "director"),
        rigid_bodies=RigidBody("arm", 0.2, (0.01, 0.02, 0.015), position=(-0.2, 0, 0)),
        joints=(
            Revolute("axle", "ground", "arm", at=(-0.4, 0, 0), axis=(0, 1, 0)),
            ShellRevolute("root", "arm", "plate", at=(0, 0, 0)),
        ),
        drivers=Driver("drive", "axle", rotation=lambda t: 0.1 * t**2),
        probes=probes((1.0, 0.5, 0), "position", "director", body="plate"),
        initial=InitialVelocity(spin=(0.0, 0.0, 0.2), body="plate", about=(0, 0, 0)),
        **stepped(scheme, 0.2, 5),
    )


def pressed(scheme: str) -> Scene:
    """The cantilever plate, bent until it touches a floor; in motion it rubs there."""
    made = shell(scheme, SOFT, 5e-3)
    floor = Plane(normal=(0, 0, 1), point=(0, 0, -0.02))
    rubs = {} if scheme == "static" else {"friction": 0.2, "slip_speed": 0.05}
    touch = Contact("floor", floor, 0.5, smoothing=1e-2, **rubs)
    size = 2e-3 if scheme == "static" else 2e-2
    return replace(made, contacts=touch, loads=EdgeForce("right", (size, size / 3, -size)))


def faces(scheme: str) -> Scene:
    """Two plates that meet as both fly on."""
    made = plates(spin=(0.5, 1.0, 2.0), t_end=6e-4, dt=2e-4, scheme=scheme)
    along = np.array([0.7, 0.4, 0.3])
    flying = [replace(motion, linear=tuple(motion.linear + along)) for motion in made.initial]
    return replace(made, initial=flying, solver=EXACT)


def damped(scheme: str) -> Scene:
    """The cantilever plate of a viscous section."""
    slow = ShellDamping(membrane=0.05, bending=0.1, shear=0.05)
    return shell(scheme, replace(SOFT, stiffness_damping=slow, mass_damping=0.1))


def natural(scheme: str) -> Scene:
    """The cantilever plate that is heated and curved by and by; at rest, at once."""
    heat = NaturalStrain(
        (1e-2, 2e-2, 5e-3), (0.1, -0.05, 0.05), time=lambda t: math.sin(2.0 * t) + 0.5
    )
    return shell(scheme, SOFT, 5e-3, natural=heat)


def volume(scheme: str) -> Scene:
    """A gas in a ball: in flight, or between planes of symmetry where a load presses it."""
    gas = EnclosedVolume("gas", gas=Gas(5.0, ambient=1.0))
    if scheme == "static":
        return octant(volumes=gas, loads=Pressure(-1.0), **stepped(scheme, 1.0, 2))
    flying = InitialVelocity(linear=(0.1, -0.2, 0.3), spin=(1.0, 2.0, -1.5))
    seen = (*probes((0, 0, 1), "position"), Probe("m", (1, 0, 0), "membrane", 0))
    return ball(volumes=gas, initial=flying, probes=seen, **stepped(scheme, 0.02, 5))


def small(scheme: str) -> Scene:
    """The cantilever plate by small displacements."""
    made = shell("static" if scheme == "linear-statics" else "ep", SOFT, 5e-3)
    return replace(made, scheme=scheme)


MOTIONS = ("ep", "ed", "ep4", "ed3")
ALL = ("static", *MOTIONS)
# what `scenes` leaves out of its own kinds, and others; run with `-m slow`
KINDS: Kinds = {
    "triangles": (triangles, ("static", "ed", "ep4", "ed3")),
    "beam": (beam, ("ep", "ed3")),
    "joint": (joint, ("ep4", "ed3")),
    "chain": (chain, ("ep", "ed")),
    "hinge": (hinge, ALL),
    "panel": (panel, MOTIONS),
    "contact": (contact, ("ed3",)),
    "pressed": (pressed, ALL),
    "faces": (faces, MOTIONS),
    "modal": (modal, ("static", "ed", "ep4")),
    "hyperelastic": (hyperelastic, ("ed", "ep4")),
    "damped": (damped, MOTIONS),
    "natural": (natural, ALL),
    "volume": (volume, ALL),
    "small": (small, ("linear-statics", "linear-dynamics")),
}
SCENES = named(KINDS)
# these on two ranks as well
SHARED = ("panel ed", "pressed ed3", "faces ep", "natural ep4", "volume ed3", "hinge static")
