"""Scene functions that follow static paths: a truss, a roof, a frame, strips."""

import math
from dataclasses import replace
from typing import Any

import shellmb as sm
from tests.sensitivity import scenes
from tests.simulate.test_arclength import truss as unit_truss

UP = (0.0, 0.0, 1.0)


def truss(
    rise: float = 0.5,
    stiffness: float = 2.0,
    span: float = 1.0,
    push: float = 2.0,
    across: float = 0.0,
    sideways: bool = False,
    dt: float = 0.02,
    t_end: float = 0.4,
    **path: Any,
) -> sm.Scene:
    """Two springs that meet at a height and are pushed down there."""
    made = unit_truss(rise, sideways)
    top, head = (0.0, 0.0, rise), made.rigid_bodies[-1].name
    springs = [
        sm.Spring(f"bar {k}", sm.GROUND, head, (x, 0, 0), top, stiffness=stiffness)
        for k, x in enumerate((-span, span))
    ]
    return replace(
        made,
        force_elements=springs,
        loads=sm.PointForce(top, (across, 0.0, -push), body=head),
        path=sm.PathFollowing(**path),
        dt=dt,
        t_end=t_end,
    )


def roof(
    radius: float = 2540.0,
    E: float = 3102.75,
    thickness: float = 12.7,
    force: float = 750.0,
    length: float = 254.0,
    unit: float = 1.0,
    t_end: float = 50.0,
    **path: Any,
) -> sm.Scene:
    """A quarter of a hinged roof, which snaps through; in mm, or in other units of length."""
    shape = sm.Cylinder(
        radius * unit,
        length * unit,
        angles=(0.0, math.degrees(0.1)),
        axis=(0, 1, 0),
        start=UP,
    )
    skin = sm.Isotropic(E=E / unit**2, nu=0.3, thickness=thickness * unit)
    top = (0.0, 0.0, radius * unit)
    return sm.Scene(
        "roof",
        sm.Shell("roof", shape, skin, mesh=(2, 2)),
        supports=[
            sm.Hinged("right"),
            sm.SymmetryPlane("left", (1, 0, 0)),
            sm.SymmetryPlane("bottom", (0, 1, 0)),
        ],
        loads=sm.PointForce(top, (0, 0, -force)),
        probes=sm.Probe("w", top, component=2),
        scheme="static",
        dt=0.2,
        t_end=t_end,
        path=sm.PathFollowing(**path),
    )


def bent(
    thickness: float = 4e-3, angle: float = 0.6, length: float = 1.0, E: float = 210e9
) -> sm.Scene:
    """A strip whose edge is turned and moved by the load factor."""
    made = scenes.plate("static", thickness=thickness, length=length, E=E, force=0.0)
    given = sm.Driven(
        "right",
        about=(length, 0.0, 0.0),
        axis=(0, 1, 0),
        rotation=lambda factor: -angle * factor,
        translation=lambda factor: (-0.2 * factor, 0.0, -0.1 * factor),
    )
    supports = (sm.Clamped("left"), given)
    path = sm.PathFollowing(load_end=1.0)
    return replace(made, supports=supports, loads=(), path=path, dt=0.2, t_end=10.0)


def pressed(
    thickness: float = 4e-3, stiffness: float = 1e5, gap: float = 8e-3, force: float = 30.0
) -> sm.Scene:
    """A strip whose end is pressed to a plane."""
    made = scenes.plate("static", thickness=thickness)
    floor = sm.Plane(normal=UP, point=(0, 0, -gap))
    touch = sm.Contact("floor", floor, stiffness, body="strip", smoothing=1e-3)
    loads = sm.EdgeForce("right", (0, 0, -force))
    path = sm.PathFollowing()
    return replace(made, loads=loads, contacts=touch, path=path, dt=0.1, t_end=2.0)


def followed(thickness: float = 4e-3, length: float = 1.0, E: float = 210e9) -> sm.Scene:
    """A strip under a load that follows its edge, beside which nothing is known of stability."""
    made = scenes.plate("static", thickness=thickness, length=length, E=E)
    pull = sm.FollowerEdgeForce("right", (0, 0, 3e3))
    return replace(made, loads=pull, path=sm.PathFollowing(load_end=1.0), dt=0.2, t_end=10.0)


def frame(E: float = 720.0, length: float = 120.0, width: float = 3.0) -> sm.Scene:
    """Lee's frame [cm, kN]."""
    section = sm.RectangularSection(width=width, height=2 * width / 3, E=E, nu=0.3, density=1.0)
    corner, right, at = (0.0, 0.0, length), (length, 0.0, length), (length / 5, 0.0, length)
    beams = (
        sm.Beam("column", sm.Line((0, 0, 0), corner), section, elements=4),
        sm.Beam("top", sm.Line(corner, right), section, elements=5),
    )
    joints = (
        sm.Revolute("foot", sm.GROUND, "column", at=(0, 0, 0), axis=(0, 1, 0)),
        sm.Revolute("far", sm.GROUND, "top", at=right, axis=(0, 1, 0)),
        sm.Weld("corner", "column", "top", at=corner),
    )
    return sm.Scene(
        "frame",
        beams=beams,
        joints=joints,
        loads=sm.PointForce(at, (0, 0, -1.0), body="top"),
        probes=sm.Probe("w", at, body="top", component=2),
        scheme="static",
        dt=0.2,
        t_end=1e3,
        path=sm.PathFollowing(load_end=1.9, branches="ignore"),
    )
