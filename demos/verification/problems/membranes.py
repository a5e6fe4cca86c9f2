"""Membranes that wrinkle: tension-field theory in closed form, and an airbag."""

from collections.abc import Iterator
from typing import Any, Literal

from shellmb.demos import airbag
from shellmb.demos.references.membranes import (
    AIRBAG,
    AIRBAG_SPREAD,
    sheared_energy,
    stretched_strip_curvature,
)
from shellmb.demos.verification.cases import Check, case
from shellmb.running.execute import execute
from shellmb.scene import (
    Clamped,
    Fixed,
    PointForce,
    PointMoment,
    Probe,
    Rectangle,
    RigidBody,
    Scene,
    Shell,
    Weld,
    Wrinkling,
)

Vector = tuple[float, float, float]
Cell = Literal["quad", "tri"]
CELLS: tuple[Cell, ...] = ("quad", "tri")

# a polyimide foil
E, NU, THICKNESS = 3e9, 0.3, 25e-6
LENGTH, HEIGHT, STRAIN = 0.4, 0.2, 1e-5


def last(scene: Scene) -> dict[str, float]:
    """The last row of a static run's history."""
    return {str(name): float(x) for name, x in execute(scene).history.iloc[-1].items()}


def stretched_strip(m: float, mesh: tuple[int, int], cell: Cell, **given: Any) -> Scene:
    """A foil that a bar at its end stretches and bends in its plane; probe `turn` of the bar.

    Args:
        m: Moment over axial force and height.
        mesh: Cells along it and across.
        cell: Their kind.
        given: Of the section and the shell: `nu`, `compression`, `distortion`.
    """
    force, end = STRAIN * E * HEIGHT * THICKNESS, (LENGTH, HEIGHT / 2, 0.0)
    section = Wrinkling(
        E, given.pop("nu", NU), THICKNESS, compression=given.pop("compression", 1e-4)
    )
    return Scene(
        "stretched strip",
        Shell("foil", Rectangle(LENGTH, HEIGHT), section, mesh=mesh, cell=cell, **given),
        rigid_bodies=RigidBody("bar", 1.0, (1.0, 1.0, 1.0), position=end),
        joints=Weld("grip", "bar", "foil", at=end, second_at="right"),
        supports=Clamped("left", body="foil"),
        loads=(
            PointForce("center", (force, 0.0, 0.0), body="bar"),
            PointMoment("center", (0.0, 0.0, -m * force * HEIGHT), body="bar"),
        ),
        probes=Probe("turn", "center", body="bar", quantity="rotation", component=2),
        scheme="static",
        dt=0.5,
    )


def sheared_sheet(
    angle: float,
    cells: int,
    cell: Cell,
    *,
    size: float = 1.0,
    along: tuple[Vector, Vector] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    **given: Any,
) -> Scene:
    """A sheet between two rails, one of which moves along the other.

    Args:
        angle: Displacement over height.
        cells: Cells along it, two to a height, of which there are as many across.
        cell: Their kind.
        size: Units of length in a metre.
        along: Directions of the rails and across.
        given: Of the shell.
    """
    height = HEIGHT * size
    first, second = along
    rails = Rectangle(cells / 2 * height, height, axis1=first, axis2=second)
    section = Wrinkling(E / size**2, NU, THICKNESS * size)
    moved = [lambda t, c=c: float(angle * height * c) * t for c in first]
    return Scene(
        "sheared sheet",
        Shell("foil", rails, section, mesh=(cells, 2), cell=cell, **given),
        supports=(
            Fixed("bottom", displacement=(0.0, 0.0, 0.0)),
            Fixed("top", displacement=(moved[0], moved[1], moved[2])),
        ),
        scheme="static",
        dt=0.25,
    )


@case("membranes/stretched strip in bending")
def strip_checks() -> Iterator[Check]:
    """A strip that wrinkles on the side that bending compresses."""
    for cell in CELLS:
        yield _curvature(0.1, (4, 8), cell)
        yield _curvature(0.3, (4, 8), cell)


@case("membranes/finer strip in bending", slow=True)
def finer_strip_checks() -> Iterator[Check]:
    """The strip on meshes of half the size."""
    for cell in CELLS:
        yield _curvature(0.3, (8, 16), cell)


def _curvature(m: float, mesh: tuple[int, int], cell: Cell) -> Check:
    turn = -last(stretched_strip(m, mesh, cell))["turn"]
    return Check(
        f"curvature at M/(P H) = {m:g}, {cell} {mesh[0]}x{mesh[1]}",
        turn / LENGTH,
        stretched_strip_curvature(m, STRAIN, HEIGHT),
        "Stein & Hedgepeth (1961)",
        0.01,
    )


@case("membranes/sheared sheet")
def shear_checks() -> Iterator[Check]:
    """Energy per length of a sheet in tension at 45 degrees, from two lengths."""
    for cell in CELLS:
        long, short = (last(sheared_sheet(0.02, n, cell))["strain_energy"] for n in (12, 8))
        yield Check(
            f"energy per volume, {cell}",
            (long - short) / (2 * HEIGHT**2 * THICKNESS),
            sheared_energy(E, 0.02),
            "Wagner's tension field",
            0.01,
        )


@case("membranes/airbag", slow=True)
def airbag_checks() -> Iterator[Check]:
    """Inflated from flat, with wrinkles along its seams."""
    for cell in CELLS:
        yield Check(
            f"deflection of the middle, {cell} 6x6",
            last(airbag.scene(6, scheme="static", cell=cell))["middle"],
            AIRBAG,
            "Contri & Schrefler (1988) and others",
            AIRBAG_SPREAD,
        )
