"""Curved shells of the obstacle course, small displacements, by symmetry on a part of each."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from shellmb.arrays import Floats
from shellmb.scene import (
    Cylinder,
    Diaphragm,
    Fixed,
    Isotropic,
    Parametric,
    PointForce,
    Scene,
    Shell,
    Sphere,
    Support,
    Surface,
    SurfaceForce,
    SymmetryPlane,
)
from shellmb.verify.cases import Check, case
from shellmb.verify.solve import linear_displacement

MESH = (16, 16)
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
# angle from the crown (z axis) towards x, axis along y, from the middle to one end
QUADRANT: dict[str, Any] = {"axis": Y, "start": Z}
DIAPHRAGM = Diaphragm("top", Y)


def scordelis_lo() -> Scene:
    """A quarter of the Scordelis-Lo roof under its weight; downward at "right-bottom"."""
    surface = Cylinder(25.0, 25.0, angles=(0.0, 40.0), **QUADRANT)
    shell = Shell("roof", surface, Isotropic(4.32e8, 0.0, 0.25), mesh=MESH)
    supports = (SymmetryPlane("left", X), SymmetryPlane("bottom", Y), DIAPHRAGM)
    weight = SurfaceForce((0.0, 0.0, -90.0))
    return Scene("roof", (shell,), supports=supports, loads=(weight,), scheme="linear")


def _graded(s: Floats) -> Floats:
    """Parameter along a side such that elements grow from 0.3 to 1.7 times their mean size."""
    return 0.3 * s + 0.7 * s**2


def graded_quadrant(radius: float, length: float) -> Parametric:
    """The surface of `QUADRANT` with smaller elements at "left-bottom"."""

    def position(xi: Floats, eta: Floats) -> Floats:
        angle = math.pi / 2 * _graded(xi)
        return np.stack([radius * np.sin(angle), length * _graded(eta), radius * np.cos(angle)])

    return Parametric(position)


def pinched_cylinder(surface: Surface, section: Isotropic, force: float, *ends: Support) -> Scene:
    """An eighth of a cylinder pinched by two forces; inwards at "left-bottom"."""
    shell = Shell("cylinder", surface, section, mesh=MESH)
    symmetry = (SymmetryPlane("left", X), SymmetryPlane("right", Z), SymmetryPlane("bottom", Y))
    load = PointForce("left-bottom", (0.0, 0.0, -force / 4))
    return Scene("cylinder", (shell,), supports=(*symmetry, *ends), loads=(load,), scheme="linear")


def hemisphere(hole: float, force: float = 1.0, scheme: str = "linear", steps: int = 1) -> Scene:
    """A quarter of a hemisphere, pulled outwards at "left-top" and pushed in at "right-top".

    Args:
        hole: Half angle of the hole at the pole, degrees; 0 for none.
        force: Each force on the quarter.
        scheme: "linear" or "static".
        steps: Number of load steps.
    """
    surface = Sphere(10.0, polar=(hole, 90.0), azimuth=(0.0, 90.0))
    shell = Shell("sphere", surface, Isotropic(6.825e7, 0.3, 0.04), mesh=MESH)
    supports = (
        SymmetryPlane("left", Y),
        SymmetryPlane("right", X),
        # no force acts along z: which node is held does not matter
        Fixed("left-top", displacement=(None, None, 0.0)),
    )
    loads = (
        PointForce("left-top", (force, 0.0, 0.0)),
        PointForce("right-top", (0.0, -force, 0.0)),
    )
    return Scene(
        "hemisphere",
        (shell,),
        supports=supports,
        loads=loads,
        scheme=scheme,
        dt=1 / steps,
        t_end=1.0,
    )


@case("linear shells/Scordelis-Lo")
def roof() -> Iterator[Check]:
    """Vertical displacement in the middle of the free edge."""
    yield Check(
        "middle of the free edge, quad 16x16",
        -float(linear_displacement(scordelis_lo(), "right-bottom")[2]),
        0.30202,
        "Krysl & Chen, converged; classic 0.3024",
    )


@case("linear shells/pinched cylinder")
def cylinders() -> Iterator[Check]:
    """Displacement under the force: on diaphragms, and with free ends ever thinner.

    The reference on diaphragms is that of a shell without transverse shear, to which shear adds
    some 2 %, growing without bound under a point force as the mesh is refined. So the comparison
    proper suppresses shear (a hundred times its stiffness), and resolves the dent by its mesh.
    """
    series = "164.24 P / (E t), Lindberg, Olson & Cowper, without transverse shear"
    section = Isotropic(3e6, 0.3, 3.0, shear_correction=100.0)
    scene = pinched_cylinder(graded_quadrant(300.0, 300.0), section, 1.0, DIAPHRAGM)
    yield Check(
        "diaphragms, shear suppressed, quad 16x16 graded",
        -float(linear_displacement(scene, "left-bottom")[2]),
        1.82488e-5,
        series,
    )
    surface = Cylinder(300.0, 300.0, angles=(0.0, 90.0), **QUADRANT)
    scene = pinched_cylinder(surface, Isotropic(3e6, 0.3, 3.0), 1.0, DIAPHRAGM)
    yield Check(
        "diaphragms, with shear, quad 16x16",
        -float(linear_displacement(scene, "left-bottom")[2]),
        1.82488e-5,
        f"{series}, which adds about 2 %",
        0.03,
    )
    radius, E = 4.953, 10.5e6
    surface = Cylinder(radius, 10.35 / 2, angles=(0.0, 90.0), **QUADRANT)
    for ratio, reference in ((1e4, 1.912), (1e6, 1.907)):
        t = radius / ratio
        force = E * t**3 / radius
        scene = pinched_cylinder(surface, Isotropic(E, 0.3125, t), force)
        value = -float(linear_displacement(scene, "left-bottom")[2])
        yield Check(
            f"free ends, R/t={ratio:.0e}, quad 16x16, in P R/(E t^3)",
            value,
            reference,
            "FinEtools, after Briassoulis (2005)",
        )


@case("linear shells/hemisphere")
def hemispheres() -> Iterator[Check]:
    """Displacement along the forces."""
    for hole, reference, name in ((0.0, 0.0924, "closed"), (18.0, 0.093, "18 degree hole")):
        value = float(linear_displacement(hemisphere(hole), "left-top")[0])
        yield Check(f"{name}, quad 16x16", value, reference, "obstacle course")
