"""Obstacles that come between the nodes or points of a body, which alone touch them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from shellmb.arrays import Ints
from shellmb.diagnostics.base import RunWarning, Watch
from shellmb.diagnostics.forces.outlines import Outline
from shellmb.model.potentials.contact import ContactGroup
from shellmb.scene.lookup import said
from shellmb.simulate.simulation import Simulation

# depth that nodes miss, part of the radius of a ball or rod, or of half the thickness of a box: of
# a ball that lies between two nodes it is an eighth of the square of their distance in radii
MISSED = 0.1


class Between(Watch):
    """Watches what is between nodes, or points of rigid bodies, against obstacles they touch."""

    name = "between nodes"
    remembered = ("_missed",)

    def _begin(self) -> None:
        # part of the radius, time
        self._missed: dict[str, tuple[float, float]] = {}

    def start(self, simulation: Simulation) -> None:
        """Find what is between nodes and points, and what is missed at the start."""
        self._lines: list[_Nodes | Outline] = []
        rigid = {body.name for body in simulation.model.scene.rigid_bodies}
        for group in simulation.model.potentials:
            if isinstance(group, ContactGroup) and np.isfinite(group.shape.depth):
                segments = group.points.segments()
                if len(segments):
                    self._lines.append(_Nodes(group, segments))
                elif group.owner in rigid:
                    self._lines.append(Outline(simulation, group))
        self.idle = not self._lines
        self.accepted(simulation)

    def accepted(self, simulation: Simulation) -> None:
        """Take the step."""
        for lines in self._lines:
            name = lines.group.item.name
            before = self._missed.get(name, (0.0, 0.0))
            self._missed[name] = max(before, (lines.missed(simulation), simulation.t))

    def cautions(self, simulation: Simulation) -> Iterator[RunWarning]:
        """The contacts whose obstacles come between nodes."""
        for lines in self._lines:
            group = lines.group
            item = group.item
            missed, when = self._missed[item.name]
            if missed <= MISSED:
                continue
            says = (
                f"{said(item)}: between its {lines.what} '{group.owner}' is deeper in the "
                f"{group.shape.label} than at them, by {missed:.0%} of its "
                f"{group.shape.extent} (at t = {when:.4g} s): only {lines.what} touch, so the "
                f"{group.shape.label} passes between them; {lines.advice}"
            )
            yield self.caution(group.owner, missed, MISSED, says)


@dataclass(frozen=True)
class _Nodes:
    """Lines between neighbouring nodes.

    Args:
        group: The contact.
        segments: Pairs of neighbours, shape (m, 2).
    """

    group: ContactGroup
    segments: Ints

    what = "nodes"
    advice = "use smaller elements there"

    def missed(self, simulation: Simulation) -> float:
        """By how much lines are deeper than the nodes, part of the obstacle's depth; collective."""
        group, segments = self.group, self.segments
        q = simulation.problem.levels[group.name].q.x.array
        x = group.everywhere(group.seen_positions(q))
        depth = group.penetrations(x)[segments].max(axis=1)
        a, b = x[segments[:, 0]], x[segments[:, 1]]
        near = depth > -np.linalg.norm(b - a, axis=1)
        if not near.any():
            return 0.0
        between = group.penetrations(group.shape.nearest(a[near], b[near]))
        missed = np.max(between - np.maximum(depth[near], 0.0), initial=0.0)
        return float(missed) / group.shape.depth
