"""Frequencies: spheres, membranes in and across their plane, and a mass on a joint."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from shellmb.arrays import Floats
from shellmb.demos.verification import tables
from shellmb.demos.verification.problems.elements.curved import DENSITY, NU, STEEL, baker, octant
from shellmb.demos.verification.problems.elements.plane import AT_THE_FORCE, PLANE
from shellmb.demos.verification.problems.elements.rows import MOVED, Mesh, Row, Values, problem
from shellmb.demos.verification.setups import plate_section
from shellmb.running.natural_modes.vibration import Modes, natural_modes
from shellmb.scene import (
    Clamped,
    Cylinder,
    EdgeForce,
    Fixed,
    Isotropic,
    Parametric,
    Rectangle,
    RigidBody,
    Scene,
    Shell,
    Spherical,
)


def modes(count: int, *shells: Shell, loaded: bool = False, **more: Any) -> Modes:
    """Lowest modes of shells.

    Args:
        count: How many.
        shells: The shells.
        loaded: Whether about the equilibrium under loads.
        more: Further arguments of `Scene`.
    """
    given: dict[str, Any] = {"scheme": "ep", "dt": 1.0, "t_end": 1.0, **more}
    scene = Scene("modes", shells, **given)
    return natural_modes(scene, count=count, loaded=loaded)


def named(found: Floats, exact: Sequence[float] | Floats) -> Values:
    """Frequencies over references, in their order."""
    pairs = zip(found, exact, strict=True)
    return {f"mode {k}": float(f / e) for k, (f, e) in enumerate(pairs, start=1)}


@problem(
    "sphere's frequencies",
    "membrane: W. E. Baker, J. Acoust. Soc. Am. 33 (1961) 1749-1758",
    Row((4, 4), 1.000, 1.000, given={"thickness": 0.02}),
    Row((4, 4), 1.000, 0.999, given={"thickness": 1e-3}),
    Row((8, 8), 1.000, 1.000, given={"thickness": 1e-3}),
)
def closed_sphere(mesh: Mesh, thickness: float) -> Values:
    """Lowest frequency of a closed sphere, which cannot bend without stretching."""
    shell, symmetry = octant(mesh, thickness)
    return {"": float(modes(1, shell, supports=symmetry).omega[0]) / baker(2)}


@problem(
    "FV32",
    "NAFEMS FV32",
    Row((8, 4), 1.0, (1.0, 1.0, 1.0, 1.004, 1.01), given={"thickness": 0.05}),
    Row((16, 8), 1.0, 1.0, given={"thickness": 0.05}),
    Row((16, 8), 1.0, 1.0, given={"thickness": 5e-4}),
    Row((16, 8), 1.0, 1.0, MOVED, {"thickness": 0.05}),
)
def tapered_membrane(mesh: Mesh, thickness: float) -> Values:
    """A tapered cantilever that moves in its plane: first five frequencies."""

    def tapered(xi: Floats, eta: Floats) -> Floats:
        return np.stack([10 * xi, (eta - 0.5) * (5 - 4 * xi), 0 * xi])

    section = Isotropic(STEEL, NU, thickness=thickness, density=DENSITY)
    areas = {"all": lambda x: x[0] > -1}
    shell = mesh.shell(Parametric(tapered), section, geometry_order=1, areas=areas)
    held = Clamped("left"), Fixed("all", displacement=(None, None, 0.0))
    found = modes(5, shell, supports=held).frequencies
    exact = (44.623, 130.03, 162.70, 246.05, 379.90)
    return named(found, exact)


@problem(
    "free sheet",
    "Bardell, Langley & Dunsdon, J. Sound Vib. 191 (1996) 459-467",
    Row((2, 2), (1.013, 1.034, 1.034), (1.011, 1.037, 1.037), given={"thickness": 1e-3}),
    Row((4, 4), 1.0, 1.0, given={"thickness": 1e-3}),
    Row((4, 4), 1.0, 1.0, given={"thickness": 1e-5}),
    Row((4, 4), 1.0, 1.0, MOVED, {"thickness": 1e-5}),
)
def free_sheet(mesh: Mesh, thickness: float) -> Values:
    """A free square that moves in its plane: nothing moves there that strains do not see."""
    section = Isotropic(1 - NU**2, NU, thickness=thickness, density=1.0)
    areas = {"all": lambda x: x[0] > -1}
    shell = mesh.shell(Rectangle(1.0, 1.0), section, areas=areas)
    found = modes(6, shell, supports=Fixed("all", (None, None, 0.0))).omega[3:]
    return named(found, (2.321, 2.472, 2.472))


@problem(
    "free plate",
    "Ritz, thin plate, plate_thin_freq_ritz.csv",
    Row((8, 8), 1.0, 1.0),
    Row((8, 8), 1.0, 1.0, MOVED),
)
def free_plate(mesh: Mesh) -> Values:
    """Bending of a free thin square: first five frequencies."""
    section = plate_section(1e-3, density=1.0)
    found = modes(11, mesh.shell(Rectangle(1.0, 1.0), section)).omega[6:]
    exact = tables.thin_plate_frequencies("free")[:5] * math.sqrt(float(section.D[0, 0]) / 1e-3)
    return named(found, exact)


@problem(
    "free ring",
    "ring without stretching (Love, Theory of Elasticity, art. 293)",
    Row((32, 2), 1.0, 1.0, given={"thickness": 1e-2}),
    Row((32, 2), 1.0, 1.0, given={"thickness": 1e-3}),
)
def free_ring(mesh: Mesh, thickness: float) -> Values:
    """Bending of a thin ring in its plane without stretching: two and three waves."""
    section = Isotropic(1.0, 0.0, thickness=thickness, density=12.0)
    found = modes(14, mesh.shell(Cylinder(1.0, 0.1), section)).omega[6:]
    exact = [n * (n**2 - 1) / math.sqrt(n**2 + 1) * thickness / 12 for n in (2, 3)]
    nearest = [found[np.argmin(np.abs(found - omega))] for omega in exact]
    return named(np.array(nearest), exact)


@problem(
    "stretched membrane",
    "membrane under tension",
    Row((4, 4), 1.0, (1.002, 1.007, 1.007, 1.021)),
    Row((8, 8), 1.0, 1.0),
    Row((8, 8), 1.0, 1.0, MOVED),
)
def stretched_membrane(mesh: Mesh) -> Values:
    """A thin square that tension alone holds across its plane: first four frequencies."""
    E, t = 70e9, 1e-4
    section = Isotropic(E, NU, thickness=t, density=2700.0)
    tension = 1e-3 * E / (1 - NU) * t
    held = (
        Fixed("left", (0.0, None, 0.0)),
        Fixed("bottom", (None, 0.0, 0.0)),
        Fixed(("right", "top"), (None, None, 0.0)),
    )
    pull = (
        EdgeForce("right", (tension, 0.0, 0.0)),
        EdgeForce("top", (0.0, tension, 0.0)),
    )
    shell = mesh.shell(Rectangle(1.0, 1.0), section)
    found = modes(4, shell, supports=held, loads=pull, scheme="static", loaded=True).frequencies
    exact = math.sqrt(tension / (2700.0 * t)) / 2 * np.sqrt([2, 5, 5, 8])
    return named(found, exact)


@problem(
    "mass on a joint",
    f"{PLANE}, the force spread over an eighth of the side",
    Row((4, 2), 1.0, 1.0),
    Row((8, 4), 1.0, 1.0),
    Row((16, 8), 1.0, 1.0),
)
def mass_on_a_joint(mesh: Mesh) -> Values:
    """A heavy mass on a spherical joint in the middle of a sheet's end swings in its plane.

    Each time that elements halve, a dent of a point takes 0.6 % of the frequency.
    """
    mass, tip = 100.0, (2.0, 0.5, 0.0)
    areas = {"all": lambda x: x[0] > -1}
    section = Isotropic(1e3, NU, thickness=1e-3, density=1.0)
    shell = mesh.shell(Rectangle(2.0, 1.0), section, areas=areas)
    # the mass turns freely: three rigid motions
    found = modes(
        4,
        shell,
        supports=(Clamped("left"), Fixed("all", (None, None, 0.0))),
        rigid_bodies=RigidBody("mass", mass, (1.0, 1.0, 1.0), position=tip),
        joints=Spherical("joint", "mass", "shell", at="origin", second_at=tip),
    )
    return {"": float(found.omega[3]) * math.sqrt(AT_THE_FORCE * mass)}
