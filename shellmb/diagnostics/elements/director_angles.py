"""Directors of neighbouring nodes turn apart by more than an element can tell.

Directors are interpolated, and what is between two that are far apart is short. An element of
degree 2 that is bent by 60, 90, 123 degrees resists further bending by 1.4 and 7 per cent too
little, and not at all; from there on it folds by itself, and neighbours may stay in opposite
directions, with next to no energy, although the energy balance closes. With degree 3 it is too
stiff by 0.2, 0.9 and 3.3 per cent at 60, 90 and 135 degrees, and nothing is left at 247. So the
bound is 45 degrees between neighbours, which are two or three to an element. What counts is what
they turn apart by since the reference: a curve or a fold at rest is a matter of the mesh.
"""

import math

import numpy as np

from shellmb.arrays import Floats
from shellmb.diagnostics.base import Cautions, Sampled, said_of
from shellmb.model.frames.beam import BeamModel
from shellmb.model.shells.shell import ShellModel
from shellmb.observers.fields.nodal import Nodes, state
from shellmb.simulate.simulation import Simulation

BOUND = math.pi / 4
# elements fold by themselves beyond this, and a load step may jump there
JUMPED = math.radians(80)


class _Neighbours:
    """Pairs of nodes that are next to one another in an element.

    Args:
        body: A shell or a beam; its cells of this rank count.
    """

    def __init__(self, body: ShellModel | BeamModel) -> None:
        self._nodes = Nodes(body)
        space = body.mixed.subspaces["u"]
        points = np.asarray(space.element.interpolation_points)
        # number of each point along each axis of the cell
        places = np.stack([np.unique(np.round(x, 9), return_inverse=True)[1] for x in points.T], 1)
        apart = places[:, None] - places[None]
        if space.mesh.topology.cell_name() == "triangle":
            near = np.max(np.abs([*apart.T, apart.sum(axis=-1).T]), axis=0) == 1
        else:
            near = np.abs(apart).sum(axis=-1) == 1
        first, second = np.nonzero(np.triu(near))
        local = space.mesh.topology.index_map(space.mesh.topology.dim).size_local
        cells = space.dofmap.list[:local]
        pairs = np.stack([cells[:, first].ravel(), cells[:, second].ravel()], axis=1)
        self._pairs = np.unique(np.sort(pairs, axis=1), axis=0)

    def largest(self, q: Floats) -> tuple[float, tuple[float, ...]]:
        """Largest angle by which two have turned apart, rad, and where, m; 0 without any.

        Args:
            q: Local array of a state.
        """
        if not len(self._pairs):
            return 0.0, ()
        values = self._nodes.values(q)
        first, second = self._pairs.T
        D, d = values.reference_directors, values.directors
        if D.shape[1] == 3:
            Q = np.einsum("nki,nkj->nij", d, D)
            cosine = (np.einsum("nij,nij->n", Q[first], Q[second]) - 1) / 2
            angle = np.arccos(np.clip(cosine, -1, 1))
        else:
            now, rest = (
                np.arccos(np.clip(np.einsum("nki,nki->n", v[first], v[second]), -1, 1))
                for v in (d, D)
            )
            angle = np.abs(now - rest)
        worst = int(np.argmax(angle))
        place = values.reference[self._pairs[worst]].mean(axis=0)
        return float(angle[worst]), tuple(map(float, place))


class Folded(Sampled):
    """Watches by how much neighbouring directors of shells and beams have turned apart."""

    name = "folded"
    remembered = ("_largest",)

    def start(self, simulation: Simulation) -> None:
        """Find the neighbours; where displacements are small there is another watch."""
        looked = {} if simulation.scheme.linear else simulation.model.meshed
        self._bodies = {name: _Neighbours(body) for name, body in looked.items()}
        self.idle = not self._bodies

    def _look(self, simulation: Simulation) -> None:
        for name, neighbours in self._bodies.items():
            angle, place = neighbours.largest(state(simulation, name))
            self._note(name, angle, simulation.t, *place)

    def cautions(self, simulation: Simulation) -> Cautions:
        """A sentence for each body that is bent too far for its elements; collective."""
        self._look(simulation)
        for name in self._bodies:
            angle, when, *place = self._worst(simulation, name)
            if angle > BOUND:
                jumped = simulation.scene.static and angle > JUMPED
                smaller = ", or smaller load steps (dt), which do not jump there" if jumped else ""
                says = (
                    f"{said_of(simulation, name)} turns by {math.degrees(angle):.0f} degrees "
                    "between neighbouring nodes of an element, near "
                    f"({', '.join(f'{x:.3g}' for x in place)}) at t = {when:g}; from "
                    f"{math.degrees(BOUND):.0f} degrees on the stiffness of an element is "
                    "off by several per cent, and beyond 60 (degree 2) or 80 (degree 3) it folds: "
                    f"use a finer mesh there{smaller}"
                )
                yield self.caution(name, angle, BOUND, says)
