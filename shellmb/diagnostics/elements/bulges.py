"""Bulges of triangles' sides: by how much single nodes move against their neighbours.

Forces of triangles see the mean of the shear along each side, and no other part of it
(`docs/theory/shells.md`). A middle may move against the ends of its side, by `b (1 - s^2)` for `s`
from -1 to 1, where directors do not follow: only the share of displacements resists. What loads
excite in this shape, as pressure on coarse spheres and tubes does, the nodes have, and shells under
compression buckle into it element by element.

`b` is the first moment of the shear along a side. Rigid motions have none, nor has bending up to
cubic deflections. The section's own shear has some, which is right; it outweighs the bulge of
bending where sides are short, and is left out in this ratio. Beside finer meshes nodes are off by
0.5 to 2 times the estimate from `b` (`tests/diagnostics/test_bulges.py`).
"""

from __future__ import annotations

from collections.abc import Sequence

from mpi4py import MPI

import numpy as np
from basix import CellType, topology

from shellmb.arrays import Floats
from shellmb.diagnostics.base import Cautions, Motion, Parts, said_of
from shellmb.diagnostics.elements.finer import known
from shellmb.diagnostics.elements.sampled import Sampled, changed, in_modes
from shellmb.model.model import Model
from shellmb.model.shells.shell import ShellModel
from shellmb.observers.fields.nodal import Nodes
from shellmb.simulate.simulation import Simulation

# part of `b` that is the estimate: vertices move by two thirds of it, middles by a third
ESTIMATED = 0.8
# part of the largest displacement from which on a run warns
BOUND = 0.02
WHY = (
    "they move against their neighbours in a shape that the forces of triangles do not see; use a "
    "finer mesh or quadrilaterals"
)


class Bulges:
    """Bulges of a shell of triangles.

    Args:
        body: The shell.
    """

    def __init__(self, body: ShellModel) -> None:
        space, self._nodes = body.mixed.subspaces["u"], Nodes(body)
        self._comm = space.mesh.comm
        cells = space.dofmap.list[: space.mesh.topology.index_map(2).size_local]
        ends = topology(CellType.triangle)[1]
        self._sides = np.concatenate([cells[:, [*two, 3 + k]] for k, two in enumerate(ends)])
        X = body.node_positions()
        squares = np.sum((X[self._sides[:, 1]] - X[self._sides[:, 0]]) ** 2, axis=1)
        sizes, shear = body.section.sizes, float(body.section.force.value)
        self._estimated = ESTIMATED / (1 + sizes.stiffness * sizes.thickness**2 / (shear * squares))

    def largest(self, q: Floats, about: Floats) -> tuple[float, float]:
        """Estimate by the largest bulge, and the largest displacement, m; collective.

        Args:
            q: Local array of a change of a state.
            about: State that it is a small change of.
        """
        now, base = self._nodes.values(q), self._nodes.values(about)
        u, w = now.displacement, now.director - now.reference_directors[:, 0]
        moments = 0.0
        for s in np.array([-1, 1]) / np.sqrt(3):
            at, slope = [s * (s - 1) / 2, s * (s + 1) / 2, 1 - s * s], [s - 0.5, s + 0.5, -2 * s]
            # change of (X + u)' . (D + w)
            shear = self._along(slope, u) * self._along(at, base.director)
            shear += self._along(slope, base.position) * self._along(at, w)
            moments = moments - s * shear.sum(axis=1)
        here = [np.abs(0.75 * self._estimated * moments), np.linalg.norm(u, axis=1)]
        found = [self._comm.allreduce(float(x.max(initial=0.0)), op=MPI.MAX) for x in here]
        return found[0], found[1]

    def share(self, q: Floats, about: Floats, energy: float) -> float:
        """Estimate as a part of the largest displacement of a mode, of whatever energy."""
        bulge, moved = self.largest(q, about)
        return bulge / moved if moved > 0 else 0.0

    def _along(self, weights: list[float], values: Floats) -> Floats:
        """Sum over the nodes of each side, shape (sides, 3)."""
        return np.asarray(np.einsum("k,ski->si", weights, values[self._sides]))


def bulges(model: Model) -> dict[str, Bulges]:
    """Bulges of all shells of triangles, by their names."""
    return {
        name: Bulges(body)
        for name, body in model.shells.items()
        if body.mixed.space.mesh.basix_cell() == CellType.triangle
    }


class Bulging(Sampled):
    """Watches how far sides of triangles bulge."""

    name = "bulging"
    remembered = ("_steps", "_largest")

    def start(self, simulation: Simulation) -> None:
        """Find the shells of triangles; the others cost nothing more."""
        self._bodies = bulges(simulation.model)
        self.idle = not self._bodies

    def _look(self, simulation: Simulation) -> None:
        for name, body in self._bodies.items():
            both = zip(self._noted(name), body.largest(*changed(simulation, name)), strict=True)
            # the largest estimate and the largest displacement
            self._largest[name] = tuple(map(max, both))

    def cautions(self, simulation: Simulation) -> Cautions:
        """A sentence for each body whose nodes are off; collective."""
        self._look(simulation)
        for name, (bulge, moved) in self._largest.items():
            if bulge <= BOUND * moved:
                continue
            body = simulation.model.shells[name]
            finer = None if body.shell.distortion else known(simulation, body)
            part = bulge / moved if finer is None else finer.off[name]
            if part > BOUND:
                says = (
                    f"single nodes of {said_of(simulation, name)} are off by about "
                    f"{100 * part:.0f} % of its largest displacement"
                    f"{'' if finer is None else f', {finer.how}'}: {WHY}"
                )
                yield self.caution(name, part, BOUND, says)


def bulging_modes(model: Model, state: Parts | None, modes: Sequence[Motion]) -> list[str]:
    """Sentences on shells in whose modes single nodes are off; as `stiffened_modes`."""
    said = []
    for name, body in bulges(model).items():
        if found := in_modes(name, state, modes, body.share, BOUND):
            most, which = found
            said.append(
                f"single nodes of shell '{name}' are off by up to about {100 * most:.0f} % of the "
                f"amplitude in {which}: {WHY}"
            )
    return said
