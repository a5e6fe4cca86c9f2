"""A run tells of elements that lock where a thin curved body bends."""

from __future__ import annotations

from collections.abc import Iterator

from shellmb.diagnostics.base import RunWarning, said_of
from shellmb.diagnostics.elements.locking import (
    BOUND,
    PRONE,
    Mesh,
    Roughness,
    excess,
    places,
    why,
)
from shellmb.diagnostics.elements.sampled import EVERY, Sampled
from shellmb.observers.account.energy import Scalar, scalar
from shellmb.observers.fields.nodal import state
from shellmb.schemes.linearised import strain_energy
from shellmb.simulate.simulation import Simulation


class Locked(Sampled):
    """Watches what elements that lock add to the stiffness of thin curved bodies."""

    name = "locking"
    remembered = ("_steps", "_sums")

    def _begin(self) -> None:
        super()._begin()
        self._meshes: dict[str, Mesh] = {}
        self._found: dict[str, tuple[Roughness, Scalar]] = {}
        # by body the energies of roughness and of all strains over the states that were looked at
        self._sums: dict[str, tuple[float, ...]] = {}

    def start(self, simulation: Simulation) -> None:
        """Find the shells whose meshes are distorted; the others cost nothing more."""
        meshes = {name: places(body) for name, body in simulation.model.shells.items()}
        self._meshes = {name: mesh for name, mesh in meshes.items() if mesh is not None}
        self.idle = not self._meshes

    def _look(self, simulation: Simulation) -> None:
        self._sums = self._added(simulation)

    def _added(self, simulation: Simulation) -> dict[str, tuple[float, ...]]:
        """The sums so far with those of this state; changes nothing; collective."""
        sums = dict(self._sums)
        for name, mesh in self._meshes.items():
            body, q = simulation.model.shells[name], state(simulation, name)
            d = body.node_directors()[:, 0]
            if not simulation.scheme.linear:
                d = d + q[body.mixed.dofs["w"]].reshape(-1, 3)
            if mesh.proneness(d) < PRONE:
                continue
            if name not in self._found:
                form = strain_energy(body, simulation.problem.levels[name])
                energy = scalar([form], simulation.model.comm)
                assert energy is not None
                self._found[name] = Roughness(body), energy
            roughness, energy = self._found[name]
            here = simulation.model.comm.allreduce(roughness.energy(q))
            rough, strain = sums.get(name, (0.0, 0.0))
            sums[name] = rough + here, strain + energy()
        return sums

    def cautions(self, simulation: Simulation) -> Iterator[RunWarning]:
        """A sentence for each body that is too stiff; collective."""
        sums = self._added(simulation) if self._steps % EVERY else self._sums
        for name, (rough, energy) in sums.items():
            share = rough / energy if energy > 0 else 0.0
            body = simulation.model.shells[name]
            found = excess(body, share)
            if found.value > BOUND:
                said = f"{said_of(simulation, name)} is too stiff in bending, by {found.said}"
                says = f"{said}: {why(body, share)}"
                yield self.caution(name, found.value, BOUND, says)
