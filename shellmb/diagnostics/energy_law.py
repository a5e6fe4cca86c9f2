"""The energy account does not close."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from shellmb.diagnostics.base import Caution
from shellmb.observers.summary import Sources
from shellmb.scene import Hyperelastic, Scene
from shellmb.scene.lookup import said
from shellmb.schemes.base import has_energy_law
from shellmb.simulate.simulation import Silent, Simulation

# Newton's method stops at 1e-9 of its unknowns, and the account of a healthy run closes to 1e-10
# and better, over 100 000 steps, too: what is beyond this is a force that is not in the account
BOUND = 1e-8
# of schemes without an energy law: an error that shows in results
LAWLESS = 1e-2


def _suspects(scene: Scene) -> str:
    """What a scene has of its own that may work without being booked, as the end of a sentence."""
    found = [
        *(f"terms of {said(b)}" for b in scene.meshed if b.terms),
        *(f"strains of {said(b)}" for b in scene.shells if b.strains is not None),
        *(f"the energy of {said(b)}" for b in scene.shells if isinstance(b.section, Hyperelastic)),
        *([] if isinstance(scene.scheme, str) else [f"the scheme '{scene.scheme_name}'"]),
    ]
    return f", and look at {' and '.join(found)}" if found else ""


class EnergyLaw(Silent):
    """Watches whether "energy change = work - dissipation" holds, and where it breaks.

    Args:
        sources: The observers of the run.
    """

    name = "energy law"

    def __init__(self, sources: Sources) -> None:
        self._account = sources.energy
        self._before, self._worst, self._t = 0.0, 0.0, 0.0

    def accepted(self, simulation: Simulation) -> None:
        """See what the step adds to the violation."""
        now = self._account.values["energy_balance"]
        if abs(now - self._before) > self._worst:
            self._worst, self._t = abs(now - self._before), simulation.t
        self._before = now

    def cautions(self, simulation: Simulation) -> Iterator[Caution]:
        """Whether the account is off."""
        error = self._account.relative_error
        if not simulation.scheme.dynamic:
            return
        if not has_energy_law(simulation.scheme):
            if error > LAWLESS:
                yield Caution(
                    self.name,
                    None,
                    error,
                    LAWLESS,
                    f"the scheme has no energy law ({simulation.scheme.title}): the account is "
                    f"open by {error:.1e} of the energy that was exchanged, most of it in the "
                    f"step to t = {self._t:g} s; use a smaller step, or compare with --scheme "
                    "ep4 or --scheme ed3",
                )
        elif error > BOUND:
            yield Caution(
                self.name,
                None,
                error,
                BOUND,
                f"the energy account is off by {error:.1e} of the energy that was exchanged, "
                f"{self._account.exchanged:.2g} J, most of it in the step to t = {self._t:g} s; "
                f"it must close to {BOUND:.0e}: use a smaller step or a smaller "
                f"Solver(tolerance=...){_suspects(simulation.scene)}",
            )

    def state(self) -> dict[str, Any]:
        """The worst step so far."""
        return {"before": self._before, "worst": self._worst, "t": self._t}

    def restore(self, state: dict[str, Any]) -> None:
        """Take it up."""
        self._before, self._worst, self._t = state["before"], state["worst"], state["t"]
