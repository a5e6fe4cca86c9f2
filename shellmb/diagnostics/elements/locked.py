"""Runs and natural modes tell of elements that lock where a thin curved body bends."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from shellmb.arrays import Floats
from shellmb.diagnostics.base import RunWarning, said_of
from shellmb.diagnostics.elements.locking import (
    BOUND,
    PRONE,
    Mesh,
    Roughness,
    excess,
    why,
)
from shellmb.diagnostics.elements.sampled import EVERY, Sampled
from shellmb.model.model import Model
from shellmb.observers.account.energy import Scalar, scalar
from shellmb.observers.fields.nodal import state
from shellmb.schemes.linearised import strain_energy
from shellmb.simulate.simulation import Simulation

type Directors = Callable[[str], Floats] | None


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
        meshes = {name: Mesh(body) for name, body in simulation.model.shells.items()}
        self._meshes = {name: mesh for name, mesh in meshes.items() if mesh.distorted}
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


def locked_modes(
    model: Model, modes: Sequence[tuple[int, float, Callable[[str], Floats]]], state: Directors
) -> list[str]:
    """Sentences on bodies in whose modes elements lock; collective.

    Args:
        model: The bodies.
        modes: Number of each elastic mode, its strain energy, and its parts by names of bodies.
        state: Changes of the directors that modes are about, shape (n, 3), by names of bodies;
            None: none.
    """
    said = []
    for name, body in model.shells.items():
        mesh = Mesh(body)
        if not mesh.distorted:
            continue
        d = body.node_directors()[:, 0]
        if mesh.proneness(d if state is None else d + state(name)) < PRONE:
            continue
        roughness, found = Roughness(body), []
        for number, energy, part in modes:
            share = model.comm.allreduce(roughness.energy(part(name))) / energy
            found.append((excess(body, share), share, number))
        if numbers := [number for each, _, number in found if each.value > BOUND]:
            worst, share, most = max(found)
            # squares of frequencies are in proportion to stiffness
            high = worst._replace(value=float(np.sqrt(1 + worst.value)) - 1)
            which = f"the frequency of mode {most} is too high"
            if len(numbers) > 1:
                listed = ", ".join(map(str, numbers))
                which = f"frequencies of modes {listed} are too high, that of {most} most of all"
            stiff = f"shell '{name}' is too stiff in bending; {why(body, share)}"
            said.append(f"{which}, by {high.said}: {stiff}")
    return said
