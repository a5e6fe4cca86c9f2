"""Deflections of laminated squares against first-order shear deformation theory."""

import math
from collections.abc import Iterator

import numpy as np

from shellmb.arrays import Floats
from shellmb.demos.verification import tables
from shellmb.demos.verification.cases import Check, case
from shellmb.demos.verification.setups import CENTRE, Cell, Edges, square
from shellmb.demos.verification.solve import linear_displacement
from shellmb.scene import Laminate, PlyMaterial, SurfaceForce

FSDT = "FSDT, kappa=5/6, exact for the sinusoidal load"

# triangles are softer in laminates: 1.4 % on 16x16
MESHES: tuple[tuple[Cell, int], ...] = (("quad", 8), ("tri", 24))

CROSS_PLY = PlyMaterial(25.0, 1.0, nu12=0.25, G12=0.5, G13=0.5, G23=0.2)
ANGLE_PLY = PlyMaterial(40.0, 1.0, nu12=0.25, G12=0.5, G13=0.5, G23=0.6)


def sinusoidal(size: float) -> SurfaceForce:
    """Load `size sin(pi x) sin(pi y)` on the unit square."""

    def force(x: Floats) -> Floats:
        value = size * np.sin(math.pi * x[0]) * np.sin(math.pi * x[1])
        return np.stack([0 * value, 0 * value, value])

    return SurfaceForce(force)


def laminate(material: PlyMaterial, angles: list[float], thickness: float) -> Laminate:
    """Laminate of equal plies with a total thickness."""
    return Laminate.from_stacking(material, thickness / len(angles), angles)


def _deflection(
    edges: Edges, material: PlyMaterial, angles: list[float], slenderness: float, cell: Cell, n: int
) -> float:
    """Centre deflection `100 w E2 h^3 / (q0 a^4)` under a sinusoidal load."""
    h = 1 / slenderness
    section = laminate(material, angles, h)
    scene = square(edges, section, sinusoidal(h**3), mesh=(n, n), cell=cell)
    return float(100 * linear_displacement(scene, CENTRE)[2])


@case("laminates/cross-ply")
def cross_ply() -> Iterator[Check]:
    """Symmetric ones and one that couples bending and stretching."""
    for cell, n in MESHES:
        for layup in ("0/90/90/0", "0/90"):
            angles = [float(a) for a in layup.split("/")]
            for a_over_h in (10, 100):
                yield Check(
                    f"[{layup}] sinusoidal load, a/h={a_over_h}, {cell} {n}x{n}",
                    _deflection("SS-1", CROSS_PLY, angles, a_over_h, cell, n),
                    tables.laminate_deflection(layup, a_over_h),
                    FSDT,
                )


@case("laminates/angle-ply")
def angle_ply() -> Iterator[Check]:
    """Antisymmetric: stretching couples with twisting."""
    for cell, n in MESHES:
        for a_over_h in (10, 100):
            yield Check(
                f"[45/-45] sinusoidal load, a/h={a_over_h}, {cell} {n}x{n}",
                _deflection("SS-2", ANGLE_PLY, [45.0, -45.0], a_over_h, cell, n),
                tables.angle_ply_deflection(1.0, a_over_h),
                FSDT,
            )
