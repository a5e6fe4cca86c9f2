"""The energy balance does not close."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from shellmb.diagnostics.base import RunWarning, Watch
from shellmb.scene import Hyperelastic, Scene
from shellmb.scene.lookup import said
from shellmb.schemes.base import has_energy_law
from shellmb.simulate.simulation import Simulation

# Newton's method stops at 1e-9 of its unknowns, and the account of a healthy run closes to 1e-10
# and better, over 100 000 steps, too: what is beyond this is a force that is not in the account
BOUND = 1e-8
# of schemes without an energy law: an error that shows in results
LAWLESS = 1e-2


def _suspects(scene: Scene) -> str:
    """List what a scene has of its own that may work unbooked, as the end of a sentence."""
    found = [
        *(f"terms of {said(b)}" for b in scene.meshed if b.terms),
        *(f"strains of {said(b)}" for b in scene.shells if b.strains is not None),
        *(f"the energy of {said(b)}" for b in scene.shells if isinstance(b.section, Hyperelastic)),
        *([] if isinstance(scene.scheme, str) else [f"the scheme '{scene.scheme_name}'"]),
    ]
    return f", and look at {' and '.join(found)}" if found else ""


class EnergyLaw(Watch):
    """Watches whether "energy change = work - dissipation" holds, and where it breaks."""

    name = "energy law"

    def _when(self) -> float:
        """Time at the end of the step that adds most to the violation, s."""
        rows = self.sources.history.rows
        steps = [abs(b["energy_balance"] - a["energy_balance"]) for a, b in pairwise(rows)]
        return rows[1 + max(range(len(steps)), key=steps.__getitem__)]["t"]

    def cautions(self, simulation: Simulation) -> Iterator[RunWarning]:
        """Decide whether the balance is off."""
        error = self.sources.energy.relative_error
        if not simulation.scheme.dynamic:
            return
        if not has_energy_law(simulation.scheme):
            if error > LAWLESS:
                says = (
                    f"the scheme has no energy law ({simulation.scheme.title}): the energy "
                    f"balance has an error of {error:.1e} of the energy exchanged, most of it in "
                    f"the step to t = {self._when():g} s; use a smaller step, or compare with "
                    "--scheme ep4 or --scheme ed3"
                )
                yield self.caution(None, error, LAWLESS, says)
        elif error > BOUND:
            says = (
                f"the energy balance has an error of {error:.1e} of the energy exchanged, "
                f"{self.sources.energy.exchanged:.2g} J, most of it in the step to "
                f"t = {self._when():g} s; the limit is {BOUND:.0e}: use a smaller step or a "
                f"smaller Solver(tolerance=...){_suspects(simulation.scene)}"
            )
            yield self.caution(None, error, BOUND, says)
