"""A second set of cases: shells in closed form and from CAD, higher modes, spin, four bars."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

import shellmb as sm
from shellmb.scene import Beam, Isotropic, Scene, Shell
from tests.bench.errors.bodies import strip
from tests.bench.errors.case import Case

STEEL = Isotropic(E=210e9, nu=0.3, thickness=5e-3, density=7850)
BAR = sm.RectangularSection(210e9, 0.3, width=0.02, height=0.01, density=7850)
LIGHT: dict[str, Any] = {"E": 70e9, "nu": 0.3, "density": 2700}
# of a scene whose modes are judged
AT_REST: dict[str, Any] = {"scheme": "ep", "dt": 1e-3, "t_end": 1e-2}
Y = (0.0, 1.0, 0.0)


def probes(name: str, at: Any, axes: str = "xyz", body: str | None = None) -> tuple[sm.Probe, ...]:
    """Probes of a point along some axes."""
    parts: dict[str, Any] = {"x": 0, "y": 1, "z": 2}
    return tuple(sm.Probe(f"{name}_{a}", at, component=parts[a], body=body) for a in axes)


def disc() -> Scene:
    """Clamped disc under pressure, in linear statics."""
    return Scene(
        "disc",
        (Shell("disc", sm.Disc(0.5), replace(STEEL, thickness=0.01), mesh=(3, 4)),),
        supports=(sm.Clamped("top"),),
        loads=(sm.Pressure(1e2),),
        probes=probes("middle", (0.0, 0.0, 0.0), "z"),
        scheme="linear-statics",
    )


def disc_exactly() -> float:
    """Deflection of the disc's middle by the theory of Reissner and Mindlin [m]."""
    modulus, ratio, thickness, radius, pressure = 210e9, 0.3, 0.01, 0.5, 1e2
    bending = modulus * thickness**3 / 12 / (1 - ratio**2)
    shear = 5 / 6 * modulus / 2 / (1 + ratio) * thickness
    return pressure * radius**4 / 64 / bending + pressure * radius**2 / 4 / shear


def roof(**options: Any) -> Scene:
    """Quarter of the Scordelis-Lo roof under its weight."""
    angle, radius = 40.0, 25.0
    surface = sm.Cylinder(radius, 25.0, angles=(0, angle), axis=(0, 1, 0), start=(0, 0, 1))
    edge = (
        radius * math.sin(math.radians(angle)),
        0.0,
        radius * math.cos(math.radians(angle)),
    )
    section = Isotropic(4.32e8, 0.0, thickness=0.25, density=36.7)
    given: dict[str, Any] = {"scheme": "linear-statics", "loads": (sm.SurfaceForce((0, 0, -90.0)),)}
    return Scene(
        "roof",
        (Shell("roof", surface, section, mesh=(4, 4)),),
        supports=(
            sm.SymmetryPlane("left", (1, 0, 0)),
            sm.SymmetryPlane("bottom", (0, 1, 0)),
            sm.Diaphragm("top", axis=(0, 1, 0)),
        ),
        probes=probes("edge", edge, "z"),
        **(given | options),
    )


def twisted() -> Scene:
    """Strip that is twisted by a right angle, bent far by a force at its end."""

    def helicoid(xi: Any, eta: Any) -> Any:
        angle, y = np.pi / 2 * xi, 1.1 * (eta - 0.5)
        return np.stack([12 * xi, y * np.cos(angle), y * np.sin(angle)])

    section = Isotropic(29e6, 0.22, thickness=0.32)
    return Scene(
        "twisted",
        (Shell("strip", sm.Parametric(helicoid), section, mesh=(6, 2)),),
        supports=(sm.Clamped("left"),),
        loads=(sm.EdgeForce("right", (0, 400.0 / 1.1, 0)),),
        probes=probes("tip", (12.0, 0.0, 0.0)),
        scheme="static",
    )


def bimetal() -> Scene:
    """Heated strip of steel and copper that cannot curl at its clamped edge."""
    ply: dict[str, Any] = {"nu12": 0.3}
    steel = sm.PlyMaterial(E1=200e9, E2=200e9, G12=77e9, G13=77e9, G23=77e9, **ply)
    copper = sm.PlyMaterial(E1=120e9, E2=120e9, G12=45e9, G13=45e9, G23=45e9, **ply)
    section = sm.Laminate((sm.Ply(steel, 0.5e-3), sm.Ply(copper, 0.5e-3)))
    hot = sm.thermal_strain(section, expansions=[12e-6, 17e-6], temperature=100.0)
    return Scene(
        "bimetal",
        (Shell("strip", sm.Rectangle(0.1, 0.02), section, mesh=(4, 1), natural=hot),),
        supports=(sm.Clamped("left"),),
        probes=probes("tip", "right-top", "xz"),
        scheme="static",
    )


def holed(**options: Any) -> Scene:
    """Plate with a hole, which gmsh meshes anew for each size of elements."""

    def build(gmsh: Any, mesh: tuple[int, int]) -> None:
        occ = gmsh.model.occ
        square, disk = occ.addRectangle(0, 0, 0, 1, 1), occ.addDisk(0.5, 0.5, 0, 0.2, 0.2)
        (surface,), _ = occ.cut([(2, square)], [(2, disk)])
        occ.synchronize()
        gmsh.model.addPhysicalGroup(2, [surface[1]], name="plate")
        for dim, tag in gmsh.model.getBoundary([surface]):
            x, _, _ = occ.getCenterOfMass(dim, abs(tag))
            for name, place in (("left", 0.0), ("right", 1.0)):
                if math.isclose(x, place, abs_tol=1e-9):
                    gmsh.model.addPhysicalGroup(1, [abs(tag)], name=name)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 1 / mesh[0])

    given: dict[str, Any] = {"scheme": "static", "loads": (sm.EdgeForce("right", (0, 0, -10.0)),)}
    return Scene(
        "holed",
        (Shell("plate", sm.GmshModel(build), STEEL, mesh=(6, 6)),),
        supports=(sm.Clamped("left"),),
        probes=probes("tip", (1.0, 0.5, 0.0), "z"),
        **(given | options),
    )


def frame() -> Scene:
    """Post and arm of steel under their weight and a force across."""
    line, arm = sm.Line((0, 0, 0), (0, 0, 1)), sm.Line((0, 0, 1), (1, 0, 1))
    round_bar = sm.CircularSection(210e9, 0.3, radius=0.01, density=7850)
    return Scene(
        "frame",
        beams=(
            Beam("post", line, round_bar, elements=2, up=(1, 0, 0)),
            Beam("arm", arm, round_bar, elements=2),
        ),
        supports=(sm.Clamped("start", body="post"),),
        joints=(sm.Weld("corner", "post", "arm", at=(0, 0, 1)),),
        loads=(sm.Gravity(), sm.PointForce("end", (0, 50.0, 0), body="arm")),
        probes=probes("tip", "end", body="arm"),
        scheme="static",
    )


def bar(elements: int, *held: str) -> Scene:
    """Bar without loads, for its modes."""
    body = Beam("bar", sm.Line((0, 0, 0), (1, 0, 0)), BAR, elements=elements)
    return Scene("bar", beams=(body,), supports=(sm.Clamped(held),) if held else (), **AT_REST)


def tube() -> Scene:
    """Thin tube that is clamped at one end, for its modes."""
    body = Shell("tube", sm.Cylinder(0.1, 0.4), Isotropic(thickness=2e-3, **LIGHT), mesh=(8, 4))
    return Scene("tube", (body,), supports=(sm.Clamped("bottom"),), **AT_REST)


def spinning(scheme: str, dt: float, **options: Any) -> Scene:
    """Free bar that spins about a skew axis, and is hit."""
    section = sm.RectangularSection(width=0.04, height=0.01, **LIGHT)
    hit = sm.Table((0.0, 0.05, 0.1, 0.2), (0.0, 1.0, 0.0, 0.0))
    return Scene(
        "spinning",
        beams=(Beam("bar", sm.Line((-0.5, 0, 0), (0.5, 0, 0)), section, elements=4),),
        initial=(sm.InitialVelocity(spin=(0.0, 3.0, 10.0)),),
        loads=(sm.PointForce("end", (0, 30.0, 0), time=hit),),
        probes=probes("end", "end"),
        scheme=scheme,
        dt=dt,
        t_end=0.5,
        **options,
    )


def four_bar(scheme: str, dt: float = 5e-3, rigid: bool = False) -> Scene:
    """Four bars that a drive starts from rest, with a jump of its acceleration."""
    points = {"A": (0, 0, 0), "B": (0, 0, 0.2), "C": (0.6, 0, 0.5), "D": (0.6, 0, 0)}
    section = sm.RectangularSection(width=0.02, height=0.005, **LIGHT)
    options: dict[str, Any] = {"model": "rigid"} if rigid else {}
    bars = (("crank", "A", "B"), ("coupler", "B", "C"), ("rocker", "D", "C"))
    return Scene(
        "bars",
        beams=tuple(
            Beam(name, sm.Line(points[a], points[b]), section, elements=2, up=Y, **options)
            for name, a, b in bars
        ),
        joints=(
            sm.Revolute("a", sm.GROUND, "crank", at=points["A"], axis=Y),
            sm.Revolute("b", "crank", "coupler", at=points["B"], axis=Y),
            sm.Spherical("c", "coupler", "rocker", at=points["C"]),
            sm.Revolute("d", sm.GROUND, "rocker", at=points["D"], axis=Y),
        ),
        drivers=(sm.Driver("drive", "a", rotation=lambda t: 12.0 * t**2 / (0.2 + t)),),
        probes=probes("c", points["C"], "xz", body="rocker"),
        redundant="drop" if rigid else "error",
        scheme=scheme,
        dt=dt,
        t_end=0.5,
    )


TIP = ("tip_y:end", "tip_z:l2")
SIX = tuple(f"f{k}" for k in range(1, 7))

SECOND = (
    Case("clamped disc", "statics", disc, ("middle_z:end",), {"middle_z:end": disc_exactly()}),
    Case("roof of Scordelis and Lo", "statics", roof, ("edge_z:end",)),
    Case("twisted strip", "statics", twisted, ("tip_x:end", *TIP), mesh=3),
    Case("heated bimetal", "statics", bimetal, ("tip_x:end", "tip_z:end")),
    Case("plate with a hole, CAD", "statics", holed, ("tip_z:end", "tip_z:l2"), mesh=3),
    Case("frame", "statics", frame, ("tip_x:end", *TIP), mesh=4),
    Case(
        "bent strip, degree 3, 2x1",
        "statics",
        lambda: strip((2, 1)).with_options(degree=3),
        ("tip_u:end", "tip_w:end"),
        mesh=4,
    ),
    Case("modes of a bar of 2 elements", "modes", lambda: bar(2, "start"), SIX, mesh=8),
    Case("modes of a clamped bar", "modes", lambda: bar(4, "start", "end"), SIX, mesh=4),
    Case("modes of a free bar", "modes", lambda: bar(4), ("f7", "f8", "f9", "f10"), mesh=4),
    Case("modes of a tube", "modes", tube, SIX),
    Case("modes of a roof", "modes", lambda: roof(**AT_REST, loads=()), SIX),
    Case("modes of a plate with a hole", "modes", lambda: holed(**AT_REST, loads=()), SIX),
    Case(
        "spinning bar, EP4",
        "motion",
        lambda: spinning("ep4", 1e-2),
        ("end_x:l2", "end_y:l2", "end_x:end", "end_z:max"),
    ),
    Case(
        "spinning bar, EP",
        "motion",
        lambda: spinning("ep", 5e-3),
        ("end_x:l2", "end_y:end", "end_z:min"),
    ),
    Case(
        "spinning bar, ED3",
        "motion",
        lambda: spinning("ed3", 1e-2, alpha=0.5),
        ("end_x:l2", "end_y:min", "end_z:end"),
    ),
    Case("four bars, EP", "mechanism", lambda: four_bar("ep"), ("c_x:l2", "c_z:l2", "c_z:min")),
    Case("four bars, ED3", "mechanism", lambda: four_bar("ed3"), ("c_x:l2", "c_z:l2", "c_x:end")),
    Case(
        "four rigid bars, EP4",
        "mechanism",
        lambda: four_bar("ep4", 1e-2, rigid=True),
        ("c_x:l2", "c_x:min", "c_z:l2"),
    ),
)
