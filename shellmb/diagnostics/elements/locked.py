"""A run tells of elements that lock where a thin curved body bends."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from shellmb.diagnostics.base import Caution, said_of
from shellmb.diagnostics.elements.locking import (
    Mesh,
    Roughness,
    excess,
    kind,
    least,
    places,
    why,
)
from shellmb.observers.account.energy import Scalar, scalar
from shellmb.observers.fields.nodal import state
from shellmb.observers.summary import Sources
from shellmb.schemes.linearised import strain_energy
from shellmb.simulate.simulation import Silent, Simulation

# locking does not come and go: it costs next to nothing to look at every tenth step, and at the end
EVERY = 10


class Locked(Silent):
    """Watches what elements that lock add to the stiffness of thin curved bodies.

    Args:
        sources: The observers of the run.
    """

    name = "locking"

    def __init__(self, sources: Sources) -> None:
        self._meshes: dict[str, Mesh] = {}
        self._found: dict[str, tuple[Roughness, Scalar]] = {}
        self._steps = 0
        # by body energies of roughness and of all strains, summed over what was looked at, and the
        # largest proneness
        self._sums: dict[str, tuple[float, float, float]] = {}

    def start(self, simulation: Simulation) -> None:
        """Find the shells whose meshes are distorted; the others cost nothing more."""
        for name, body in simulation.model.shells.items():
            mesh = places(body)
            if mesh is not None:
                self._meshes[name] = mesh
        self.idle = not self._meshes

    def accepted(self, simulation: Simulation) -> None:
        """Look at every tenth step."""
        self._steps += 1
        if self._steps % EVERY == 0:
            self._look(simulation)

    def _look(self, simulation: Simulation) -> None:
        for name, mesh in self._meshes.items():
            body, q = simulation.model.shells[name], state(simulation, name)
            d = body.node_directors()[:, 0]
            if not simulation.scheme.linear:
                d = d + q[body.mixed.dofs["w"]].reshape(-1, 3)
            prone = mesh.proneness(d)
            if prone < least(body):
                continue
            if name not in self._found:
                form = strain_energy(body, simulation.problem.levels[name])
                energy = scalar([form], simulation.model.comm)
                assert energy is not None
                self._found[name] = Roughness(body), energy
            roughness, energy = self._found[name]
            here = simulation.model.comm.allreduce(roughness.energy(q))
            rough, strain, most = self._sums.get(name, (0.0, 0.0, 0.0))
            self._sums[name] = rough + here, strain + energy(), max(most, prone)

    def cautions(self, simulation: Simulation) -> Iterator[Caution]:
        """A sentence for each body that is too stiff; collective."""
        if self._steps % EVERY:
            self._look(simulation)
        for name, (rough, energy, prone) in self._sums.items():
            share = rough / energy if energy > 0 else 0.0
            body = simulation.model.shells[name]
            found = excess(body, share, prone)
            if found.value > (bound := kind(body).bound):
                said = f"{said_of(simulation, name)} is too stiff in bending, by {found.said}"
                yield Caution(self.name, name, found.value, bound, f"{said}: {why(body, share)}")

    def state(self) -> dict[str, Any]:
        """The sums so far."""
        return {"steps": self._steps, "sums": {n: list(s) for n, s in self._sums.items()}}

    def restore(self, state: dict[str, Any]) -> None:
        """Take them up."""
        self._steps = state["steps"]
        self._sums = {n: (s[0], s[1], s[2]) for n, s in state["sums"].items()}
