"""Natural frequencies of plates, and the rigid modes of free ones."""

import math
from collections.abc import Iterator

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats
from shellmb.demos.verification import tables
from shellmb.demos.verification.cases import Check, case
from shellmb.demos.verification.problems.laminates import laminate
from shellmb.demos.verification.setups import ALL, SUPPORTS, Edges, plate_section
from shellmb.running.natural_modes.vibration import Modes, natural_modes
from shellmb.scene import (
    Clamped,
    Fixed,
    HardSupport,
    Isotropic,
    Laminate,
    PlyMaterial,
    Rectangle,
    Scene,
    Shell,
    Support,
)

RITZ = "Ritz, Reissner-Mindlin, plate_rm_freq_ritz.csv"
THIN_RITZ = "Ritz, thin plate, plate_thin_freq_ritz.csv"
COUNT = 5
# among the bending modes of a thick plate there are some in its plane, which tables leave out
SPARE = 4
# edges that move neither in the plane nor out of it, so that modes in the plane lie higher
HELD = (HardSupport(ALL), Fixed(ALL, displacement=(0.0, 0.0, None)))

PLATES: tuple[tuple[Edges, str, str], ...] = (
    ("hard", "SSSS hard", "simply supported"),
    ("clamped", "CCCC", "clamped"),
    ("cantilever", "CFFF", "cantilever (clamped x=0)"),
    ("free", "FFFF", "free"),
)
NAMES = {"hard": "simply supported", "clamped": "clamped", "cantilever": "cantilever"}
THICK, THIN = 10, 1000

LAMINA = PlyMaterial(40.0, 1.0, nu12=0.25, G12=0.6, G13=0.6, G23=0.5, density=1.0)


def _is_bending(modes: Modes, mode: int) -> bool:
    """Decide whether a mode of a plate in the x-y plane moves mostly out of it."""
    (shape,) = modes.shapes[mode].values()
    largest = np.max(np.abs(shape), axis=0, initial=0.0)
    modes.model.comm.Allreduce(MPI.IN_PLACE, largest, op=MPI.MAX)
    return bool(largest[2] > max(largest[0], largest[1]))


def _bending(scene: Scene, count: int, rigid: int = 0) -> tuple[Floats, Modes]:
    """Angular frequencies of the first bending modes that are not rigid, and all modes."""
    modes = natural_modes(scene, count=count + SPARE + rigid)
    kept = [k for k in range(rigid, count + SPARE + rigid) if _is_bending(modes, k)]
    return modes.omega[kept][:count], modes


def _free(surface: Rectangle, section: Isotropic | Laminate, *supports: Support) -> Scene:
    """A plate for modes only, 8x8."""
    shell = Shell("plate", surface, section)
    return Scene("plate", (shell,), supports=supports, scheme="ep", dt=1.0, t_end=1.0)


@case("frequencies/square")
def squares() -> Iterator[Check]:
    """First five bending frequencies `omega a^2 sqrt(rho h / D)`."""
    for edges, thick_name, thin_name in PLATES:
        supports = HELD if edges == "hard" else SUPPORTS[edges]
        rigid = 6 if edges == "free" else 0
        for slenderness in (THICK, THIN):
            h = 1 / slenderness
            section = plate_section(h, density=1.0)
            scene = _free(Rectangle(1.0, 1.0), section, *supports)
            omega, modes = _bending(scene, COUNT, rigid)
            factor = math.sqrt(h / float(section.D[0, 0]))
            if slenderness == THICK:
                reference, source = tables.plate_frequencies(thick_name, THICK), RITZ
            else:
                reference, source = tables.thin_plate_frequencies(thin_name), THIN_RITZ
            name = f"{NAMES.get(edges, edges)}, a/h={slenderness}, quad 8x8"
            if rigid:
                yield Check(
                    f"{name}, rigid modes", modes.rigid, 6.0, "rigid motions of a body", 0.0
                )
            for k in range(COUNT):
                value = float(omega[k] * factor)
                yield Check(f"{name}, mode {k + 1}", value, float(reference[k]), source)


@case("frequencies/NAFEMS")
def nafems() -> Iterator[Check]:
    """FV12, thin and free, and FV52, thick and simply supported, in Hz."""
    side = Rectangle(10.0, 10.0)
    thin = Isotropic(200e9, 0.3, thickness=0.05, density=8000.0)
    omega, _ = _bending(_free(side, thin), 8, rigid=6)
    published = (1.622, 2.360, 2.922, 4.190, 4.190, 7.356, 7.356, 7.668)
    for k, reference in enumerate(published):
        value = float(omega[k] / (2 * math.pi))
        yield Check(f"FV12 free plate, quad 8x8, mode {k + 1}", value, reference, "NAFEMS FV12")
    # the published values belong to this shear correction
    thick = Isotropic(200e9, 0.3, thickness=1.0, density=8000.0, shear_correction=math.pi**2 / 12)
    omega, _ = _bending(_free(side, thick, *HELD), 4)
    for k, reference in enumerate((45.897, 109.44, 109.44, 167.89)):
        value = float(omega[k] / (2 * math.pi))
        yield Check(f"FV52 thick plate, quad 8x8, mode {k + 1}", value, reference, "NAFEMS FV52")


@case("frequencies/laminate")
def laminates() -> Iterator[Check]:
    """Lowest `omega a^2 / h sqrt(rho / E2)`, and a plate that has been measured."""
    layups: tuple[tuple[Edges, str, list[float]], ...] = (
        ("SS-1", "0/90/90/0 equal plies", [0, 90, 90, 0]),
        ("SS-2", "45/-45", [45, -45]),
        ("SS-2", "(45/-45)x4", [45, -45] * 4),
    )
    for edges, layup, angles in layups:
        for slenderness in (10, 100):
            h = 1 / slenderness
            section = laminate(LAMINA, angles, h)
            scene = _free(Rectangle(1.0, 1.0), section, *SUPPORTS[edges])
            omega, _ = _bending(scene, 1)
            yield Check(
                f"[{layup}] simply supported, a/h={slenderness}, quad 8x8",
                float(omega[0] / h),
                tables.laminate_frequency(layup, slenderness),
                "FSDT with rotary inertia, laminate_ss_frequency.csv",
            )


@case("frequencies/Kosmatka")
def kosmatka() -> Iterator[Check]:
    """Cantilever with bending-twisting coupling, measured; mode 7 of the list lies in its plane."""
    inch, psi = 0.0254, 6894.757
    half = [22.5, -22.5, 0.0, 0.0, -22.5, 0.0, 0.0, 22.5, 0.0, 0.0]
    E2, G12, nu23 = 1.45e6 * psi, 0.917e6 * psi, 0.4
    G23 = E2 / 2 / (1 + nu23)
    density = 0.05781 * 0.45359237 / inch**3
    ply = PlyMaterial(22.43e6 * psi, E2, nu12=0.25, G12=G12, G13=G12, G23=G23, density=density)
    section = Laminate.from_stacking(
        ply, 0.1 * inch / 20, half + half[::-1], shear_correction=math.pi**2 / 12
    )
    scene = _free(Rectangle(9 * inch, 3 * inch), section, Clamped("left"))
    omega, _ = _bending(scene, 7)
    for k, measured in enumerate((69.0, 270.0, 427.0, 890.0, 1155.0, 1426.0, 1738.0)):
        value = float(omega[k] / (2 * math.pi))
        yield Check(
            f"measured laminate, quad 8x8, bending mode {k + 1}",
            value,
            measured,
            "experiment of Kosmatka, by FinEtools; a calculation there is 4 % off as well",
            0.05,
        )
