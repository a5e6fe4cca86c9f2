"""Runs tell of elements with which a body moves otherwise than with better ones.

At point forces and along edges that are held, thin curved bodies bend within a layer of the width
`sqrt(R t)`, which wider elements miss; distorted ones lock; bodies that do not stretch have too
many or too few constraints; at free edges twisting moments fall to zero within a third of the
thickness. Signs of this cost little, but do not say by how much a body is off: resultants jump
between elements, sides of triangles bulge, edges twist. Better elements tell.
"""

from __future__ import annotations

from shellmb.arrays import Floats
from shellmb.diagnostics.base import Cautions, Watch, said_of
from shellmb.diagnostics.elements.edges import edges_of, spanning
from shellmb.diagnostics.elements.finer import REMEDY, comparable, known
from shellmb.diagnostics.elements.locking import Roughness
from shellmb.diagnostics.elements.measures import Mesh
from shellmb.diagnostics.elements.sampled import changed, energy_of
from shellmb.model.model import Model
from shellmb.simulate.simulation import Simulation

# share of jumps in the strain energy below which nothing was off by two per cent, and estimates, of
# flat and curved bodies, below which no row of `shellmb verify --case "elements/*"` was
ROUGH, BOUND, CURVED = 0.005, 0.02, 0.0235


class Coarse(Watch):
    """Looks at the end of runs whether shells move as those of better elements."""

    name = "coarse mesh"

    def cautions(self, simulation: Simulation) -> Cautions:
        """A sentence for each body that does not; collective."""
        for name, body in simulation.model.shells.items():
            finer = known(simulation, name) if _doubtful(simulation, name) else None
            if finer is None:
                continue
            off, bound = finer.off[name], CURVED if Mesh(body).curved else BOUND
            if off > bound:
                says = (
                    f"{said_of(simulation, name)} is off by about {100 * off:.0f} % of its largest "
                    f"displacement, {finer.how}: {REMEDY}"
                )
                yield self.caution(name, off, bound, says)


def _doubtful(simulation: Simulation, name: str) -> bool:
    if not comparable(simulation, name):
        return False
    energy = energy_of(simulation, name)()
    return Signs(simulation.model, name).doubtful(*changed(simulation, name), energy)


class Signs:
    """Signs that a shell may be off.

    Args:
        model: All bodies.
        name: Its name.
    """

    def __init__(self, model: Model, name: str) -> None:
        body, self._comm = model.shells[name], model.comm
        self._rough, self._edges, mesh = Roughness(body), edges_of(body, model), Mesh(body)
        tri = mesh.triangles and mesh.curved
        # those of degree 3 twist too far
        self._always = tri or (body.shell.degree > 2 and spanning(body, model))

    def doubtful(self, q: Floats, about: Floats, energy: float) -> bool:
        """Decide whether there are any in a state or mode; collective.

        Args:
            q: Local array of it.
            about: State that it is a small change of.
            energy: Its strain energy, J.
        """
        if energy <= 0 or self._always:
            return energy > 0
        if self._edges is not None and self._edges.share(q, about, energy) > BOUND:
            return True
        return bool(self._comm.allreduce(self._rough.energy(q, about)) > ROUGH * energy)
