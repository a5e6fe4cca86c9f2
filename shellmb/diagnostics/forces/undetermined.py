"""Forces that the equations hardly determine, so that round-off changes them."""

from shellmb.diagnostics.base import Cautions, Watch
from shellmb.simulate.simulation import Simulation

# relative change of an unknown by round-off alone that is said: six digits are enough
KNOWN = 1e-6


class Undetermined(Watch):
    """Watches what round-off alone changes in solutions."""

    name = "round-off"
    remembered = ("_largest",)

    def accepted(self, simulation: Simulation) -> None:
        """Take what changed most in the last update, if that was round-off."""
        what, change = simulation.problem.iteration.roundoff.found
        self._note(self.name, change, simulation.t, what)

    def cautions(self, simulation: Simulation) -> Cautions:
        """A sentence if it is much."""
        worst, when, *what = self._noted(self.name)
        if worst > KNOWN:
            says = (
                f"the {what[0]} is known to {worst:.1e} of its largest value only, at "
                f"t = {when:g}: constraints nearly depend on one another there, and "
                "round-off decides how they share forces; use joints with fewer constraints, or do "
                "not rely on their forces near such positions"
            )
            yield self.caution(None, worst, KNOWN, says)
