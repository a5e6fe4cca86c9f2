"""A static path that ends by its length, before the load that it was to reach."""

from __future__ import annotations

from collections.abc import Iterator

from shellmb.diagnostics.base import RunWarning
from shellmb.observers.summary import Sources
from shellmb.simulate.paths.arclength import FARTHEST, ArcSize
from shellmb.simulate.simulation import BaseObserver, Simulation


class PathEnd(BaseObserver):
    """Looks at the end of a path whether it came to its `load_end`.

    Time is an arc length that grows like the load factor at the start. Slender bodies move far more
    for the same load behind a bifurcation: what is long for the unloaded body is nothing there.

    Args:
        sources: The observers of the run.
    """

    name = "path end"

    def __init__(self, sources: Sources) -> None:
        pass

    def cautions(self, simulation: Simulation) -> Iterator[RunWarning]:
        """A sentence if the load factor is another one at the end of the longest path."""
        path, scene, size = simulation.path, simulation.scene.path, simulation.size
        if path is None or scene is None or scene.load_end is None or path.finished:
            return
        if simulation.t < simulation.t_end or not isinstance(size, ArcSize):
            return
        whole = size.farthest / FARTHEST
        yield RunWarning(
            self.name,
            None,
            path.factor,
            scene.load_end,
            f"the path ends at its longest arc length, t_end = {simulation.t_end:g}, at the load "
            f"factor {path.factor:.6g}: load_end = {scene.load_end:g} is not reached; use a larger "
            f"t_end, of the order of {whole:.1g}, in which bodies move by the size of the scene",
        )
