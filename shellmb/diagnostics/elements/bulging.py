"""Vertices of triangles that bulge where a thin, doubly curved shell carries a pressure.

A pressure exerts next to nothing on the vertices of curved triangles of degree 2, and membrane
forces next to nothing but what the kinks between elements leave. Bending alone takes the
difference. Of the mean displacement of a sphere the vertices were off by at most 0.058, 0.18, 0.64,
6.5 (4x4 cells to an octant, t/R = 0.1, 0.05, 0.02, 0.005), 0.029, 0.23, 0.41 (8x8, 0.02, 0.005,
0.0025), 0.046, 0.093 (12x12, 0.005, 0.0025): `0.19 l^4.5 (K/t)^1.5` within a factor of 1.7, with
the side `l` of elements and Gauss's curvature `K`. The strain energy was off by 6 % in the worst.
On cylinders, which have no `K`, vertices are off by a fortieth to a hundredth of that.
"""

from __future__ import annotations

from collections.abc import Iterator

from mpi4py import MPI

import basix
import numpy as np

from shellmb.diagnostics.base import Caution, said_of
from shellmb.model.shells.shell import ShellModel
from shellmb.observers.summary import Sources
from shellmb.scene import Pressure
from shellmb.simulate.simulation import Silent, Simulation

# of the measured law
FACTOR, SIDE, CURVED = 0.19, 4.5, 1.5
BOUND = 0.05
# cosine of an angle between directors of an element that is that of a fold, not of a curve
FOLD = 0.5


class Bulging(Silent):
    """Watches for triangles of curved shells under pressure.

    Args:
        sources: The observers of the run.
    """

    name = "bulging"

    def __init__(self, sources: Sources) -> None:
        self._found: dict[str, tuple[float, float, float]] = {}

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
        for name, (off, side, thickness) in self._found.items():
            if off > BOUND:
                enough = side * (BOUND / off) ** (1 / SIDE)
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


def _measured(body: ShellModel) -> tuple[float, float, float]:
    """Error of vertices relative to the mean displacement, side [m], thickness [m]; collective."""
    domain, nodes = body.mixed.space.mesh, body.mixed.subspaces["u"]
    cells = nodes.dofmap.list[: domain.topology.index_map(2).size_local, :3]
    x, d = body.mixed.nodes("u")[cells], body.node_directors()[cells, 0]
    normals = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    area = np.linalg.norm(normals, axis=1) / 2
    turned = np.einsum("ci,ci->c", np.cross(d[:, 1] - d[:, 0], d[:, 2] - d[:, 0]), d.mean(1)) / 2
    smooth = np.einsum("cai,cbi->cab", d, d).min(axis=(1, 2)) > FOLD
    # a mirrored cell has both the other way round
    outwards = np.einsum("ci,ci->c", normals, d.mean(1))
    curvature = np.where(smooth, np.maximum(turned * np.sign(outwards), 0) / area, 0.0)
    thickness = body.section.sizes.thickness
    off = FACTOR * (2 * area) ** (SIDE / 2) * (curvature / thickness) ** CURVED
    sums = np.array([np.sum(off * area), np.sum(np.sqrt(2 * area) * area), np.sum(area)])
    domain.comm.Allreduce(MPI.IN_PLACE, sums)
    return float(sums[0] / sums[2]), float(sums[1] / sums[2]), float(thickness)
