"""Deflections of isotropic plates, thin and thick, under uniform and point loads."""

from collections.abc import Iterator

from shellmb.demos.references import beams
from shellmb.demos.references import plates as analytic
from shellmb.demos.verification import tables
from shellmb.demos.verification.cases import Check, case
from shellmb.demos.verification.setups import CENTRE, NU, TIP, Cell, Edges, plate_section, square
from shellmb.demos.verification.solve import linear_displacement
from shellmb.scene import (
    Clamped,
    Disc,
    EdgeForce,
    Isotropic,
    PointForce,
    Rectangle,
    Scene,
    Shell,
    SoftSupport,
    SurfaceForce,
    SymmetryPlane,
)

NAVIER = "Navier series, Reissner-Mindlin"
RITZ = "Ritz 16x16, Reissner-Mindlin, plate_rm_static_ritz.csv"
TIMOSHENKO = "Timoshenko & Woinowsky-Krieger"
# of a thin clamped square, w D / (q a^4); docs/reference/literature.md, plates
THIN_CLAMPED = 1.265319087e-3
THIN = 1000

CELLS: tuple[Cell, ...] = ("quad", "tri")


def _deflection(edges: Edges, slenderness: float, cell: Cell, n: int = 8) -> float:
    scene = square(edges, plate_section(1 / slenderness), cell=cell, mesh=(n, n))
    return float(linear_displacement(scene, TIP if edges == "cantilever" else CENTRE)[2])


@case("plates/square")
def squares() -> Iterator[Check]:
    """Uniform load; triangles need a finer mesh."""
    for cell in CELLS:
        n = 8 if cell == "quad" else 16
        for a_over_h in (10, THIN):
            name = f"hard simple support, a/h={a_over_h}, {cell} {n}x{n}"
            reference = tables.plate_deflection("SSSS hard", a_over_h)
            yield Check(name, _deflection("hard", a_over_h, cell, n), reference, NAVIER)
        yield Check(
            f"soft simple support, a/h=10, {cell} {n}x{n}",
            _deflection("soft", 10, cell, n),
            tables.plate_deflection("SSSS soft", 10),
            RITZ,
        )
        yield Check(
            f"clamped, a/h=10, {cell} {n}x{n}",
            _deflection("clamped", 10, cell, n),
            tables.plate_deflection("CCCC", 10),
            RITZ,
        )
        yield Check(
            f"clamped, a/h={THIN}, {cell} {n}x{n}",
            _deflection("clamped", THIN, cell, n),
            THIN_CLAMPED,
            "thin plate, docs/reference/literature.md",
        )
        for a_over_h in (10, 100):
            yield Check(
                f"cantilever, a/h={a_over_h}, {cell} 8x8",
                _deflection("cantilever", a_over_h, cell),
                tables.plate_deflection("CFFF", a_over_h),
                RITZ,
            )


@case("plates/strip")
def strips() -> Iterator[Check]:
    """A strip without lateral contraction is a beam, thick or thin."""
    length, width, force = 1.0, 0.25, 1e-3
    for slenderness in (10, THIN):
        h = length / slenderness
        section = Isotropic(1.0, 0.0, thickness=h)
        bending = float(section.D[0, 0])
        scene = Scene(
            "strip",
            (Shell("plate", Rectangle(length, width), section, mesh=(8, 2)),),
            supports=(Clamped("left"),),
            loads=(EdgeForce("right", (0.0, 0.0, force * bending)),),
            scheme="linear-statics",
        )
        shear = float(section.G[0, 0]) * width
        reference = beams.cantilever_end_force(
            force * bending * width, bending * width, length, shear
        )
        yield Check(
            f"end force, L/h={slenderness}, quad 8x2",
            float(linear_displacement(scene, (length, width / 2, 0.0))[2]),
            reference,
            "Timoshenko beam",
        )


@case("plates/point load")
def point_loads() -> Iterator[Check]:
    """Thin only: under a point force the deflection by shear is infinite.

    Triangles are too soft at a point force and need a fine mesh: 14 % on 8x8, 3 % on 16x16.
    """
    section = plate_section(1 / THIN)
    bending = float(section.D[0, 0])
    plate = analytic.Plate(1.0, NU, 1 / THIN)
    for cell in CELLS:
        n = 8 if cell == "quad" else 32
        load = PointForce(CENTRE, (0.0, 0.0, bending))
        scene = square("hard", section, load, cell=cell, mesh=(n, n))
        yield Check(
            f"square, hard simple support, a/h={THIN}, {cell} {n}x{n}",
            float(linear_displacement(scene, CENTRE)[2]),
            analytic.rectangle_point_deflection(plate, 1.0, 1.0, bending),
            f"{TIMOSHENKO} art. 34",
        )


def _circle(clamped: bool, thickness: float, point_load: bool) -> float:
    """Deflection at the centre of a quarter circle of radius 1."""
    section = plate_section(thickness)
    bending = float(section.D[0, 0])
    shell = Shell("plate", Disc(1.0, angles=(0.0, 90.0)), section, mesh=(8, 8))
    symmetry = (SymmetryPlane("left", (0.0, 1.0, 0.0)), SymmetryPlane("right", (1.0, 0.0, 0.0)))
    load = (
        PointForce("pole", (0.0, 0.0, bending / 4))
        if point_load
        else SurfaceForce((0.0, 0.0, bending))
    )
    rim = Clamped("top") if clamped else SoftSupport("top")
    scene = Scene(
        "circle", (shell,), supports=(*symmetry, rim), loads=(load,), scheme="linear-statics"
    )
    return float(linear_displacement(scene, "pole")[2])


@case("plates/circle")
def circles() -> Iterator[Check]:
    """Quarter model: 8 elements along the radius and 8 along the quarter of the rim."""
    for clamped in (True, False):
        rim = "clamped" if clamped else "simply supported"
        for slenderness in (10, THIN):
            plate = analytic.Plate(1.0, NU, 1 / slenderness)
            yield Check(
                f"{rim}, uniform load, a/h={slenderness}, quad 8x8 per quarter",
                _circle(clamped, 1 / slenderness, point_load=False),
                analytic.circle_uniform_deflection(plate, 1.0, plate.bending, clamped),
                f"{TIMOSHENKO} art. 16, with shear",
            )
        yield Check(
            f"{rim}, point load, a/h={THIN}, quad 8x8 per quarter",
            _circle(clamped, 1 / THIN, point_load=True),
            analytic.circle_point_deflection(plate, 1.0, plate.bending, clamped),
            f"{TIMOSHENKO} art. 19",
        )
