"""Watches that need not look at each step."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import ClassVar

from shellmb.arrays import Floats
from shellmb.diagnostics.base import Watch
from shellmb.observers.account.energy import Scalar, scalar
from shellmb.observers.fields.nodal import state
from shellmb.schemes.linearised import strain_energy
from shellmb.simulate.simulation import Simulation

# what elements do does not come and go: it costs next to nothing to look at every tenth step
EVERY = 10


class Sampled(Watch):
    """Looks at every tenth step; to inherit from."""

    remembered: ClassVar[tuple[str, ...]] = ("_steps",)

    def _begin(self) -> None:
        self._steps = 0

    def _look(self, simulation: Simulation) -> None:
        """Take a state; collective."""
        raise NotImplementedError

    def accepted(self, simulation: Simulation) -> None:
        """Look at every tenth step."""
        self._steps += 1
        if self._steps % EVERY == 0:
            self._look(simulation)


def changed(simulation: Simulation, name: str) -> tuple[Floats, Floats]:
    """Local array of a body's state, and of the state that this is a small change of.

    What is bilinear in positions and directors changes over a state as it does about half of it.
    """
    q = state(simulation, name)
    return q, (0.0 if simulation.scheme.linear else 0.5) * q


# the energy on this rank, J, of a small change of a state, both as local arrays; collective
type Part = Callable[[Floats, Floats], float]


def energy_of(simulation: Simulation, name: str) -> Scalar:
    """Gives the strain energy of a shell, J; collective."""
    form = strain_energy(simulation.model.shells[name], simulation.problem.levels[name])
    energy = scalar([form], simulation.model.comm)
    assert energy is not None
    return energy


class Shares(Sampled):
    """Looks at energies as parts of the strain energies of bodies; to inherit from."""

    remembered = ("_steps", "_sums")
    # by names of bodies, from the start on
    _parts: Mapping[str, Part]

    def _begin(self) -> None:
        super()._begin()
        self._energies: dict[str, Scalar] = {}
        # by body the energies of the part and of all strains over the states that were looked at
        self._sums: dict[str, tuple[float, ...]] = {}

    def _here(self, simulation: Simulation) -> Mapping[str, Part]:
        """Parts that count in this state; collective."""
        return self._parts

    def _look(self, simulation: Simulation) -> None:
        self._sums = self._added(simulation)

    def _added(self, simulation: Simulation) -> dict[str, tuple[float, ...]]:
        """The sums so far with those of this state; changes nothing; collective."""
        sums, comm = dict(self._sums), simulation.model.comm
        for name, part in self._here(simulation).items():
            here = comm.allreduce(part(*changed(simulation, name)))
            if name not in self._energies:
                self._energies[name] = energy_of(simulation, name)
            found, strain = sums.get(name, (0.0, 0.0))
            sums[name] = found + here, strain + self._energies[name]()
        return sums

    def shares(self, simulation: Simulation) -> Iterator[tuple[str, float]]:
        """Parts over the run, by names of bodies; collective."""
        sums = self._added(simulation) if self._steps % EVERY else self._sums
        for name, (part, energy) in sums.items():
            yield name, part / energy if energy > 0 else 0.0
