"""Watches that need not look at each step."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import ClassVar, Protocol

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


def in_modes(found: Sequence[tuple[float, int]]) -> tuple[float, str]:
    """Largest of some values by numbers of modes, and these modes in words."""
    most, worst = max(found)
    if len(found) == 1:
        return most, f"mode {worst}"
    listed = ", ".join(str(number) for _, number in found)
    return most, f"modes {listed}, most in mode {worst}"


class Part(Protocol):
    """Something of a body that has an energy."""

    def energy(self, q: Floats, about: Floats | None) -> float:
        """The energy on this rank, J, of a state, or of a small change of one; collective."""
        ...


class Shares(Sampled):
    """Looks at energies as parts of the strain energies of bodies; to inherit from."""

    remembered = ("_steps", "_sums")

    def _begin(self) -> None:
        super()._begin()
        self._parts: Mapping[str, Part] = {}
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
            q = state(simulation, name)
            here = comm.allreduce(part.energy(q, 0 * q if simulation.scheme.linear else None))
            if name not in self._energies:
                body = simulation.model.shells[name]
                form = strain_energy(body, simulation.problem.levels[name])
                energy = scalar([form], comm)
                assert energy is not None
                self._energies[name] = energy
            found, strain = sums.get(name, (0.0, 0.0))
            sums[name] = found + here, strain + self._energies[name]()
        return sums

    def shares(self, simulation: Simulation) -> Iterator[tuple[str, float]]:
        """Parts over the run, by names of bodies; collective."""
        sums = self._added(simulation) if self._steps % EVERY else self._sums
        for name, (part, energy) in sums.items():
            yield name, part / energy if energy > 0 else 0.0
