"""Static paths that end before their load, and limit points on them that were not located."""

from __future__ import annotations

from shellmb.diagnostics.base import Cautions, Watch
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
