"""Runs tell of meshes that are too coarse for thin curved bodies.

At point forces and along edges that are held, thin curved bodies bend within a layer of the width
`sqrt(R t)`, which wider elements miss. A mesh thus has the measure `p = kappa h^2/t`, the normal of
an element turning by `kappa h`. Resultants that jump between elements show that a load needs the
layers, but not by how much the body is off; in statics a finer mesh tells.
"""

from __future__ import annotations

from shellmb.diagnostics.base import Cautions, Watch, said_of
from shellmb.diagnostics.elements.bulges import Bulges
from shellmb.diagnostics.elements.finer import comparable, known
from shellmb.diagnostics.elements.locking import Mesh, Roughness
from shellmb.diagnostics.elements.sampled import changed, energy_of
from shellmb.simulate.simulation import Simulation

# `p`, and the share of jumps in the strain energy, below which nothing was off by two per cent
PRONE, ROUGH, BOUND = 0.3, 0.005, 0.02


class Coarse(Watch):
    """Looks at the end of static runs whether thin curved bodies move as on a finer mesh."""

    name = "coarse mesh"

    def cautions(self, simulation: Simulation) -> Cautions:
        """A sentence for each body that does not; collective."""
        shells = simulation.model.shells if simulation.scene.static else {}
        for name, body in shells.items():
            finer = known(simulation, body) if _doubtful(simulation, name) else None
            if finer is not None and (off := finer.off[name]) > BOUND:
                says = (
                    f"{said_of(simulation, name)} is off by about {100 * off:.0f} % of its largest "
                    f"displacement, {finer.how}: its elements are wider than the layers in which "
                    "thin curved bodies bend at forces and edges; use a finer mesh there"
                )
                yield self.caution(name, off, BOUND, says)


def _doubtful(simulation: Simulation, name: str) -> bool:
    """Decide whether resultants jump between elements of a thin curved body; collective.

    There is another watch of those whose single nodes move.
    """
    body, comm = simulation.model.shells[name], simulation.model.comm
    if body.shell.distortion or not comparable(body):
        return False
    mesh = Mesh(body)
    if mesh.curved(body.node_directors()[:, 0]) < PRONE:
        return False
    if mesh.triangles:
        bulge, moved = Bulges(body).largest(*changed(simulation, name))
        if bulge > BOUND * moved:
            return False
    rough = comm.allreduce(Roughness(body).energy(*changed(simulation, name)))
    return bool(rough > ROUGH * energy_of(simulation, name)())
