"""Energy and momentum: balances that do not close, and a scheme that dissipates much."""

from itertools import pairwise

from shellmb.diagnostics.base import Cautions, RunWarning, Watch, remedies, said_of
from shellmb.observers.account.momentum import KINDS
from shellmb.scene import Hyperelastic, Scene
from shellmb.scene.lookup import said
from shellmb.schemes.base import has_energy_law
from shellmb.simulate.simulation import Simulation

# what a scheme conserves it keeps as well as Newton's method solves, which over 100 000 steps adds
# up to some 1e-9; of what it does not conserve, one per cent is an error that shows in results
CONSERVED, OTHERS = 1e-6, 1e-2

# errors of rotations grow with their square: a drift of ten times the largest has another cause
ROTATION = 10.0


class Drift(Watch):
    """Watches the balances of both momenta."""

    name = "drift"

    def cautions(self, simulation: Simulation) -> Cautions:
        """Decide whether drifts are out of proportion; rotations that may be why are named."""
        turns = self.sources.rotations.turns
        most = max(turns, key=lambda name: turns[name].largest, default=None)
        for kind, which in KINDS.items():
            drift = self.sources.momentum.relative_drift(kind)
            bound = CONSERVED if kind in simulation.scheme.conserves else OTHERS
            if drift is None or drift <= bound:
                continue
            says = (
                f"{which} momentum has an unexplained error of {100 * drift:.2g} % (relative to "
                "the largest momentum or impulse)"
            )
            largest = 0.0 if most is None else turns[most].largest
            fastest = most if ROTATION * largest**2 > drift else None
            if fastest is not None:
                says += (
                    f"; {said_of(simulation, fastest)} turns most, by up to {largest:.2g} rad in a "
                    "step"
                )
            says += f": use {remedies(simulation.scheme, 'a smaller step')}"
            yield RunWarning(f"{which} momentum", fastest, drift, bound, says)


# what is dissipated should be noise: frequencies that the step does not resolve
DISSIPATED = 0.05


class Dissipation(Watch):
    """Watches what the scheme itself dissipates; impacts, dampers and terms are not its doing."""

    name = "dissipation"

    def cautions(self, simulation: Simulation) -> Cautions:
        """Decide whether the dissipation is out of proportion, and in which body."""
        share = self.sources.energy.dissipated_share
        if share <= DISSIPATED:
            return
        dissipated = self.sources.energy.dissipated
        worst = max(dissipated, key=dissipated.__getitem__)
        part = dissipated[worst] / sum(dissipated.values())
        says = (
            f"the scheme dissipates {share:.0%} of the energy that was present or supplied, "
            f"{part:.0%} of it in {said_of(simulation, worst)}: motion that the step does not "
            f"resolve; before you trust the rest, compare with "
            f"{remedies(simulation.scheme, 'a smaller step', 'a smaller alpha')}"
        )
        yield self.caution(worst, share, DISSIPATED, says)


# Newton's method stops at 1e-9 of its unknowns, and the account of a healthy run closes to 1e-10
# and better, over 100 000 steps, too: what is beyond this is a force that is not in the account
CLOSED = 1e-8
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

    def cautions(self, simulation: Simulation) -> Cautions:
        """Decide whether the balance is off."""
        error, scheme = self.sources.energy.relative_error, simulation.scheme
        bound = CLOSED if has_energy_law(scheme) else LAWLESS
        if not scheme.dynamic or not error > bound:
            return
        says = f"the energy balance has an error of {error:.1e} of the energy exchanged, "
        most = f"most of it in the step to t = {self._when():g} s; "
        if has_energy_law(scheme):
            says += (
                f"{self.sources.energy.exchanged:.2g} J, {most}the limit is {CLOSED:.0e}: use a "
                f"smaller step or a smaller Solver(tolerance=...){_suspects(simulation.scene)}"
            )
        else:
            says = (
                f"the scheme has no energy law ({scheme.title}): {says}{most}use a smaller step, "
                "or compare with --scheme ep4 or --scheme ed3"
            )
        yield self.caution(None, error, bound, says)
