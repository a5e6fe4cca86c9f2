"""Runs tell of elements with which a body moves otherwise than with better ones.

At point forces and along edges that are held, thin curved bodies bend within a layer of the width
`sqrt(R t)`, which wider elements miss; distorted ones lock; bodies that do not stretch have too
many or too few constraints; at free edges twisting moments fall to zero within a third of the
thickness. Signs of this cost little, but do not say by how much a body is off: resultants jump
between elements, sides of triangles bulge, edges twist. Better elements tell.
"""

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats
from shellmb.diagnostics.base import Cautions, Sampled, said_of
from shellmb.diagnostics.elements.edges import edges_of, spanning
from shellmb.diagnostics.elements.finer import BOUND, REMEDY, compared, energy_of
from shellmb.diagnostics.elements.locking import Roughness, excess
from shellmb.diagnostics.elements.measures import Mesh
from shellmb.model.model import Model
from shellmb.observers.fields.nodal import state
from shellmb.restart import constant
from shellmb.scene.loads.supports import at_rest
from shellmb.simulate.simulation import Simulation

# share of jumps in the strain energy below which nothing was off by two per cent
ROUGH = 0.0018
# strain of round-off, by displacements of the size of the body
NOISE = 1e-14


class Coarse(Sampled):
    """Looks whether shells move as those of better elements, where they store most energy."""

    name = "coarse mesh"
    runs = True
    remembered = ("_most", "_states")

    def _begin(self) -> None:
        # by shell the largest energy, and the state, which other numbers of ranks do not take up
        self._most: dict[str, float] = {}
        self._states: dict[str, Floats] = {}

    def start(self, simulation: Simulation) -> None:
        """Find the energies; statics end where they are largest."""
        self._energies = {name: energy_of(simulation, name) for name in simulation.model.shells}
        self.idle = not simulation.scheme.dynamic

    def _look(self, simulation: Simulation) -> None:
        for name, energy in self._energies.items():
            if (found := energy()) > (self._most[name] if name in self._states else 0.0):
                self._most[name] = found
                self._states[name] = constant(state(simulation, name).copy())

    def cautions(self, simulation: Simulation) -> Cautions:
        """A sentence for each body that does not; collective."""
        self._look(simulation)
        scene, shells = simulation.scene, simulation.model.shells
        half, doubted = 0.0 if simulation.scheme.linear else 0.5, {}
        for name, q in self._states.items():
            signs = Signs(simulation.model, name)
            if signs.doubtful(q, half * q, self._most[name]):
                doubted[name] = signs
        finer = compared(simulation, self._states) if doubted else None
        for name, signs in doubted.items():
            if finer is not None and name in finer.off:
                off, how = finer.off[name], finer.how
            else:
                q = self._states[name]
                share = signs.rough.energy(q) / self._most[name]
                off, how = excess(shells[name], q, share), "by jumps of resultants"
            if off > BOUND:
                # what moved supports alone deform has its displacements from them
                loaded = scene.loads or scene.volumes or shells[name].shell.natural
                alone = scene.static and not loaded and not all(map(at_rest, scene.supports))
                of_what = "the forces of its supports" if alone else "its largest displacement"
                says = (
                    f"{said_of(simulation, name)} is off by about {100 * off:.0f} % of {of_what}, "
                    f"{how}: {REMEDY}"
                )
                yield self.caution(name, off, BOUND, says)


class Signs:
    """Signs that a shell may be off.

    Args:
        model: All bodies.
        name: Its name.

    Attributes:
        rough: Energy of jumps of its resultants.
    """

    def __init__(self, model: Model, name: str) -> None:
        self._body = body = model.shells[name]
        self.rough, self._edges, mesh = Roughness(body), edges_of(body, model), Mesh(body)
        uneven = mesh.triangles or mesh.distorted
        # single nodes move much by little energy, and elements of degree 3 twist too far
        self._always = (uneven and mesh.curved) or (body.shell.degree > 2 and spanning(body, model))

    def doubtful(self, q: Floats, about: Floats, energy: float) -> bool:
        """Decide whether there are any in a state or mode; collective.

        Args:
            q: Local array of it.
            about: State that it is a small change of.
            energy: Its strain energy, J.
        """
        if energy <= self._round_off(q):
            return False
        if self._always:
            return True
        if self._edges is not None and self._edges.share(q, about, energy) > BOUND:
            return True
        return self.rough.energy(q) > ROUGH * energy

    def _round_off(self, q: Floats) -> float:
        """Strain energy below which a state is a rigid motion and round-off, J; collective."""
        body = self._body
        found = np.array([np.max(np.abs(q[body.mixed.dofs["u"]]), initial=0.0)])
        body.mixed.space.mesh.comm.Allreduce(MPI.IN_PLACE, found, op=MPI.MAX)
        length = body.domain.length
        strain = NOISE * (1 + float(found[0]) / length)
        return float(body.section.sizes.stiffness * (strain * length) ** 2)
