"""A run tells of elements that lock where a thin curved body bends."""

from __future__ import annotations

from collections.abc import Iterator

from shellmb.diagnostics.base import RunWarning, said_of
from shellmb.diagnostics.elements.element_sums import Summed
from shellmb.diagnostics.elements.locking import (
    BOUND,
    PRONE,
    Mesh,
    Roughness,
    excess,
    places,
    why,
)
from shellmb.observers.account.energy import Scalar, scalar
from shellmb.observers.fields.nodal import state
from shellmb.observers.summary import Sources
from shellmb.schemes.linearised import strain_energy
from shellmb.simulate.simulation import Simulation


class Locked(Summed):
    """Watches what elements that lock add to the stiffness of thin curved bodies.

    Args:
        sources: The observers of the run.
    """

    name = "locking"

    def __init__(self, sources: Sources) -> None:
        super().__init__(sources)
        self._meshes: dict[str, Mesh] = {}
        self._found: dict[str, tuple[Roughness, Scalar]] = {}

    def start(self, simulation: Simulation) -> None:
        """Find the shells whose meshes are distorted; the others cost nothing more."""
        for name, body in simulation.model.shells.items():
            mesh = places(body)
            if mesh is not None:
                self._meshes[name] = mesh
        self.idle = not self._meshes

    def _added(self, simulation: Simulation) -> dict[str, tuple[float, ...]]:
        """Energies of roughness and of all strains; collective."""
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
        for name, (rough, energy) in self._all(simulation).items():
            share = rough / energy if energy > 0 else 0.0
            body = simulation.model.shells[name]
            found = excess(body, share)
            if found.value > BOUND:
                said = f"{said_of(simulation, name)} is too stiff in bending, by {found.said}"
                yield RunWarning(self.name, name, found.value, BOUND, f"{said}: {why(body, share)}")
