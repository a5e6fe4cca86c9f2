"""Sheets in their plane: forces along sides and at nodes, pins, rings, and patch tests."""

import math
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import meshio
import numpy as np

from shellmb.arrays import Floats
from shellmb.demos.references.beams import cantilever_end_force
from shellmb.demos.verification.cases import Check, case
from shellmb.demos.verification.problems.elements.rows import (
    MOVED,
    Mesh,
    Row,
    Values,
    everywhere,
    problem,
    statics,
)
from shellmb.demos.verification.solve import displacement, displacement_at
from shellmb.scene import (
    Clamped,
    EdgeForce,
    EdgeMoment,
    Fixed,
    Isotropic,
    MeshFile,
    Parametric,
    PointForce,
    Rectangle,
    Shell,
    Surface,
)

NU = 0.3
# displacements times `E t` by another code (`tests/verify/plane_stress.py`)
PLANE = "plane stress, elements of degree 6"
PULLED, RING, COOK, CURVED, SHORTER = 0.997555, 4.67620, 23.9677, 0.0885448, -0.403089
HALF_WAY, CORNER, AT_THE_FORCE = 13.2331, 37.4259, 38.688


def skin(thickness: float) -> Isotropic:
    """A section whose modulus times thickness is one: displacements are `u E t`."""
    return Isotropic(1 / thickness, NU, thickness=thickness)


@problem(
    "cantilever",
    "Timoshenko beam",
    Row((10, 2), 0.996, 0.994, given={"thickness": 1e-2}),
    Row((10, 2), 0.996, 0.994, given={"thickness": 1e-4}),
    Row((10, 2), 0.991, 0.993, MOVED, {"thickness": 1e-4}),
    Row((4, 1), 0.991, 0.974, given={"thickness": 1e-4}),
)
def cantilever(mesh: Mesh, thickness: float) -> Values:
    """Bent in its plane by a force across its end, however thin."""
    height = 0.1
    loads = EdgeForce("right", (0.0, 1 / height, 0.0))
    shell = mesh.shell(Rectangle(1.0, height), skin(thickness))
    simulation = statics(shell, supports=Clamped("left"), loads=loads)
    exact = cantilever_end_force(1.0, height**3 / 12, 1.0, height / 2 / (1 + NU) / 1.2)
    return {"": displacement_at(simulation, (1.0, height / 2, 0.0))[1] / exact}


@problem(
    "pulled sheet",
    PLANE,
    Row((4, 1), 0.999, 0.998),
    Row((8, 2), 1.000, 0.999),
    Row((8, 2), 1.000, 0.999, MOVED),
)
def pulled_sheet(mesh: Mesh) -> Values:
    """A thin sheet of 5x1, clamped, pulled at its other end: corner and middle of that end."""
    shell = mesh.shell(Rectangle(0.5, 0.1), skin(1e-4))
    pull = EdgeForce("right", (10.0, 0.0, 0.0))
    simulation = statics(shell, supports=Clamped("left"), loads=pull)
    return {
        what: displacement(simulation, (0.5, y, 0.0))[0] / 5 / PULLED
        for what, y in (("corner", 0.0), ("middle", 0.05))
    }


def quarter_ring(inner: float, outer: float) -> Parametric:
    """A quarter of a ring from the x axis ("left") to the y axis, outer side "top"."""

    def position(xi: Floats, eta: Floats) -> Floats:
        r, a = inner + (outer - inner) * eta, math.pi / 2 * xi
        return np.stack([r * np.sin(a), -r * np.cos(a), 0 * r])

    return Parametric(position)


@problem(
    "ring",
    PLANE,
    Row((4, 1), 0.992, 0.817),
    Row((8, 2), 0.982, 0.964),
    Row((16, 4), 0.997, 0.994),
    # the trial, which keeps the mean of strains and not that of forces, has 1.160
    Row((8, 2), 1.237, 0.959, MOVED),
    Row((16, 4), 1.019, 0.993, MOVED),
)
def ring(mesh: Mesh) -> Values:
    """A thick quarter of a ring in its plane, clamped, with a force across its other end."""
    shell = mesh.shell(quarter_ring(0.1, 0.5), skin(1e-4))
    force = EdgeForce("right", (2.5, 0.0, 0.0))
    simulation = statics(shell, supports=Clamped("left"), loads=force)
    return {"": displacement(simulation, (0.3, 0.0, 0.0))[0] / RING}


@problem(
    "Cook",
    f"{PLANE}; Cook, Malkus & Plesha give 23.96",
    Row((2, 2), 0.983, 0.932),
    Row((4, 4), 0.996, 0.991),
    Row((4, 4), 0.994, 0.987, MOVED),
)
def cook(mesh: Mesh) -> Values:
    """A tapered and swept panel under a shear force at its end: middle of the end."""

    def position(xi: Floats, eta: Floats) -> Floats:
        return np.stack([48 * xi, 44 * xi + eta * (44 - 28 * xi), 0 * xi])

    section = Isotropic(1.0, 1 / 3, thickness=1.0)
    # bending of the panel, thick beside its size, is held: a membrane
    shell = mesh.shell(Parametric(position), section, areas={"all": lambda x: x[0] > -1})
    flat = Fixed("all", (None, None, 0.0))
    shear = EdgeForce("right", (0.0, 1 / 16, 0.0))
    simulation = statics(shell, supports=(Clamped("left"), flat), loads=shear)
    return {"": displacement(simulation, (48.0, 52.0, 0.0))[1] / COOK}


@problem(
    "point force",
    PLANE,
    Row((4, 2), (0.998, 0.991, 0.995), (0.993, 0.988, 0.993)),
    Row((8, 4), (1.004, 1.000, 0.998), (1.003, 0.999, 0.997)),
    Row((16, 8), (1.005, 1.002, 0.999), (1.004, 1.002, 0.999)),
)
def point_force(mesh: Mesh) -> Values:
    """A sheet of 2x1 with one force in its plane: mid-span of a side, and the corner."""
    shell = mesh.shell(Rectangle(2.0, 1.0), skin(1e-3))
    force = PointForce((2.0, 0.5, 0.0), (0.0, 1.0, 0.0))
    simulation = statics(shell, supports=Clamped("left"), loads=force)
    x, u = everywhere(simulation)
    side = np.flatnonzero(np.abs(x[:, 1]) < 1e-9)
    side = side[np.argsort(x[side, 0])]
    found = {}
    for what, nodes in (("vertices", side[::2]), ("middles of sides", side[1::2])):
        fit = np.polyfit(x[nodes, 0], u[nodes, 1], min(3, len(nodes) - 1))
        found[f"mid-span, {what}"] = float(np.polyval(fit, 1.0)) / HALF_WAY
    return {**found, "corner": u[side[-1], 1] / CORNER}


@problem(
    "forces at nodes",
    "F x/(E t b)",
    Row((8, 4), (1.001, 1.000), (1.001, 1.000)),
    Row((20, 10), 1.000, 1.000),
)
def forces_at_nodes(mesh: Mesh) -> Values:
    """A sheet of 2x1 pulled by equal forces at all nodes of a side: vertices against middles."""
    shell = mesh.shell(Rectangle(2.0, 1.0), skin(1e-3))
    nodes = 2 * mesh.size[1] + 1
    loads = [
        PointForce((2.0, y, 0.0), (1 / nodes, 0.0, 0.0)) for y in np.linspace(0, 1, nodes).tolist()
    ]
    held = Fixed("left", (0.0, None, 0.0), (0.0, 0.0, 0.0)), Fixed("left-bottom", (None, 0.0, None))
    x, u = everywhere(statics(shell, supports=held, loads=loads))
    side = np.flatnonzero((np.abs(x[:, 1]) < 1e-9) & (x[:, 0] > 0.4) & (x[:, 0] < 1.6))
    stretch = u[side, 0] / x[side, 0]
    middle = np.round(x[side, 0] * mesh.size[0]).astype(int) % 2 == 1
    return {
        "vertices": float(stretch[~middle].mean()),
        "middles of sides": float(stretch[middle].mean()),
    }


@problem(
    "two pins",
    PLANE,
    Row((8, 4), 1.000, 0.994),
    Row((16, 8), 1.000, 1.000),
    Row((32, 16), 1.000, 1.000),
)
def two_pins(mesh: Mesh) -> Values:
    """A sheet of 2x1 on two corners with a load along its top: how much shorter its middle is."""
    shell = mesh.shell(Rectangle(2.0, 1.0), skin(1e-3))
    held = (
        Fixed("left-bottom", (0.0, 0.0, 0.0)),
        Fixed("right-bottom", (None, 0.0, 0.0)),
        Fixed("left-top", (None, None, 0.0)),
    )
    load = EdgeForce("top", (0.0, -1.0, 0.0))
    simulation = statics(shell, supports=held, loads=load)
    high, low = (displacement(simulation, (1.0, y, 0.0))[1] for y in (1.0, 0.0))
    return {"": (high - low) / SHORTER}


# MacNeal & Harder's patch of five quadrilaterals, and the same halved
CORNERS = ((0, 0), (0.24, 0), (0.24, 0.12), (0, 0.12), (0.04, 0.02), (0.18, 0.03), (0.16, 0.08))
POINTS = np.array([(*p, 0.0) for p in (*CORNERS, (0.08, 0.08))])
QUADS = ((0, 1, 5, 4), (1, 2, 6, 5), (3, 7, 6, 2), (0, 4, 7, 3), (4, 5, 6, 7))
LENGTH, HEIGHT = 0.24, 0.12
EDGES: dict[str, Callable[[Any], Any]] = {
    "left": lambda x: x[0] < 1e-9,
    "right": lambda x: x[0] > LENGTH - 1e-9,
    "bottom": lambda x: x[1] < 1e-9,
    "top": lambda x: x[1] > HEIGHT - 1e-9,
}
OUTWARD = {"left": (-1, 0), "right": (1, 0), "bottom": (0, -1), "top": (0, 1)}


def _patches(folder: Path) -> Iterator[tuple[str, Mesh, Surface]]:
    """Patches with distorted elements: their names, meshes and surfaces."""
    halves = [half for a, b, c, d in QUADS for half in ((a, b, c), (a, c, d))]
    for cell, kind, cells in (("quad", "quad", QUADS), ("tri", "triangle", halves)):
        path = folder / f"{cell}.vtu"
        meshio.Mesh(POINTS, [(kind, np.array(cells))]).write(path)
        mesh = Mesh(cell, (1, 1))  # type: ignore[arg-type]
        yield f"MacNeal-Harder patch, {cell}", mesh, MeshFile(path, edges_where=EDGES)
        mesh = Mesh(cell, (4, 3), MOVED)  # type: ignore[arg-type]
        yield f"{cell} 4x3 moved by 25 %", mesh, Rectangle(LENGTH, HEIGHT)


def _stretched(shell: Shell) -> tuple[Floats, Floats]:
    """Found and exact displacements of all nodes under constant membrane forces."""
    strain, shear = 1e-3, 1e-3
    N = 1 / (1 - 0.25) * strain, 1 / 2 / (1 + 0.25) * shear
    loads = [
        EdgeForce(edge, (N[0] * a + N[1] * b, N[1] * a + N[0] * b, 0.0))
        for edge, (a, b) in OUTWARD.items()
    ]
    held = (
        Fixed((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        Fixed((LENGTH, 0.0, 0.0), (None, None, 0.0)),
        Fixed((0.0, HEIGHT, 0.0), (0.0, None, 0.0)),
    )
    x, u = everywhere(statics(shell, supports=held, loads=loads))
    exact = np.stack([strain * x[:, 0], strain * x[:, 1] + shear * x[:, 0], 0 * x[:, 0]], axis=1)
    return u, exact


def _bent(shell: Shell) -> tuple[Floats, Floats]:
    """Under constant bending and twisting moments."""
    bend, twist = 1e-3, 5e-4
    D = float(shell.section.thickness) ** 2 / 12 / (1 - 0.25**2)
    M = D * (1 + 0.25) * bend, D * (1 - 0.25) * twist
    loads = [
        EdgeMoment(edge, (-M[1] * a - M[0] * b, M[0] * a + M[1] * b, 0.0))
        for edge, (a, b) in OUTWARD.items()
    ]
    held = Fixed((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, None))
    x, u = everywhere(
        statics(shell, supports=(held, Fixed((LENGTH, 0.0, 0.0), (None, 0.0, None))), loads=loads)
    )
    w = -bend * (x[:, 0] ** 2 + x[:, 1] ** 2) / 2 - twist * x[:, 0] * x[:, 1]
    return u, np.stack([0 * w, 0 * w, w], axis=1)


def _sheared(shell: Shell) -> tuple[Floats, Floats]:
    """With directors held, under constant transverse shear forces."""
    G = 5 / 6 / 2 / (1 + 0.25)
    slope = 1e-3, 5e-4
    loads = [
        EdgeForce(edge, (0.0, 0.0, G * (slope[0] * a + slope[1] * b)))
        for edge, (a, b) in OUTWARD.items()
    ]
    held = (
        Fixed("all", (None, None, None), (0.0, 0.0, 0.0)),
        Fixed((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        Fixed((LENGTH, 0.0, 0.0), (None, 0.0, None)),
    )
    x, u = everywhere(statics(shell, supports=held, loads=loads))
    w = slope[0] * x[:, 0] + slope[1] * x[:, 1]
    return u, np.stack([0 * w, 0 * w, w], axis=1)


@case("elements/patch")
def patch() -> Iterator[Check]:
    """Constant strains on any straight-sided mesh: largest error at a node over the largest value.

    Forces or moments along the sides, with nothing held but what would move freely.
    """
    source = "constant strains; MacNeal & Harder, Finite Elem. Anal. Des. 1 (1985) 3-20"
    with tempfile.TemporaryDirectory() as folder:
        for name, mesh, surface in _patches(Path(folder)):
            for what, solve, t in (
                ("membrane", _stretched, 1e-2),
                ("membrane", _stretched, 1e-3),
                ("bending", _bent, 1e-2),
                ("bending", _bent, 1e-3),
                ("shear", _sheared, 1e-2),
            ):
                if solve is _sheared and mesh.cell == "tri":
                    # shear of thin triangles follows their vertices: without bending middles err
                    continue
                section = Isotropic(1 / t, 0.25, thickness=t)
                everything = {"all": lambda x: x[0] > -1}
                shell = mesh.shell(surface, section, geometry_order=1, areas=everything)
                u, exact = solve(shell)
                error = float(np.abs(u - exact).max() / np.abs(exact).max())
                yield Check(f"{what}, {name}, t={t:g}", error, 0.0, source, 1e-12)
