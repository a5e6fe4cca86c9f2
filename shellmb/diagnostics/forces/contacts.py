"""Steps that pass through obstacles, or are too long for the impacts in them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from shellmb.arrays import Floats
from shellmb.diagnostics.base import RunWarning, Watch
from shellmb.diagnostics.forces.impacts import Impacts
from shellmb.model.potentials.contact import ContactGroup
from shellmb.scene.lookup import said
from shellmb.simulate.simulation import Simulation

# part of the radius of a ball or rod, or of half the thickness of a box: deeper, or through it
# within a step, a point soon leaves on the other side
DEEP = 0.5
# part of the largest penetration by which that of a step is too small: the force is too small, too
SLID = 0.1


class Contacts(Watch):
    """Watches how points move in a step, against the obstacles that they touch."""

    name = "contact"
    remembered = ("_deep", "_impacts", "_slid")

    def _begin(self) -> None:
        self._before: dict[str, Floats] = {}
        # part of the radius, time
        self._deep: dict[str, tuple[float, float]] = {}
        self._impacts = Impacts()
        # largest penetration; what is missed of one, m, time
        self._slid: dict[str, tuple[float, float, float]] = {}

    def start(self, simulation: Simulation) -> None:
        """Take the places of the points."""
        for group in _contacts(simulation):
            name = group.item.name
            self._before[name] = _positions(simulation, group)
            self._impacts.begin(name, self._stored(name))
        self.idle = not self._before

    def _stored(self, name: str) -> float:
        return self.sources.energy.values.get(f"{name}.energy", 0.0)

    def accepted(self, simulation: Simulation) -> None:
        """Take the step."""
        for group in _contacts(simulation):
            name = group.item.name
            start, end = self._before[name], _positions(simulation, group)
            self._before[name] = end
            self._impacts.step(name, self._stored(name), simulation.t)
            shape, depth = group.shape, group.penetrations(end)
            wrong = np.where(depth > 0, shape.overrated(start, end), 0.0)
            most, missed, then = self._slid.get(name, (0.0, 0.0, 0.0))
            if np.max(wrong, initial=0.0) > missed:
                missed, then = float(wrong.max()), simulation.t
            self._slid[name] = float(np.max(depth, initial=most)), missed, then
            if np.isfinite(shape.depth):
                depth = group.penetrations(shape.nearest(start, end))
                deepest = float(np.max(depth, initial=0.0)) / shape.depth
                self._deep[name] = max(self._deep.get(name, (0.0, 0.0)), (deepest, simulation.t))

    def cautions(self, simulation: Simulation) -> Iterator[RunWarning]:
        """The contacts that the steps are too long for."""
        for group in _contacts(simulation):
            item, name = group.item, group.item.name
            found = self._deep.get(name, (0.0, 0.0))
            deep, when = max(simulation.model.comm.allgather(found))
            kind = item.obstacle.label
            if deep > DEEP:
                says = (
                    f"{said(item)}: a point of '{group.owner}' comes, or goes in one step, as deep "
                    f"as {deep:.0%} of the {group.shape.extent} of the {kind} (at "
                    f"t = {when:.4g} s), and leaves on the wrong side if it passes "
                    "the middle: use a smaller step or a larger stiffness"
                )
                yield self.caution(group.owner, deep, DEEP, says)
            if simulation.scheme.dynamic:
                yield from self._impacts.cautions(self.name, group.owner, name, said(item))
            rows = simulation.model.comm.allgather(self._slid.get(name, (0.0, 0.0, 0.0)))
            most, (missed, then) = max(row[0] for row in rows), max(row[1:] for row in rows)
            share = missed / most if most > 0 else 0.0
            if share > SLID:
                says = (
                    f"{said(item)}: '{group.owner}' slides along the {kind} by so much in one step "
                    f"(at t = {then:.4g} s) that the distance is too large by {share:.0%} of the "
                    "largest penetration: forces are too small in such steps; use a smaller step"
                )
                yield self.caution(group.owner, share, SLID, says)


def _positions(simulation: Simulation, group: ContactGroup) -> Floats:
    return group.seen_positions(simulation.problem.levels[group.name].q.x.array)


def _contacts(simulation: Simulation) -> list[ContactGroup]:
    return [g for g in simulation.model.potentials if isinstance(g, ContactGroup)]
