"""Static paths that end before their load, limit points on them, and unstable equilibria.

Newton's method finds equilibria whether or not anything would stay in them: a straight column under
twice its critical load stays straight. Unstable directions are counted (`simulate.eigenmodes`): at
the end of each static run, and of small systems in between, at no more than `LOOKS` states.
"""

import math

import numpy as np

from shellmb.diagnostics.base import Cautions, Watch
from shellmb.scene import Wrinkling
from shellmb.simulate.eigenmodes import Stability, StabilityState
from shellmb.simulate.paths.arclength import FARTHEST, ArcSize
from shellmb.simulate.simulation import Simulation


class PathEnd(Watch):
    """Looks at the end of a path whether it came to its `load_end`.

    Time is an arc length that grows like the load factor at the start. Slender bodies move far more
    for the same load behind a bifurcation: what is long for the unloaded body is nothing there.
    """

    name = "path end"

    def cautions(self, simulation: Simulation) -> Cautions:
        """A sentence if the load factor is another one at the end of the longest path."""
        path, scene, size = simulation.path, simulation.scene.path, simulation.size
        if path is None or scene is None or scene.load_end is None or path.finished:
            return
        if simulation.t < simulation.t_end or not isinstance(size, ArcSize):
            return
        whole = size.farthest / FARTHEST
        says = (
            f"the path ends at its longest arc length, t_end = {simulation.t_end:g}, at the load "
            f"factor {path.factor:.6g}: load_end = {scene.load_end:g} is not reached; use a larger "
            f"t_end, of the order of {whole:.1g}, in which bodies move by the size of the scene"
        )
        yield self.caution(None, path.factor, scene.load_end, says)


class LimitPoints(Watch):
    """Looks whether all limit points of a path were located.

    Newton's method finds them where forces are smooth; contact that opens there has a corner.
    """

    name = "limit points"

    def cautions(self, simulation: Simulation) -> Cautions:
        """A sentence for the first one that was not."""
        path = simulation.path
        if path is None or not path.unsure:
            return
        says = (
            f"the limit point near the load factor {path.unsure[0]:.6g} was not located "
            f"({len(path.unsure)} in all): its load is that of a cubic between two states, which "
            "may be off by some per mille or more; use smaller steps (max_dt)"
        )
        yield self.caution(None, float(len(path.unsure)), 0.0, says)


# unknowns up to which a count takes about as long as a step of a few iterations; and counts of a
# run, which add up to less than what its start takes
CHEAP, LOOKS = 2000, 20

REMEDIES = (
    "follow where it goes with path=PathFollowing(branches='switch'), a small imperfection, or a "
    "dynamic scheme; `shellmb modes --loaded` shows the directions"
)
# where there are neither paths nor modes of states
TOUCHING = (
    "follow where it goes with a small imperfection or a dynamic scheme. A node that faces a node "
    "or an end of a shell can slide off it by less than an element: with another number of "
    "elements the number of directions is another one then"
)

ODD = "an odd number of directions (loads follow the bodies: flutter is not seen here)"
WRINKLING = (
    "where a wrinkling section keeps compression, these may be its wrinkles, which are in its "
    "energy already; `shellmb modes --loaded` shows the directions"
)


class Unstable(Watch):
    """Counts unstable directions of the states of static runs."""

    name = "stability"
    remembered = ("_first", "_most", "_last")

    def _begin(self) -> None:
        self._stability: Stability | None = None
        self._first: tuple[float, float] | None = None
        self._most, self._last = 0, 0.0

    def start(self, simulation: Simulation) -> None:
        """Paths count by themselves; of linear statics there is nothing to count."""
        scheme = simulation.scheme
        self._remedies = TOUCHING if simulation.model.faces else REMEDIES
        if any(isinstance(shell.section, Wrinkling) for shell in simulation.scene.shells):
            self._remedies = WRINKLING
        if not scheme.dynamic and not scheme.linear and simulation.path is None:
            self._stability = Stability(simulation.model, simulation.problem.system)

    def accepted(self, simulation: Simulation) -> None:
        """Look at the state where that is cheap."""
        if self._stability is None or simulation.problem.system.size > CHEAP:
            return
        every = math.ceil(simulation.t_end / (simulation.size.nominal * LOOKS))
        if simulation.step % every == 0:
            self._take(simulation.t, self._stability.look())

    def _take(self, t: float, found: StabilityState) -> None:
        if found.unstable:
            self._most = max(self._most, found.unstable)
            self._first = self._first or (self._last, t)
        self._last = t

    def cautions(self, simulation: Simulation) -> Cautions:
        """A sentence about the end, or about what was passed."""
        path = simulation.scene.path if simulation.path is not None else None
        counts = path is not None and path.branches != "ignore"
        unknown = np.isnan(self.columns("unstable")[0, 1:]).sum() if counts else 0
        if unknown:
            says = (
                f"of {unknown} of {simulation.step} states of the path it is not known "
                "whether they are stable, and bifurcations between them are not found: their "
                "stiffness matrix is not symmetric (loads that follow the bodies) or singular"
            )
            yield self.caution(None, float(unknown), 0.0, says)
        if self._stability is None or not simulation.step:
            return
        now, t = self._stability.look(), simulation.t
        before = self._last
        self._take(t, now)
        self._last = before
        factor = f"t = {t:g} (load factor {simulation.problem.start_factor(t, None):g})"
        count = now.unstable or 0
        if count:
            where = f"{count} direction{'' if count == 1 else 's'}"
            if not now.symmetric:
                # the sign of a determinant
                where = ODD
            if self._first is not None and self._first[1] < t:
                where += f", as those from t = {self._first[1]:g} on"
            says = (
                f"the equilibrium at the end, {factor}, is unstable in {where}: the structure does "
                f"not stay in it; {self._remedies}"
            )
            yield self.caution(None, float(count), 0.0, says)
        elif self._first is not None:
            says = (
                f"intermediate equilibria were unstable in up to {self._most} direction(s), first "
                f"at t = {self._first[1]:g}; the structure need not reach the one at the end, "
                f"{factor}: {self._remedies}"
            )
            yield self.caution(None, float(self._most), 0.0, says)
