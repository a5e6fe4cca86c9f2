"""Triangles beside quadrilaterals: in their plane, curved, distorted, free, from files."""

import math
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from mpi4py import MPI

import meshio
import numpy as np

from shellmb.arrays import Floats
from shellmb.demos.references.beams import cantilever_end_force
from shellmb.demos.verification import tables
from shellmb.demos.verification.cases import Check, case
from shellmb.demos.verification.problems.linear_shells import (
    QUADRANT,
    X,
    Y,
    Z,
    hemisphere,
    scordelis_lo,
)
from shellmb.demos.verification.problems.plates import CELLS
from shellmb.demos.verification.setups import Cell, plate_section
from shellmb.demos.verification.solve import linear_displacement, solved
from shellmb.scene import (
    Clamped,
    Cylinder,
    EdgeForce,
    Fixed,
    Isotropic,
    MeshFile,
    Parametric,
    Pressure,
    Rectangle,
    Scene,
    Shell,
    Sphere,
    SurfaceForce,
    SymmetryPlane,
)
from shellmb.scene.loads.supports import Support
from shellmb.vibration import Modes, natural_modes

STEEL, NU, DENSITY = 2e11, 0.3, 8000.0
# of elements beside closed forms of thin shells
NEAR = 0.03
# of very thin shells on meshes distorted by 25 %
DISTORTED, FAR = 0.25, 0.1
# of vertices of doubly curved shells under pressure
BULGING = 0.15


def _moving(shell: Shell, *supports: Support) -> Scene:
    """A scene for modes only."""
    return Scene("modes", (shell,), supports=supports, scheme="ep", dt=1.0, t_end=1.0)


def _in_plane(modes: Modes) -> list[int]:
    """Modes of a plate in the x-y plane that move mostly in it, without rigid ones."""
    found = []
    for k, shapes in enumerate(modes.shapes[modes.rigid :], start=modes.rigid):
        (shape,) = shapes.values()
        largest = np.max(np.abs(shape), axis=0, initial=0.0)
        modes.model.comm.Allreduce(MPI.IN_PLACE, largest, op=MPI.MAX)
        if largest[2] < max(largest[0], largest[1]):
            found.append(k)
    return found


@case("triangles/cantilever")
def cantilever() -> Iterator[Check]:
    """Bent in its plane by a force across its end, however thin."""
    length, height, force = 1.0, 0.1, 1e3
    for cell in CELLS:
        for ratio in (0.1, 1e-3):
            t = ratio * height
            shell = Shell(
                "web", Rectangle(length, height), Isotropic(STEEL, NU, thickness=t), (20, 4)
            )
            scene = Scene(
                "web",
                (replace(shell, cell=cell),),
                supports=(Clamped("left"),),
                loads=(EdgeForce("right", (0.0, force / height, 0.0)),),
                scheme="linear-statics",
            )
            bending, shear = STEEL * t * height**3 / 12, STEEL / 2 / (1 + NU) * t * height / 1.2
            yield Check(
                f"t/height={ratio:g}, {cell} 20x4",
                float(linear_displacement(scene, (length, height / 2, 0.0))[1]),
                cantilever_end_force(force, bending, length, shear),
                "Timoshenko beam",
                NEAR,
            )


@case("triangles/membrane")
def membrane() -> Iterator[Check]:
    """A tapered cantilever that moves in its plane: first five frequencies in Hz."""

    def tapered(xi: Floats, eta: Floats) -> Floats:
        return np.stack([10 * xi, (eta - 0.5) * (5 - 4 * xi), 0 * xi])

    for cell in CELLS:
        for t in (0.05, 0.005, 0.0005):
            shell = Shell(
                "membrane",
                Parametric(tapered),
                Isotropic(STEEL, NU, thickness=t, density=DENSITY),
                mesh=(16, 8),
                cell=cell,
                geometry_order=1,
                areas={"all": lambda x: x[0] > -1},
            )
            flat = Fixed("all", displacement=(None, None, 0.0))
            modes = natural_modes(_moving(shell, Clamped("left"), flat), count=5)
            for k, reference in enumerate((44.623, 130.03, 162.70, 246.05, 379.90)):
                name = f"FV32, t={1e3 * t:g} mm, {cell} 16x8, mode {k + 1}"
                yield Check(name, float(modes.frequencies[k]), reference, "NAFEMS FV32")


@case("triangles/free plate")
def free_plate() -> Iterator[Check]:
    """Nothing moves in the plane where it should not; and the first bending frequencies."""
    reference = tables.thin_plate_frequencies("free")
    for cell in CELLS:
        section = plate_section(1e-3, density=1.0)
        shell = Shell("plate", Rectangle(1.0, 1.0), section, cell=cell)
        modes = natural_modes(_moving(shell), count=60)
        yield Check(
            f"a/h=1000, {cell} 8x8, modes in its plane among the first 60",
            float(len(_in_plane(modes))),
            0.0,
            "the first one lies higher, at any thickness",
            0.0,
        )
        factor = math.sqrt(1e-3 / float(section.D[0, 0]))
        for k in range(5):
            yield Check(
                f"a/h=1000, {cell} 8x8, mode {k + 1}, omega a^2 sqrt(rho h/D)",
                float(modes.omega[6 + k] * factor),
                float(reference[k]),
                "Ritz, thin plate, plate_thin_freq_ritz.csv",
                NEAR,
            )


@case("triangles/curved")
def curved() -> Iterator[Check]:
    """Shells of the obstacle course, and a cylinder under pressure, whose radius grows evenly."""
    for cell in CELLS:
        roof, ball = scordelis_lo(), hemisphere(18.0)
        for scene, name, reference, point, axis in (
            (roof, "Scordelis-Lo", -0.30202, "right-bottom", 2),
            (ball, "hemisphere, 18 degree hole", 0.093, "left-top", 0),
        ):
            scene = replace(scene, shells=(replace(scene.shells[0], cell=cell),))
            value = float(linear_displacement(scene, point)[axis])
            yield Check(f"{name}, {cell} 16x16", value, reference, "as in linear shells", NEAR)
        surface = Cylinder(1.0, 1.0, angles=(0.0, 90.0), **QUADRANT)
        shell = Shell(
            "tube", surface, Isotropic(STEEL, NU, thickness=1e-3), mesh=(16, 8), cell=cell
        )
        symmetry = SymmetryPlane("left", X), SymmetryPlane("right", Z), SymmetryPlane("bottom", Y)
        for name, value in _growth(shell, symmetry, 1):
            yield Check(
                f"cylinder under pressure, R/t=1000, {cell} 16x8 per quarter, {name} growth",
                value,
                1.0,
                "p R^2/(E t)",
                NEAR,
            )


def _growth(
    shell: Shell, supports: tuple[Support, ...], axis: int | None
) -> list[tuple[str, float]]:
    """Least, largest, mean radial displacement over `p R^2/(E t)`; radius and pressure are one.

    Args:
        shell: The shell.
        supports: What holds it.
        axis: Axis of a cylinder; None for a sphere.
    """
    scene = Scene(
        "tube", (shell,), supports=supports, loads=(Pressure(1.0),), scheme="linear-statics"
    )
    simulation = solved(scene)
    (body,) = simulation.model.shells.values()
    state = simulation.problem.levels[shell.name].unknown[simulation.problem.last].x.array
    u, x = state[body.mixed.dofs["u"]].reshape(-1, 3).copy(), body.mixed.nodes("u").copy()
    if axis is not None:
        u[:, axis] = x[:, axis] = 0.0
    radial = np.sum(u * x, axis=1) / np.linalg.norm(x, axis=1)
    section = shell.section
    assert isinstance(section, Isotropic)
    radial = radial * float(section.E) * float(section.thickness)
    comm = body.mixed.space.mesh.comm
    counted = np.array([radial.sum(), len(radial)])
    comm.Allreduce(MPI.IN_PLACE, counted)
    return [
        ("least", comm.allreduce(float(radial.min()), op=MPI.MIN)),
        ("largest", comm.allreduce(float(radial.max()), op=MPI.MAX)),
        ("mean", float(counted[0] / counted[1])),
    ]


@case("triangles/closed sphere")
def closed_sphere() -> Iterator[Check]:
    """A sphere that cannot bend without stretching: its first frequency, and growth by a pressure.

    The frequency is that of a membrane, n = 2 (W. E. Baker, J. Acoust. Soc. Am. 33 (1961) 1749).
    """
    symmetry = SymmetryPlane("left", Y), SymmetryPlane("right", X), SymmetryPlane("top", Z)
    b, c = 7 + 3 * NU, 4 * (1 - NU**2)
    exact = math.sqrt((b - math.sqrt(b**2 - 4 * c)) / 2 / (1 - NU**2))
    for cell in CELLS:
        for t in (1e-2, 1e-3):
            shell = Shell(
                "ball",
                Sphere(1.0, polar=(0.0, 90.0), azimuth=(0.0, 90.0)),
                Isotropic(1.0, NU, thickness=t, density=1.0),
                mesh=(8, 8),
                cell=cell,
            )
            name = f"t/R={t:g}, {cell} 8x8 to an octant"
            first = natural_modes(_moving(shell, *symmetry), count=1).omega[0]
            yield Check(f"{name}, omega R sqrt(rho/E)", float(first), exact, "Baker", NEAR)
            for which, value in _growth(shell, symmetry, None):
                # of a cylinder; a sphere grows by p R^2 (1 - nu)/(2 E t)
                yield Check(
                    f"{name}, {which} growth",
                    value * 2 / (1 - NU),
                    1.0,
                    "p R^2 (1 - nu)/(2 E t)",
                    NEAR if which == "mean" else BULGING,
                )


def hypar(thickness: float, mesh: int, cell: Cell, distortion: float = 0.0) -> Scene:
    """Hyperbolic paraboloid clamped along one side under its weight."""

    def position(xi: Floats, eta: Floats) -> Floats:
        x, y = xi - 0.5, eta - 0.5
        return np.stack([x, y, x**2 - y**2])

    section = Isotropic(STEEL, NU, thickness=thickness)
    shell = Shell(
        "hypar", Parametric(position), section, (mesh, mesh), cell=cell, distortion=distortion
    )
    weight = SurfaceForce((0.0, 0.0, -DENSITY * thickness))
    return Scene(
        "hypar", (shell,), supports=(Clamped("left"),), loads=(weight,), scheme="linear-statics"
    )


@case("triangles/hypar", slow=True)
def hypars() -> Iterator[Check]:
    """Dominated by bending, ever thinner, on regular and on distorted meshes."""
    for cell in CELLS:
        for t, reference in ((1e-2, 9.3355e-5), (1e-3, 6.3941e-3), (1e-4, 0.52988)):
            for distortion in (0.0, DISTORTED):
                said = f" distorted by {100 * distortion:g} %" if distortion else ""
                scene = hypar(t, 32, cell, distortion)
                yield Check(
                    f"t/L={t:g}, {cell} 32x32{said}",
                    -float(linear_displacement(scene, (0.5, 0.0, 0.25))[2]),
                    reference,
                    "Bathe, Iosilevich & Chapelle, Comput. Struct. 75 (2000) 1-30",
                    FAR if distortion and t == 1e-4 else NEAR,
                )


@case("triangles/free ring")
def free_ring() -> Iterator[Check]:
    """Frequencies of bending in its plane without stretching, in units of `sqrt(E t^2/12 rho)`."""
    for cell in CELLS:
        for t in (1e-2, 1e-3):
            surface = Cylinder(1.0, 0.1, angles=(0.0, 360.0))
            shell = Shell(
                "ring",
                surface,
                Isotropic(1.0, 0.0, thickness=t, density=12.0),
                mesh=(32, 2),
                cell=cell,
            )
            modes = natural_modes(_moving(shell), count=14)
            for n in (2, 3):
                exact = n * (n**2 - 1) / math.sqrt(n**2 + 1) * t / 12
                nearest = modes.omega[6:][np.argmin(np.abs(modes.omega[6:] - exact))]
                yield Check(
                    f"t/R={t:g}, {cell} 32x2, n={n}",
                    float(nearest),
                    exact,
                    "ring without stretching (Love, Theory of Elasticity, art. 293)",
                    NEAR,
                )


@case("triangles/STL")
def facets() -> Iterator[Check]:
    """A cylinder of flat facets, as STL files have it, under pressure."""
    around, along, t = 64, 16, 1e-2
    angle = 2 * math.pi * np.arange(around) / around
    height = np.linspace(0.0, 1.0, along + 1)
    points = np.array([[math.cos(a), math.sin(a), z] for z in height for a in angle])
    row, column = (k.ravel() for k in np.meshgrid(range(along), range(around), indexing="ij"))
    a, b = row * around + column, row * around + (column + 1) % around
    cells = np.concatenate(
        [np.stack([a, b, b + around], axis=1), np.stack([a, b + around, a + around], axis=1)]
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "tube.stl"
        meshio.Mesh(points, [("triangle", cells)]).write(path)
        ends = {"lower": lambda x: x[2] < 1e-6}
        surface = MeshFile(path, edges_where=ends)
        shell = Shell("tube", surface, Isotropic(STEEL, NU, thickness=t), cell="tri")
        held = (
            Fixed("lower", displacement=(None, None, 0.0)),
            Fixed((1.0, 0.0, 0.0), displacement=(None, 0.0, None)),
            Fixed((-1.0, 0.0, 0.0), displacement=(None, 0.0, None)),
            Fixed((0.0, 1.0, 0.0), displacement=(0.0, None, None)),
        )
        # flat facets bend between their folds: by a tenth of this growth
        name, value = _growth(shell, held, 2)[-1]
        yield Check(f"tri 64x16, R/t=100, {name} growth", value, 1.0, "p R^2/(E t)", NEAR)
