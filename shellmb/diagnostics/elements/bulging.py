"""Vertices of triangles that bulge where a thin, doubly curved shell carries a pressure.

A pressure exerts next to nothing on the vertices of curved triangles of degree 2, and membrane
forces next to nothing but what the kinks between elements leave. Bending, and the share of shear
that surfaces like spheres have for it (`shellmb.model.sections.section`), take the difference. Of
the mean displacement of a sphere the vertices are off by at most 0.051, 0.12, 0.19, 0.17, 0.15 (4x4
cells to an octant, t/R = 0.1, 0.05, 0.02, 0.005, 0.001), 0.007, 0.025, 0.087, 0.106, 0.117 (8x8,
0.05, 0.02, 0.005, 0.0025, 0.001), 0.031, 0.072 (12x12, 0.005, 0.001), 0.046, 0.072 (16x16, 0.001,
0.0001). With `a = 0.19 l^4.5 (K/t)^1.5` and `b = 0.6 l K^0.5` that is `a b/(a + b)` within a factor
of 1.4, with the side `l` of elements and Gauss's curvature `K`. On cylinders, which have no `K`,
vertices are off by a fortieth to a hundredth of that.
"""

from __future__ import annotations

from collections.abc import Iterator

from mpi4py import MPI

import basix
import numpy as np

from shellmb.arrays import Floats
from shellmb.diagnostics.base import Caution, said_of
from shellmb.model.shells.shell import ShellModel
from shellmb.observers.summary import Sources
from shellmb.scene import Pressure
from shellmb.simulate.simulation import Silent, Simulation

# of the measured law
FACTOR, SIDE, CURVED, MOST = 0.19, 4.5, 1.5, 0.6
BOUND = 0.05
# parts of a side among which one is looked for that is small enough
PARTS = np.geomspace(1e-3, 1.0, 200)


class Bulging(Silent):
    """Watches for triangles of curved shells under pressure.

    Args:
        sources: The observers of the run.
    """

    name = "bulging"

    def __init__(self, sources: Sources) -> None:
        self._found: dict[str, tuple[Floats, float, float]] = {}

    def start(self, simulation: Simulation) -> None:
        """Look at the meshes; collective."""
        scene, shells = simulation.scene, simulation.model.shells
        loaded = {load.body for load in scene.loads if isinstance(load, Pressure)}
        loaded |= {name for item in scene.volumes for name in item.shells or shells}
        for name, body in shells.items():
            triangles = body.mixed.space.mesh.basix_cell() == basix.CellType.triangle
            if triangles and (name in loaded or (None in loaded and len(shells) == 1)):
                self._found[name] = _measured(body)

    def cautions(self, simulation: Simulation) -> Iterator[Caution]:
        """A sentence for each shell whose vertices are off by much."""
        for name, (offs, side, thickness) in self._found.items():
            off = float(offs[-1])
            if off > BOUND:
                enough = side * float(PARTS[offs <= BOUND].max(initial=PARTS[0]))
                yield Caution(
                    self.name,
                    name,
                    off,
                    BOUND,
                    f"{said_of(simulation, name)}: under pressure the displacements of vertices "
                    f"are off by about {100 * off:.0f} % of their mean, because the shell is "
                    f"doubly curved and its triangles have sides of {side:.2g} m at a thickness of "
                    f"{thickness:.2g} m; use quadrilaterals, or sides of at most {enough:.2g} m",
                )


def _measured(body: ShellModel) -> tuple[Floats, float, float]:
    """Errors of vertices relative to the mean displacement, side [m], thickness [m]; collective.

    The errors are those with parts of the side, the whole one last.
    """
    domain, thickness = body.mixed.space.mesh, body.section.sizes.thickness
    local = domain.topology.index_map(2).size_local
    cells = body.mixed.subspaces["u"].dofmap.list[:local, :3]
    x = body.mixed.nodes("u")[cells]
    area = np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1) / 2
    curvature = np.maximum(np.atleast_1d(body.section.curvature)[:local], 0.0)
    side = np.sqrt(2 * area)
    thin = FACTOR * side**SIDE * (curvature / thickness) ** CURVED
    most = MOST * side * np.sqrt(curvature)
    sums = np.array([np.sum(part * area) for part in (thin, most, side, np.ones(local))])
    domain.comm.Allreduce(MPI.IN_PLACE, sums)
    thin, most, side = sums[:3, None] / sums[3]
    small, large = thin * PARTS**SIDE, most * PARTS
    offs = small * large / np.maximum(small + large, np.finfo(float).tiny)
    return offs, float(side[0]), float(thickness)
