"""Obstacles that come between the nodes of a body, which alone touch them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.diagnostics.base import Caution
from shellmb.model.potentials.contact import ContactGroup
from shellmb.observers.summary import Sources
from shellmb.scene.lookup import said
from shellmb.simulate.simulation import Silent, Simulation

# depth that nodes miss, part of the radius of a ball or rod, or of half the thickness of a box: of
# a ball that lies between two nodes it is an eighth of the square of their distance in radii
MISSED = 0.1


class Between(Silent):
    """Watches the lines between neighbouring nodes, against the obstacles that nodes touch.

    Args:
        sources: The observers of the run.
    """

    name = "between nodes"

    def __init__(self, sources: Sources) -> None:
        # part of the radius, time
        self._missed: dict[str, tuple[float, float]] = {}

    def start(self, simulation: Simulation) -> None:
        """Find neighbouring nodes, and what is missed at the start."""
        self._groups: list[tuple[ContactGroup, Ints]] = []
        for group in simulation.model.potentials:
            if isinstance(group, ContactGroup) and np.isfinite(group.shape.depth):
                segments = group.points.segments()
                if len(segments):
                    self._groups.append((group, segments))
        self.idle = not self._groups
        self.accepted(simulation)

    def accepted(self, simulation: Simulation) -> None:
        """Take the step."""
        for group, segments in self._groups:
            q = simulation.problem.levels[group.name].q.x.array
            found = _missed(group, group.everywhere(group.seen_positions(q)), segments)
            before = self._missed.get(group.item.name, (0.0, 0.0))
            self._missed[group.item.name] = max(before, (found, simulation.t))

    def cautions(self, simulation: Simulation) -> Iterator[Caution]:
        """The contacts whose obstacles come between nodes."""
        for group, _ in self._groups:
            item = group.item
            missed, when = self._missed[item.name]
            if missed <= MISSED:
                continue
            yield Caution(
                self.name,
                group.owner,
                missed,
                MISSED,
                f"{said(item)}: between its nodes '{group.owner}' is deeper in the "
                f"{group.shape.label} than at them, by {missed:.0%} of its "
                f"{group.shape.extent} (at t = {when:.4g} s): only nodes touch, so the "
                f"{group.shape.label} passes between them; use smaller elements there",
            )

    def state(self) -> dict[str, Any]:
        """Findings so far."""
        return dict(self._missed)

    def restore(self, state: dict[str, Any]) -> None:
        """Take it up."""
        self._missed = {name: (a, b) for name, (a, b) in state.items()}


def _missed(group: ContactGroup, x: Floats, segments: Ints) -> float:
    """By how much lines between nodes are deeper than the nodes, part of the obstacle's depth.

    Args:
        group: The contact.
        x: Positions of its points as the obstacle sees them, shape (n, 3), m.
        segments: Pairs of neighbours, shape (m, 2).
    """
    depth = group.penetrations(x)[segments].max(axis=1)
    a, b = x[segments[:, 0]], x[segments[:, 1]]
    near = depth > -np.linalg.norm(b - a, axis=1)
    if not near.any():
        return 0.0
    between = group.penetrations(group.shape.nearest(a[near], b[near]))
    return float(np.max(between - np.maximum(depth[near], 0.0), initial=0.0)) / group.shape.depth
