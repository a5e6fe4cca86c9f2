"""Scenes whose runs are frozen: every scheme, every kind of body, a few elements and steps each.

They are small and without symmetry, so that no column of their histories is round-off, and they
use the elements, sections and joints of other tests, so that they compile nothing of their own.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from shellmb.scene import (
    AlongEdge,
    Beam,
    CircularArc,
    CircularSection,
    Clamped,
    Contact,
    Damper,
    Distance,
    Driver,
    EdgeForce,
    GeneralSection,
    Glue,
    Gravity,
    InitialVelocity,
    Isotropic,
    Join,
    JointSpring,
    Line,
    Modal,
    Plane,
    PointForce,
    Probe,
    Rectangle,
    Revolute,
    RigidBody,
    Scene,
    Shell,
    ShellRevolute,
    Solver,
    Spherical,
)
from tests.schemes.test_sections_in_motion import STIFFENING

# what is left of Newton's iterations must be far below what is compared
EXACT = Solver(tolerance=1e-12)
SOFT = Isotropic(E=1.0, nu=0.3, thickness=0.2, density=1.0)
# wave speeds of one, and couplings of all kinds
BEAM = GeneralSection((1.0, 0.4, 0.4, 2e-3, 4e-3, 4e-3), 1.0, second_moments=(4e-3, 0.0, 4e-3))
ALPHA = {"ed": 0.5, "ed3": 0.5, "generalized-alpha": 0.5}


def probes(at: Any, *quantities: str, **more: Any) -> tuple[Probe, ...]:
    """All components of quantities at a point."""
    return tuple(
        Probe(f"{quantity}_{axis}", at, quantity, k, **more)
        for quantity in quantities
        for k, axis in enumerate("xyz")
    )


def stepped(scheme: str, dt: float, steps: int) -> dict[str, Any]:
    """Scheme and steps of a scene."""
    if scheme == "static":
        dt = 1.0 / steps
    return {
        "scheme": scheme,
        "alpha": ALPHA.get(scheme, 0.0),
        "dt": dt,
        "t_end": steps * dt,
        "solver": EXACT,
    }


def begun(scheme: str, *motions: InitialVelocity) -> dict[str, Any]:
    """Initial velocities, which statics has none of."""
    return {} if scheme == "static" else {"initial": motions}


def shell(scheme: str, section: Any = SOFT, force: float = 0.02, **more: Any) -> Scene:
    """A cantilever plate, pulled out of its plane and along its edge."""
    plate = Shell("plate", Rectangle(1.0, 0.5), section, mesh=(2, 1), **more)
    # at rest a tenth bends it as far
    force /= 10 if scheme == "static" else 1
    load = EdgeForce("right", (force, 2 * force, 5 * force), time=lambda t: math.sin(1.5 * t) ** 2)
    return Scene(
        "shell",
        plate,
        supports=Clamped("left"),
        loads=load,
        probes=(*probes((1.0, 0.5, 0), "position", "director"), *resultants()),
        **stepped(scheme, 0.2, 2 if scheme == "static" else 6),
    )


def resultants() -> tuple[Probe, ...]:
    """Forces and moments near the clamp."""
    at = (0.25, 0.25, 0)
    return tuple(Probe(f"{q}_{k}", at, q, k) for q in ("membrane", "bending") for k in range(3))


def beam(scheme: str) -> Scene:
    """A curved beam, clamped at one end and pushed at the other."""
    bow = Beam("beam", CircularArc((0, 0, 0), (1, 0, 0), (0, 1, 0), 1.0), BEAM, elements=2)
    size = 4e-3 if scheme == "static" else 4e-2
    push = PointForce(
        "end", tuple(size * k for k in (0.5, 0.25, 1.0)), time=lambda t: math.sin(1.5 * t) ** 2
    )
    return Scene(
        "beam",
        beams=bow,
        supports=Clamped("start"),
        loads=push,
        probes=probes("end", "position", "rotation"),
        **stepped(scheme, 0.2, 2 if scheme == "static" else 6),
    )


def joint(scheme: str) -> Scene:
    """Shells, beams and rigid bodies with joints, a driver, a spring and a damper."""
    rubber = Isotropic(E=2e6, nu=0.3, thickness=0.02, density=1000.0)
    rod = CircularSection(E=2e6, nu=0.3, radius=0.02, density=1000.0)
    up = Rectangle(0.5, 0.5, origin=(1.0, 0, 0), axis1=(0, 0, 1), axis2=(0, 1, 0))
    inertia = (0.01, 0.02, 0.015)
    return Scene(
        "joint",
        (
            Shell("plate", Rectangle(1.0, 0.5), rubber, mesh=(4, 2)),
            Shell("side", up, rubber, mesh=(2, 2)),
        ),
        joins=Join("plate", "side", "right", "left"),
        beams=(
            Beam("rib", AlongEdge("plate", "bottom"), rod),
            Beam("boom", Line((0, 0.5, 0), (-0.4, 0.5, 0)), rod, elements=3),
        ),
        glues=Glue("rib", "plate", "revolute" if scheme == "ep" else "director"),
        rigid_bodies=(
            RigidBody("bob", 0.3, inertia, position=(-0.4, 0.5, -0.2)),
            RigidBody("arm", 0.2, inertia, position=(-0.4, 0.6, -0.4)),
        ),
        joints=(
            Revolute("bearing", "ground", "rib", at=(0, 0, 0), axis=(0, 1, 0)),
            ShellRevolute("root", "boom", "plate", at=(0, 0.5, 0)),
            Revolute("hinge", "boom", "bob", at=(-0.4, 0.5, 0), axis=(0, 1, 0.2)),
            Spherical("ball", "bob", "arm", at=(-0.4, 0.5, -0.4), mass=0.1),
            Distance("link", "arm", "side", at=(-0.4, 0.6, -0.4), second_at=(1.0, 0.5, 0.5)),
        ),
        drivers=Driver("drive", "bearing", rotation=lambda t: 2 * t**2),
        force_elements=(
            JointSpring("spring", "hinge", 0.5),
            Damper("damper", "ground", "arm", (0, 0, -1), "center", damping=0.3),
        ),
        loads=Gravity((0, 0, -9.81)),
        probes=probes("center", "position", body="arm"),
        initial=InitialVelocity(spin=(0.1, 0.2, 1.0), body="bob"),
        **stepped(scheme, 0.01, 4),
    )


def chain(scheme: str) -> Scene:
    """Two rigid bodies that hang on one another and on the ground."""
    bodies = (
        RigidBody("first", 1.0, (0.1, 0.2, 0.25), (0.5, 0.0, 0.0)),
        RigidBody("second", 0.5, (0.05, 0.1, 0.12), (1.5, 0.1, 0.0)),
    )
    joints = (
        Revolute("axle", "ground", "first", at=(0, 0, 0), axis=(0.2, 1.0, 0.3)),
        Spherical("knee", "first", "second", at=(1, 0, 0)),
    )
    return Scene(
        "chain",
        rigid_bodies=bodies,
        joints=joints,
        force_elements=JointSpring("spring", "axle", 5.0),
        loads=Gravity((0.3, 0.2, -9.81)),
        probes=probes("center", "position", "velocity", body="second"),
        **stepped(scheme, 0.02, 6),
    )


def contact(scheme: str) -> Scene:
    """A spinning ball that falls on a plane and leaves it again."""
    ball = RigidBody("ball", 2.0, (8e-3,) * 3, (0.0, 0.0, 0.1 + 0.02 * 3.0))
    floor = Contact("floor", obstacle=Plane(), stiffness=2e4, radius=0.1, smoothing=0.01)
    return Scene(
        "contact",
        rigid_bodies=ball,
        contacts=floor,
        probes=probes("center", "position", "velocity", body="ball"),
        **begun(scheme, InitialVelocity((0.4, 0.3, -3.0), (1.0, 2.0, 0.5), (0, 0, 0.16))),
        **stepped(scheme, 6e-3, 10),
    )


def modal(scheme: str) -> Scene:
    """A plate in modes, in flight, pushed at a corner as it spins."""
    aluminium = Isotropic(E=70e9, nu=0.3, thickness=5e-3, density=2700.0)
    plate = Shell("plate", Rectangle(1.0, 0.4), aluminium, mesh=(4, 2), model=Modal(modes=8))
    held = {"supports": Clamped("left")} if scheme == "static" else {}
    corner = (1.0, 0.4, 0.0)
    push = PointForce(
        corner,
        (3.0, 2.0, 20.0),
        time=lambda t: math.sin(math.pi * t / 0.05) ** 2 if t < 0.05 else 0,
    )
    return Scene(
        "modal",
        plate,
        loads=(push, Gravity()),
        probes=probes(corner, "position", "velocity"),
        **held,
        **begun(scheme, InitialVelocity((1.0, 0.5, 0.3), (3.0, 1.0, 2.0), (0.5, 0.2, 0.0))),
        **stepped(scheme, 5e-3, 6),
    )


def hyperelastic(scheme: str) -> Scene:
    """The cantilever plate of a section that stiffens, to strains of a tenth."""
    return shell(scheme, STIFFENING, 1e-3 if scheme == "static" else 2e-3)


def triangles(scheme: str) -> Scene:
    """The cantilever plate of triangles, and moved off its middle surface."""
    return shell(scheme, replace(SOFT, offset=0.03), 5e-3, cell="tri")


Kinds = dict[str, tuple[Callable[[str], Scene], tuple[str, ...]]]
KINDS: Kinds = {
    "shell": (shell, ("static", "ep", "ed", "ep4", "ed3", "generalized-alpha")),
    "triangles": (triangles, ("ep",)),
    "beam": (beam, ("static", "ed", "ep4")),
    "joint": (joint, ("ep", "ed")),
    "chain": (chain, ("ep4", "ed3")),
    "contact": (contact, ("ep", "ed", "ep4")),
    "modal": (modal, ("ep", "ed3")),
    "hyperelastic": (hyperelastic, ("static", "ep", "ed3")),
}


def named(kinds: Kinds) -> dict[str, Callable[[], Scene]]:
    """Scenes by kind and scheme."""
    return {
        f"{kind} {scheme}": lambda make=make, scheme=scheme: make(scheme)  # type: ignore[misc]
        for kind, (make, schemes) in kinds.items()
        for scheme in schemes
    }


# of every kind some schemes, which are run every day
SCENES = named(KINDS)
# these on two ranks as well
SHARED = ("shell ed", "joint ep", "contact ep", "modal ep")
