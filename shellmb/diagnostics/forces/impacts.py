"""Impacts that come and go within a step, by the energies of contacts."""

from __future__ import annotations

from collections.abc import Iterator

from shellmb.diagnostics.base import RunWarning
from shellmb.restart import Restartable

# part of the largest energy of a contact that comes or goes in one step: of an impact that takes
# n steps it is 3/n
SUDDEN = 0.8


class Impacts(Restartable):
    """Largest changes of energies of contacts in a step."""

    remembered = ("_found",)

    def __init__(self) -> None:
        self._energy: dict[str, float] = {}
        # largest energy, largest change in a step, time
        self._found: dict[str, tuple[float, float, float]] = {}

    def begin(self, name: str, energy: float) -> None:
        """Take the energy of a contact that steps begin with, J."""
        self._energy[name] = energy

    def step(self, name: str, energy: float, t: float) -> None:
        """Take the energy of a contact at the end of a step.

        Args:
            name: Name of the contact.
            energy: The energy, J.
            t: The time, s.
        """
        change = abs(energy - self._energy[name])
        self._energy[name] = energy
        largest, most, when = self._found.get(name, (0.0, 0.0, 0.0))
        if change > most:
            most, when = change, t
        self._found[name] = max(largest, energy), most, when

    def cautions(self, watch: str, owner: str, name: str, who: str) -> Iterator[RunWarning]:
        """A sentence if impacts of a contact are too short for the steps.

        Args:
            watch: Name of the watch.
            owner: Name of the body that has the points.
            name: Name of the contact.
            who: Name of it in sentences.
        """
        largest, change, when = self._found.get(name, (0.0, 0.0, 0.0))
        share = change / largest if largest > 0 else 0.0
        if share > SUDDEN:
            says = (
                f"{who}: {share:.0%} of the largest energy of the contact comes or goes in one "
                f"step (at t = {when:.4g} s): impacts are shorter than four steps, and when and "
                "where bodies rebound is coarse; use a smaller step or a smaller stiffness"
            )
            yield RunWarning(watch, owner, share, SUDDEN, says)
