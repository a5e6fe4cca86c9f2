"""Cases that are hard to tell: resultants at single points, singular points, blows and chaos."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

import shellmb as sm
from shellmb.scene import Isotropic, Scene, Shell
from tests.bench.errors.bodies import plate, rod, square, strip
from tests.bench.errors.case import Case
from tests.bench.errors.second import roof

STEEL = Isotropic(E=210e9, nu=0.3, thickness=5e-3, density=7850)
QUANTITIES: dict[str, Any] = {"m": "bending", "n": "membrane", "q": "shear"}


def probed(scene: Scene, **at: tuple[Any, ...]) -> Scene:
    """A scene with probes of resultants: "m11_middle" is the moment 11 at a place.

    Args:
        scene: The scene.
        at: Places by the names of the probes.
    """
    parts = {"11": 0, "22": 1, "12": 2, "1": 0, "2": 1}
    found = tuple(
        sm.Probe(name, place, QUANTITIES[name[0]], parts[name[1:].split("_")[0]])
        for name, place in at.items()
    )
    return replace(scene, probes=found)


def pushed(mesh: tuple[int, int], cell: Any = "quad") -> Scene:
    """Plate on four edges with a force in its middle, in linear statics."""
    body = Shell("plate", sm.Rectangle(1.0, 1.0), STEEL, mesh=mesh, cell=cell)
    scene = Scene(
        "pushed",
        (body,),
        supports=(sm.Clamped(("left", "right", "bottom", "top")),),
        loads=(sm.PointForce((0.5, 0.5, 0.0), (0, 0, 100.0)),),
        scheme="linear-statics",
    )
    return probed(scene, m11_force=(0.5, 0.5, 0.0), m11_away=(0.25, 0.25, 0.0))


def angle(size: int, load: str = "pressure") -> Scene:
    """Plate of the shape of an L, clamped at both ends, with its re-entrant corner."""

    def build(gmsh: Any, mesh: tuple[int, int]) -> None:
        occ = gmsh.model.occ
        whole, part = occ.addRectangle(0, 0, 0, 1, 1), occ.addRectangle(0.5, 0.5, 0, 0.5, 0.5)
        (surface,), _ = occ.cut([(2, whole)], [(2, part)])
        occ.synchronize()
        gmsh.model.addPhysicalGroup(2, [surface[1]], name="plate")
        for dim, tag in gmsh.model.getBoundary([surface]):
            x, y, _ = occ.getCenterOfMass(dim, abs(tag))
            for name, here in (("right", x > 0.99), ("top", y > 0.99)):
                if here:
                    gmsh.model.addPhysicalGroup(1, [abs(tag)], name=name)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 1 / mesh[0])

    loads: Any = sm.Pressure(1e3) if load == "pressure" else sm.EdgeForce("top", (1e3, 0, 0))
    held = ("right", "top") if load == "pressure" else ("right",)
    scene = Scene(
        "angle",
        (Shell("plate", sm.GmshModel(build), STEEL, mesh=(size, size)),),
        supports=(sm.Clamped(held),),
        loads=(loads,),
        scheme="linear-statics",
    )
    if load == "pressure":
        return probed(scene, m11_corner=(0.5, 0.5, 0.0), m11_end=(1.0, 0.0, 0.0))
    return probed(scene, n11_corner=(0.5, 0.5, 0.0), n11_end=(1.0, 0.0, 0.0))


def hit(scheme: str, **options: Any) -> Scene:
    """Cantilever plate that is hit at its end within a few steps."""
    blow = sm.Table((0.0, 2e-3, 4e-3, 1.0), (0.0, 1.0, 0.0, 0.0))
    scene = plate(scheme, **({"dt": 1e-3, "t_end": 0.1} | options))
    scene = replace(scene, loads=(sm.EdgeForce("right", (0, 0, 500.0), time=blow),))
    return probed(scene, m11_root=(0.0, 0.04, 0.0), m11_half=(0.5, 0.04, 0.0))


def double_pendulum(scheme: str, dt: float, t_end: float = 6.0) -> Scene:
    """Two rigid links that fall from beyond the horizontal: their motion is chaotic."""
    inertia = (1e-3, 4e-3, 4e-3)
    bodies = tuple(
        sm.RigidBody(
            f"link{k}", 1.0, inertia, position=(0, 0, 0.1 + 0.2 * k), points={"end": (0, 0, 0.1)}
        )
        for k in range(2)
    )
    names = (sm.GROUND, "link0", "link1")
    joints = tuple(
        sm.Revolute(f"hinge{k}", names[k], names[k + 1], at=(0, 0, 0.2 * k), axis=(0, 1, 0))
        for k in range(2)
    )
    return Scene(
        "double",
        rigid_bodies=bodies,
        joints=joints,
        loads=(sm.Gravity((0, 0, -9.81)),),
        initial=(
            sm.InitialVelocity(spin=(0, 3.0, 0), body="link0"),
            sm.InitialVelocity((0.6, 0, 0), (0, 3.0, 0), body="link1"),
        ),
        probes=tuple(
            sm.Probe(n, (0, 0, 0.4), component=k, body="link1") for n, k in (("bx", 0), ("bz", 2))
        ),
        scheme=scheme,
        dt=dt,
        t_end=t_end,
    )


EDGES: dict[str, Any] = {
    "m11_middle": (0.5, 0.5, 0.0),
    "m11_edge": (0.0, 0.5, 0.0),
    "n11_middle": (0.5, 0.5, 0.0),
}
ROOT: dict[str, Any] = {"m11_root": (0.0, 0.04, 0.0), "m11_half": (0.5, 0.04, 0.0)}


def ends(scene: Scene, norm: str = "end") -> tuple[str, ...]:
    """All probes of a scene in one norm."""
    return tuple(f"{probe.name}:{norm}" for probe in scene.probes)


def clamped(n: int, **options: Any) -> Scene:
    """The clamped square with resultants in its middle and at an edge."""
    return probed(square((n, n), **options), **EDGES)


def bent(nx: int, ny: int) -> Scene:
    """The bent strip with resultants at its root, the corner of that, and half-way."""
    return probed(strip((nx, ny)), **ROOT, m11_corner=(0.0, 0.0, 0.0))


def vault(n: int) -> Scene:
    """The roof with resultants at its free edge and its top."""
    place = 25.0 * np.sin(np.radians(40.0)), 0.0, 25.0 * np.cos(np.radians(40.0))
    top = (0.0, 0.0, 25.0)
    return probed(roof().with_options(mesh=(n, n)), n22_edge=place, m11_top=top, n22_top=top)


def bar(elements: int, **options: Any) -> Scene:
    """The rod with its moments and its force across."""
    half = (0.5, 0.0, 0.0)
    found: Any = (
        sm.Probe("m_root", "start", "moment", 1),
        sm.Probe("m_half", half, "moment", 1),
        sm.Probe("q_half", half, "force", 2),
    )
    return replace(rod(elements, **options), probes=found)


def ramped(scheme: str, dt: float, **options: Any) -> Scene:
    """The plate under a ramp with its moments."""
    return probed(plate(scheme, "ramp", dt=dt, t_end=0.3, **options), **ROOT)


MOMENTS = ("m11_root:l2", "m11_root:min", "m11_half:l2", "m11_half:end")
CHAOS = ("bx:l2", "bz:l2", "bz:end", "bx:max")
DAMPED: dict[str, Any] = {"alpha": 0.5}

POINTS = (
    Case("resultants, square 4x4", "statics", lambda: clamped(4), ends(clamped(4))),
    Case("resultants, square 8x8", "statics", lambda: clamped(8), ends(clamped(8))),
    Case("resultants, triangles", "statics", lambda: clamped(6, cell="tri"), ends(clamped(6))),
    Case("resultants, strip 4x1", "statics", lambda: bent(4, 1), ends(bent(4, 1))),
    Case("resultants, strip 8x2", "statics", lambda: bent(8, 2), ends(bent(8, 2))),
    Case("resultants, roof 4x4", "statics", lambda: vault(4), ends(vault(4))),
    Case("resultants, roof 8x8", "statics", lambda: vault(8), ends(vault(8))),
    Case("resultants, rod", "statics", lambda: bar(2), ends(bar(2))),
    Case("point force, 4x4", "statics", lambda: pushed((4, 4)), ends(pushed((4, 4)))),
    Case("point force, 8x8", "statics", lambda: pushed((8, 8)), ends(pushed((8, 8)))),
    Case(
        "point force, triangles",
        "statics",
        lambda: pushed((8, 8), "tri"),
        ends(pushed((8, 8))),
    ),
    Case("re-entrant corner", "statics", lambda: angle(8), ends(angle(8))),
    Case("re-entrant corner, plane", "statics", lambda: angle(8, "side"), ends(angle(8, "side"))),
    Case(
        "resultants, rod, ramp",
        "motion",
        lambda: bar(4, scheme="ep4", dt=1e-2, t_end=0.5),
        ("m_root:l2", "m_root:min", "m_half:l2"),
    ),
    Case("resultants, ramp, EP4", "motion", lambda: ramped("ep4", 5e-3), MOMENTS),
    Case("resultants, ramp, ED3", "motion", lambda: ramped("ed3", 5e-3, **DAMPED), MOMENTS),
    Case("hit plate, EP4", "motion", lambda: hit("ep4"), MOMENTS, step=4),
    Case("hit plate, ED3", "motion", lambda: hit("ed3", **DAMPED), MOMENTS, step=4),
    Case("double pendulum, 2 s", "mechanism", lambda: double_pendulum("ep4", 0.01, 2.0), CHAOS),
    Case("double pendulum, 4 s", "mechanism", lambda: double_pendulum("ep4", 0.01, 4.0), CHAOS),
    Case("double pendulum, 8 s", "mechanism", lambda: double_pendulum("ep4", 0.01, 8.0), CHAOS),
    Case("double pendulum, EP", "mechanism", lambda: double_pendulum("ep", 5e-3, 4.0), CHAOS),
    Case("double pendulum, EP, 8 s", "mechanism", lambda: double_pendulum("ep", 5e-3, 8.0), CHAOS),
)
