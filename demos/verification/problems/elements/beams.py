"""Beams of shells: MacNeal & Harder's, torsion, tubes, an I-beam, a Z-section and a hook."""

import math
from functools import partial

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats
from shellmb.demos.references.beams import cantilever_end_force
from shellmb.demos.verification.problems.elements.plane import CURVED, quarter_ring
from shellmb.demos.verification.problems.elements.rows import (
    MOVED,
    Mesh,
    Row,
    Values,
    everywhere,
    problem,
    statics,
)
from shellmb.demos.verification.problems.linear_shells import compressed_plate
from shellmb.demos.verification.solve import displacement, displacement_at
from shellmb.scene import (
    Clamped,
    Cylinder,
    EdgeForce,
    EdgeMoment,
    Fixed,
    Isotropic,
    Join,
    Parametric,
    PointForce,
    Rectangle,
    Scene,
    SymmetryPlane,
)
from shellmb.simulate.buckling import linear_buckling

MACNEAL = "MacNeal & Harder, Finite Elem. Anal. Des. 1 (1985) 3-20"
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def torsion_constant(width: float, thickness: float) -> float:
    """Saint-Venant's of a rectangle."""
    n = np.arange(1, 99, 2)
    series = np.sum(np.tanh(n * np.pi * width / 2 / thickness) / n**5)
    return float(width * thickness**3 / 3 * (1 - 192 / np.pi**5 * thickness / width * series))


def slanted(cells: int, slants: Floats) -> Parametric:
    """MacNeal & Harder's strip of 6 x 0.2, its inner element sides slanted by 45 degrees.

    Args:
        cells: Numbers of elements along it.
        slants: Slope of the side behind each element but the last, shape (cells - 1,).
    """
    shift = 0.1 * np.concatenate([[0], slants, [0]])

    def position(xi: Floats, eta: Floats) -> Floats:
        along = 6 * xi + np.interp(xi, np.linspace(0, 1, cells + 1), shift) * (2 * eta - 1)
        return np.stack([along, 0.2 * eta, 0 * xi])

    return Parametric(position)


SHAPES = {
    "rectangles": np.zeros(5),
    "trapezoids": np.array([1.0, -1, 1, -1, 1]),
    "parallelograms": np.ones(5),
}


@problem(
    "straight beam",
    f"{MACNEAL}; rotation: Saint-Venant (their 0.03208 is 0.942 of it)",
    Row(
        (6, 1),
        (0.998, 0.994, 0.994, 0.884),
        (0.997, 0.983, 0.988, 0.694),
        given={"shape": "rectangles"},
    ),
    Row(
        (6, 1),
        (0.998, 0.962, 0.994, 0.827),
        (0.997, 0.962, 0.983, 0.698),
        given={"shape": "trapezoids"},
    ),
    Row(
        (6, 1),
        (0.998, 0.990, 0.994, 0.871),
        (0.997, 0.962, 0.984, 0.695),
        given={"shape": "parallelograms"},
    ),
)
def straight_beam(mesh: Mesh, shape: str) -> Values:
    """A long strip of a few elements of three shapes: unit loads at its end."""
    surface, E, nu, b, t = slanted(6, SHAPES[shape]), 1e7, 0.3, 0.2, 0.1
    shell = mesh.shell(surface, Isotropic(E, nu, thickness=t), geometry_order=1)
    shear_area = E / 2 / (1 + nu) * b * t / 1.2
    found = {}
    for what, load, axis, exact in (
        ("extension", X, 0, 6 / (E * b * t)),
        ("in plane", Y, 1, cantilever_end_force(1.0, E * t * b**3 / 12, 6.0, shear_area)),
        ("out of plane", Z, 2, cantilever_end_force(1.0, E * b * t**3 / 12, 6.0, shear_area)),
    ):
        force = EdgeForce("right", tuple(c / b for c in load))  # type: ignore[arg-type]
        simulation = statics(shell, supports=Clamped("left"), loads=force)
        found[what] = displacement(simulation, (6.0, b / 2, 0.0))[axis] / exact
    twist = EdgeMoment("right", (1 / b, 0.0, 0.0))
    simulation = statics(shell, supports=Clamped("left"), loads=twist)
    low, high = (displacement(simulation, (6.0, y, 0.0))[2] for y in (0.0, b))
    exact = 6 / (E / 2 / (1 + nu) * torsion_constant(b, t))
    return {**found, "twist": (high - low) / b / exact}


@problem(
    "curved beam",
    f"{MACNEAL}; in plane: plane stress, elements of degree 6 (theirs is 1.4 % less)",
    Row((6, 1), (0.998, 0.958), (0.986, 0.887)),
    Row((12, 2), (0.999, 0.991), (0.997, 0.915)),
)
def curved_beam(mesh: Mesh) -> Values:
    """A narrow quarter of a ring, clamped, with forces at its end in its plane and across it."""
    shell = mesh.shell(quarter_ring(4.12, 4.32), Isotropic(1e7, 0.25, thickness=0.1))
    found = {}
    # across its axis at the end, as its shear force
    for what, force, axis, exact in (
        ("in plane", (0.0, 5.0, 0.0), 1, CURVED),
        ("out of plane", (0.0, 0.0, 5.0), 2, 0.5022),
    ):
        load = EdgeForce("left", force)
        simulation = statics(shell, supports=Clamped("right"), loads=load)
        found[what] = displacement(simulation, (0.0, -4.22, 0.0))[axis] / exact
    return found


TWISTED = {0.32: (1.0, 5.424e-3, 1.754e-3), 0.0032: (1e-6, 5.256e-3, 1.294e-3)}


@problem(
    "twisted beam",
    f"{MACNEAL}; t=0.0032: Belytschko, Wong & Stolarski (1989)",
    Row((12, 2), (0.999, 1.002), (0.996, 0.998), given={"thickness": 0.32}),
    Row((12, 2), (0.997, 1.001), (0.994, 0.995), given={"thickness": 0.0032}),
    Row((24, 4), 0.999, (0.998, 0.999), given={"thickness": 0.0032}),
    Row((24, 4), (0.992, 0.993), (0.997, 0.998), MOVED, {"thickness": 0.0032}),
)
def twisted_beam(mesh: Mesh, thickness: float) -> Values:
    """A strip twisted by 90 degrees, clamped, with a force at its end in and out of its plane."""

    def position(xi: Floats, eta: Floats) -> Floats:
        turn, s = np.pi / 2 * xi, 1.1 * (eta - 0.5)
        return np.stack([12 * xi, s * np.cos(turn), s * np.sin(turn)])

    shell = mesh.shell(Parametric(position), Isotropic(29e6, 0.22, thickness=thickness))
    force, *exact = TWISTED[thickness]
    found = {}
    for what, axis, reference in (("in plane", 2, exact[0]), ("out of plane", 1, exact[1])):
        load = PointForce((12.0, 0.0, 0.0), tuple(force * np.eye(3)[axis]))
        simulation = statics(shell, supports=Clamped("left"), loads=load)
        found[what] = displacement(simulation, (12.0, 0.0, 0.0))[axis] / reference
    return found


@problem(
    "torsion",
    "Saint-Venant",
    Row((6, 1), 0.949, 0.938, given={"thickness": 0.02}),
    Row((12, 1), 0.950, 0.939, given={"thickness": 0.02}),
    Row((12, 2), 0.972, 0.940, given={"thickness": 0.02}),
    Row((30, 2), 0.975, 0.945, given={"thickness": 0.02}),
    Row((6, 1), 0.994, 0.994, given={"thickness": 0.002}),
    Row((12, 1), 0.994, 0.994, given={"thickness": 0.002}),
    Row((12, 2), 0.994, 0.994, given={"thickness": 0.002}),
    Row((30, 2), 0.994, 0.994, given={"thickness": 0.002}),
)
def torsion(mesh: Mesh, thickness: float) -> Values:
    """Rate of twist in the outer half of a strip of 6 x 0.2 that is clamped at one end."""
    E, nu, length, b = 1e7, 0.3, 6.0, 0.2
    couple = 1e-3 * E / 2 / (1 + nu) * torsion_constant(b, thickness)

    def forces(x: Floats) -> Floats:
        return np.stack([0 * x[0], 0 * x[0], 12 * couple / b**3 * (x[1] - b / 2)])

    shell = mesh.shell(Rectangle(length, b), Isotropic(E, nu, thickness=thickness))
    load = EdgeForce("right", forces)
    simulation = statics(shell, supports=Clamped("left"), loads=load)
    turn = [
        displacement_at(simulation, (x, b, 0.0))[2] - displacement_at(simulation, (x, 0.0, 0.0))[2]
        for x in (length / 2, length)
    ]
    return {"": (turn[1] - turn[0]) / b / 1e-3 / (length / 2)}


def tube(length: float) -> Parametric:
    """A tube of radius 1 about the x axis, slit along its top."""

    def position(xi: Floats, eta: Floats) -> Floats:
        a = 2 * np.pi * xi
        return np.stack([length * eta, np.sin(a), np.cos(a)])

    return Parametric(position, slit=True)


@problem(
    "tubes in torsion",
    "Saint-Venant; Bredt",
    Row((16, 4), 1.001, 0.998, given={"which": "slit", "thickness": 0.05}),
    Row((16, 4), 1.000, 0.997, given={"which": "slit", "thickness": 0.005}),
    Row((16, 4), 0.999, 0.996, MOVED, {"which": "slit", "thickness": 0.005}),
    Row((16, 4), 1.000, 1.000, given={"which": "closed", "thickness": 0.005}),
    Row((16, 4), 1.000, 1.000, MOVED, {"which": "closed", "thickness": 0.005}),
)
def tubes(mesh: Mesh, which: str, thickness: float) -> Values:
    """Twist of a tube that may warp, slit along it or closed.

    Its middle section does not turn, which one half is seen of.
    """
    length, G = 4.0, 1 / 2 / (1 + 0.3)
    open_one = which == "slit"
    surface = tube(length) if open_one else Cylinder(1.0, length, (0.0, 360.0), axis=X, start=Z)
    shell = mesh.shell(surface, Isotropic(1.0, 0.3, thickness=thickness))
    middle = Fixed("bottom", (None, 0.0, 0.0), (0.0, 0.0, 0.0))
    constant = 2 * np.pi * thickness**3 / 3 if open_one else 2 * np.pi * thickness
    couple = 1e-3 * G * constant

    def flow(x: Floats) -> Floats:
        return couple / (2 * np.pi) * np.stack([0 * x[0], -x[2], x[1]])

    moment = EdgeMoment("top", (couple / (2 * np.pi), 0.0, 0.0))
    load = moment if open_one else EdgeForce("top", flow)
    held = middle, Fixed((0.0, 0.0, -1.0), (0.0, None, None))
    x, u = everywhere(statics(shell, supports=held, loads=load))
    end = np.abs(x[:, 0] - length) < 1e-6
    turn = np.mean(u[end, 2] * x[end, 1] - u[end, 1] * x[end, 2])
    return {"": float(turn) / length / 1e-3}


@problem(
    "pulled tube",
    "F x/(E A)",
    Row((8, 16), 1.000, 1.000),
    Row((8, 32), 1.000, 1.000),
)
def pulled_tube(mesh: Mesh) -> Values:
    """A thin tube pulled by four point forces: means of nodes at mid-span.

    A quarter of it, between two of the forces.
    """
    R, length, t = 1.0, 4.0, 0.01
    surface = Cylinder(R, length, (0.0, 90.0))
    shell = mesh.shell(surface, Isotropic(1 / t, 0.3, thickness=t))
    held = (
        SymmetryPlane("left", Y),
        SymmetryPlane("right", X),
        Fixed("bottom", (None, None, 0.0), (None, None, 0.0)),
    )
    loads = [PointForce(p, (0.0, 0.0, 0.5)) for p in ((R, 0.0, length), (0.0, R, length))]
    x, u = everywhere(statics(shell, supports=held, loads=loads))
    half = np.flatnonzero(np.abs(x[:, 2] - length / 2) < 1e-9)
    half = half[np.argsort(x[half, 1])]
    stretch = u[half, 2] / (4 * length / 2 / (2 * np.pi * R))
    # those on the planes of symmetry belong to two quarters
    vertices = np.average(stretch[::2], weights=[0.5, *[1.0] * (mesh.size[0] - 1), 0.5])
    return {"vertices": float(vertices), "middles of sides": float(stretch[1::2].mean())}


def _linear(x: Floats, slope: float) -> Floats:
    """A force along x that grows with z."""
    return np.stack([slope * x[2], 0 * x[0], 0 * x[0]])


@problem(
    "lateral-torsional buckling",
    "Timoshenko & Gere, Theory of Elastic Stability: uniform moment, fork supports",
    Row((16, 2), 0.985, 0.989),
    Row((32, 4), 0.985, 0.989),
)
def lateral_torsional_buckling(mesh: Mesh) -> Values:
    """Load factor of an I-beam of three plates under a uniform moment."""
    L, b, h, t, E, nu = 6.0, 0.2, 0.4, 0.01, 210e9, 0.0
    inertia, J = t * b**3 / 6, 2 * torsion_constant(b, t) + h * t**3 / 3
    warping = inertia * h**2 / 4
    torsion = E / 2 / (1 + nu) * J
    bend = E * (inertia + h * t**3 / 12)
    critical = np.pi / L * np.sqrt(bend * (torsion + np.pi**2 * E * warping / L**2))
    # stress at the flanges' middle surface under that moment
    stress = critical * h / 2 / (t * h**3 / 12 + b * t * h**2 / 2 + 2 * b * t**3 / 12)
    section = Isotropic(E, nu, thickness=t)
    along, across = mesh.size
    half = Mesh(mesh.cell, (along, max(1, across // 2)), mesh.moved)
    shells = [mesh.shell(Rectangle(L, h, (0, 0, -h / 2), axis2=Z), section, "web")]
    joins, loads = [], []
    for name, z in (("lower", -h / 2), ("upper", h / 2)):
        for side, y in (("right", -b / 2), ("left", 0.0)):
            flange = Rectangle(L, b / 2, (0, y, z))
            shells.append(half.shell(flange, section, f"{name} {side}"))
            force = stress * t * math.copysign(1.0, z)
            loads += [
                EdgeForce("left", (force, 0, 0), f"{name} {side}"),
                EdgeForce("right", (-force, 0, 0), f"{name} {side}"),
            ]
        joins.append(Join(f"{name} right", f"{name} left", "top", "bottom"))
        joins.append(Join(f"{name} left", "web", "bottom", "bottom" if z < 0 else "top"))
    for edge, sign in (("left", 1.0), ("right", -1.0)):
        web = partial(_linear, slope=sign * 2 * stress * t / h)
        loads.append(EdgeForce(edge, web, "web"))
    held = [
        Fixed(("left", "right"), (None, 0.0, None), body="web"),
        Fixed((0.0, 0.0, 0.0), (None, None, 0.0), body="web"),
        Fixed((L, 0.0, 0.0), (None, None, 0.0), body="web"),
        Fixed((L / 2, 0.0, 0.0), (0.0, None, None), body="web"),
    ]
    scene = Scene("beam", shells, joins=joins, supports=held, loads=loads, scheme="linear-statics")
    return {"": float(linear_buckling(scene, MPI.COMM_WORLD, 1).factors[0])}


@problem(
    "compressed plate",
    "Timoshenko & Gere, Theory of Elastic Stability",
    Row((4, 4), (1.0, 1.015), (0.985, 0.91)),
    Row((8, 8), (1.0, 1.0, 1.01, 1.0), (0.997, 0.98, 0.957, 0.972)),
)
def compressed(mesh: Mesh) -> Values:
    """Load factors of a thin square on hard supports under a force along one side."""
    count = mesh.size[0] // 2
    scene, _ = compressed_plate(mesh.cell, 1000.0, mesh.size[0])
    found = linear_buckling(scene, MPI.COMM_WORLD, count).factors
    # waves along and across the force
    exact = (4.0, 6.25, (3 + 1 / 3) ** 2, 16.0)
    return {f"mode {k + 1}": float(found[k]) / exact[k] for k in range(count)}


@problem(
    "Z-section",
    "NAFEMS LE5: -108 MPa; shells converge to -110.5",
    Row((8, 1), 1.023, 1.017),
    Row((16, 2), 1.023, 1.017),
)
def z_section(mesh: Mesh) -> Values:
    """Axial stress in a cantilever of three plates under a torque, at a quarter of its length."""
    L, t = 10.0, 0.1
    section = Isotropic(210e9, 0.3, thickness=t)
    along, across = mesh.size
    web = Mesh(mesh.cell, (along, 2 * across), mesh.moved)
    shells = (
        mesh.shell(Rectangle(L, 1.0, (0, -1, 1)), section, "first"),
        web.shell(Rectangle(L, 2.0, (0, 0, -1), axis2=Z), section, "web"),
        mesh.shell(Rectangle(L, 1.0, (0, 0, -1)), section, "second"),
    )
    joins = Join("first", "web", "top", "top"), Join("second", "web", "bottom", "bottom")
    loads = (
        EdgeForce("right", (0.0, 0.6e6, 0.0), "first"),
        EdgeForce("right", (0.0, -0.6e6, 0.0), "second"),
    )
    held = tuple(Clamped("left", s.name) for s in shells)
    simulation = statics(*shells, joins=joins, supports=held, loads=loads)
    # strain along the free edge about the point by displacements two elements apart
    x, u = everywhere(simulation, "first")
    edge = np.flatnonzero(np.abs(x[:, 1] + 1) < 1e-9)
    edge = edge[np.argsort(x[edge, 0])]
    at = int(np.argmin(np.abs(x[edge, 0] - L / 4)))
    around = edge[at - 2 : at + 3]
    strain = np.polyval(np.polyder(np.polyfit(x[around, 0], u[around, 0], 3)), L / 4)
    return {"": abs(float(210e9 * strain)) / 108e6}


@problem(
    "Raasch's hook",
    "5.02, MacNeal's beam theory as FinEtoolsFlexStructures has it; solids 4.935",
    Row((18, 3), 1.001, 0.957),
    Row((36, 5), 1.004, 0.982),
)
def hook(mesh: Mesh) -> Values:
    """A curved strip of two arcs, clamped, with a shear force along its other end."""
    first, second = 14 * math.radians(60), 46 * math.radians(150)

    def position(xi: Floats, eta: Floats) -> Floats:
        s, centre = (first + second) * xi, (60 * math.sin(math.pi / 3), -16.0)
        a, b = np.minimum(s, first) / 14, math.radians(150) - np.maximum(s - first, 0.0) / 46
        x = np.where(s < first, 14 * np.sin(a), centre[0] + 46 * np.cos(b))
        y = np.where(s < first, 14 - 14 * np.cos(a), centre[1] + 46 * np.sin(b))
        return np.stack([x, y, 20 * eta])

    shell = mesh.shell(Parametric(position), Isotropic(3300.0, 0.35, thickness=2.0))
    load = EdgeForce("right", (0.0, 0.0, 0.05))
    x, u = everywhere(statics(shell, supports=Clamped("left"), loads=load))
    end = np.argmax(x[:, 0] - 1e3 * np.abs(x[:, 2]))
    return {"": float(u[end, 2]) / 5.02}
