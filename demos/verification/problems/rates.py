"""Rates of convergence, and no locking however thin the plate and distorted the mesh."""

import math
from collections.abc import Iterator

import numpy as np
import ufl

from shellmb.arrays import Floats
from shellmb.demos.verification import tables
from shellmb.demos.verification.cases import Check, case
from shellmb.demos.verification.laminates import Stiffness, sinusoidal_deflection
from shellmb.demos.verification.problems.laminates import sinusoidal
from shellmb.demos.verification.problems.plates import CELLS, THIN_CLAMPED
from shellmb.demos.verification.setups import CENTRE, Cell, Edges, plate_section, square
from shellmb.demos.verification.solve import deflection_error, displacement_at, solved

MESHES = (4, 8, 16)
SLENDERNESS = (10, 1000)
# of the deflection in L2: degree 2, and on triangles shear forces without all linear ones
THEORY: dict[Cell, float] = {"quad": 3.0, "tri": 2.0}
# thin plates of triangles come nearer more slowly on these meshes; 0.3 % is left on 16x16
THIN_TRIANGLES = 1.3
MODERATE, EXTREME = 1e2, 1e5


def _errors(slenderness: float, cell: Cell) -> Floats:
    """Relative error of the deflection in L2 on each mesh, sinusoidal load, hard support."""
    section = plate_section(1 / slenderness)
    q = float(section.D[0, 0])
    stiffness = Stiffness(section.A, section.B, section.D, section.G)
    exact = sinusoidal_deflection("SS-1", stiffness, 1.0, 1.0, q)
    found = []
    for n in MESHES:
        simulation = solved(square("hard", section, sinusoidal(q), mesh=(n, n), cell=cell))
        (shell,) = simulation.model.shells.values()
        x = ufl.SpatialCoordinate(shell.mixed.space.mesh)
        wave = exact * ufl.sin(math.pi * x[0]) * ufl.sin(math.pi * x[1])
        found.append(deflection_error(simulation, wave))
    return np.array(found)


@case("rates/deflection")
def deflection_rates() -> Iterator[Check]:
    """Rate in L2 between the two finest of three meshes, by the exact solution."""
    for cell in CELLS:
        for slenderness in SLENDERNESS:
            error = _errors(slenderness, cell)
            rates = np.log2(error[:-1] / error[1:])
            shown = ", ".join(f"{e:.2e}" for e in error)
            yield Check(
                f"deflection in L2, a/h={slenderness}, {cell} 4, 8, 16",
                float(rates[-1]),
                THIN_TRIANGLES if cell == "tri" and slenderness > MODERATE else THEORY[cell],
                f"theory; errors {shown}",
                0.2,
                "at least",
            )


def _error(edges: Edges, slenderness: float, cell: Cell, distortion: float) -> float:
    """Relative error of the centre deflection on 8x8."""
    scene = square(edges, plate_section(1 / slenderness), cell=cell, distortion=distortion)
    if slenderness == MODERATE:
        name = "SSSS hard" if edges == "hard" else "CCCC"
        reference = tables.plate_deflection(name, slenderness)
    else:
        reference = tables.plate_deflection("SSSS hard", 1000) if edges == "hard" else THIN_CLAMPED
    return float(abs(displacement_at(solved(scene), CENTRE)[2] / reference - 1))


@case("rates/locking")
def locking() -> Iterator[Check]:
    """Error at a thickness of 1e-5 against that at 1e-2, on regular and distorted meshes."""
    both: tuple[Edges, ...] = ("hard", "clamped")
    for cell in CELLS:
        for edges in both:
            regular = [_error(edges, s, cell, 0.0) for s in (MODERATE, EXTREME)]
            shown = f"errors {regular[0]:.1e} at t/L=1e-2, {regular[1]:.1e} at 1e-5"
            yield Check(
                f"{edges}, error at t/L=1e-5 over error at 1e-2, {cell} 8x8",
                regular[1] / regular[0],
                2.0,
                f"no locking: at most twice; {shown}",
                0.0,
                "at most",
            )
            for slenderness in (MODERATE, EXTREME):
                yield Check(
                    f"{edges}, error at t/L={1 / slenderness:.0e}, {cell} 8x8 distorted by 25 %",
                    _error(edges, slenderness, cell, 0.25),
                    0.0,
                    "thin plate" if slenderness == EXTREME else "Reissner-Mindlin",
                    0.03,
                    "at most",
                )
