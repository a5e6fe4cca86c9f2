"""Large displacements along a path of loading (Sze, Liu & Lo, 2004), and the exact roll-up."""

import math
from collections.abc import Iterator

import numpy as np

from shellmb.arrays import Floats
from shellmb.demos.references.beams import roll_up
from shellmb.demos.verification import tables
from shellmb.demos.verification.cases import Check, case
from shellmb.demos.verification.problems.linear_shells import hemisphere
from shellmb.demos.verification.solve import curve, linear_displacement
from shellmb.scene import Clamped, EdgeForce, EdgeMoment, Isotropic, Load, Rectangle, Scene, Shell

TOLERANCE = 0.015
TIP = "right-bottom"
MESH = (16, 1)
# strip of width 1 without lateral contraction
E, THICKNESS = 1.2e6, 0.1
BENDING = E * THICKNESS**3 / 12


def strip(length: float, load: Load, steps: int) -> Scene:
    """A cantilever strip along x, loaded at its end in equal load steps."""
    shell = Shell(
        "strip", Rectangle(length, 1.0), Isotropic(E, 0.0, thickness=THICKNESS), mesh=MESH
    )
    return Scene(
        "strip",
        (shell,),
        supports=(Clamped("left"),),
        loads=(load,),
        scheme="static",
        dt=1 / steps,
        t_end=1.0,
    )


# the moment that bends a strip of length 12 into a circle, towards +z
CIRCLE = 2 * math.pi * BENDING / 12.0
FULL_CIRCLE = EdgeMoment("right", (0.0, -CIRCLE, 0.0))


def path_checks(
    name: str, load: Floats, found: Floats, table: Floats, source: str
) -> Iterator[Check]:
    """Checks of a whole curve: the worst point relative to the curve's largest value.

    The worst relative error of a single point is reported too; where the displacement is small it
    measures the rounding of the table.
    """
    difference = np.abs(found - table)
    size = np.max(np.abs(table))
    single = difference / np.where(table != 0, np.abs(table), size)
    worst = int(np.argmax(single))
    point = f"worst single point {single[worst]:.1e} at load {load[worst]:g}"
    yield Check(
        f"{name}, largest error along the curve over its largest value",
        float(np.max(difference) / size),
        0.0,
        f"{source}; {point}",
        TOLERANCE,
        "at most",
    )


@case("large displacements/end shear")
def end_shear() -> Iterator[Check]:
    """Cantilever under a dead end force, 16x1 elements as in the paper."""
    table = tables.curve("sze31_cantilever_shear")
    scene = strip(10.0, EdgeForce("right", (0.0, 0.0, 4.0)), len(table.load))
    path = curve(scene, table.load, TIP)[:, 0]
    found = {"minus_U_tip": -path[:, 0], "W_tip": path[:, 2]}
    for column, values in found.items():
        yield from path_checks(
            f"{column}, quad 16x1", table.load, values, table.values[column], "Sze et al. 3.1, S4R"
        )
        yield Check(
            f"{column} at the end, quad 16x1",
            float(values[-1]),
            float(table.values[column][-1]),
            "Sze et al. 3.1, S4R",
            TOLERANCE,
        )


@case("large displacements/roll-up")
def end_moment() -> Iterator[Check]:
    """Cantilever rolled up to a full circle: along the curve, and at once."""
    table = tables.curve("sze32_cantilever_moment")
    path = curve(strip(12.0, FULL_CIRCLE, len(table.load)), table.load, TIP)[:, 0]
    found = {"minus_U_tip_exact": -path[:, 0], "W_tip_exact": path[:, 2]}
    for column, values in found.items():
        yield from path_checks(
            f"{column}, quad 16x1", table.load, values, table.values[column], "exact arc"
        )
    end = linear_displacement(strip(12.0, FULL_CIRCLE, 1), TIP)
    exact = roll_up(CIRCLE, BENDING, 12.0)
    for name, value, reference in (("U", end[0], exact[0]), ("W", end[2], exact[1])):
        yield Check(
            f"full circle in one load step, {name} tip over L, quad 16x1",
            float(value / 12.0),
            reference / 12.0 if abs(reference) > 1e-9 else 0.0,
            "exact arc",
            TOLERANCE,
        )


@case("large displacements/hemisphere")
def open_hemisphere() -> Iterator[Check]:
    """Hemisphere with an 18 degree hole under two pairs of forces."""
    table = tables.curve("sze34_hemisphere")
    scene = hemisphere(18.0, force=200.0, scheme="static", steps=len(table.load))
    path = curve(scene, table.load, "left-top", "right-top")
    found = {"V_A_outward": path[:, 0, 0], "minus_U_B_inward": -path[:, 1, 1]}
    for column, values in found.items():
        yield from path_checks(
            f"{column}, quad 16x16", table.load, values, table.values[column], "Sze et al. 3.4, S4R"
        )
