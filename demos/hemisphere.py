"""Hemisphere with an 18 degree hole pulled and pushed by four point forces, large displacements.

A quarter is modelled between two planes of symmetry. Problem 3.4 of Sze, Liu and Lo, Finite Elem.
Anal. Des. 40
(2004) 1551-1569: at the full load of 400 the displacements are 4.067 (outwards) and 8.178
(inwards), computed there with 16x16 S4R elements per quarter.
"""

# KIND: statics and paths

from typing import Any

from shellmb.scene import Fixed, Isotropic, PointForce, Probe, Scene, Shell, Sphere, SymmetryPlane

RADIUS, E, NU, THICKNESS, FORCE = 10.0, 6.825e7, 0.3, 0.04, 400.0

# Sze, Liu and Lo (2004), table of section 3.4, at the full load
OUTWARD, INWARD = 4.067, 8.178


def scene(load: float = FORCE) -> Scene:
    """A quarter of the hemisphere.

    Args:
        load: Force at each of the four points, N; on a plane of symmetry half of it acts.
    """
    shell = Shell(
        "hemisphere",
        Sphere(RADIUS, polar=(18, 90), azimuth=(0, 90)),
        Isotropic(E=E, nu=NU, thickness=THICKNESS),
        mesh=(16, 16),
    )
    a, b = (RADIUS, 0.0, 0.0), (0.0, RADIUS, 0.0)
    return Scene(
        "hemisphere",
        shell,
        supports=(
            SymmetryPlane("left", (0, 1, 0)),
            SymmetryPlane("right", (1, 0, 0)),
            Fixed(a, displacement=(None, None, 0.0)),
        ),
        loads=(PointForce(a, (load / 2, 0, 0)), PointForce(b, (0, -load / 2, 0))),
        probes=(Probe("outward", a, component=0), Probe("inward", b, component=1)),
        scheme="static",
        dt=0.25,
        t_end=1.0,
        units="m, kg, s",
    )


def results(run: Any) -> dict[str, float]:
    """Displacements of the loaded points."""
    return {
        "outward": float(run.column("outward")[-1]),
        "inward": -float(run.column("inward")[-1]),
        "iterations": float(run.simulation.iterations),
    }


def check(results: dict[str, float]) -> None:
    """Within 1.5 % of the tabulated displacements."""
    assert abs(results["outward"] / OUTWARD - 1) < 0.015
    assert abs(results["inward"] / INWARD - 1) < 0.015
