"""Contacts with the faces of shells: too deep, too sudden, and shells that intersect anyway."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from shellmb.diagnostics.base import RunWarning, Watch
from shellmb.diagnostics.forces.contacts import DEEP
from shellmb.diagnostics.forces.impacts import Impacts
from shellmb.scene.lookup import said
from shellmb.simulate.couplings.faces import FacesCoupling
from shellmb.simulate.simulation import Simulation


class TouchingFaces(Watch):
    """Watches how deep points come in a shell, and whether the bodies pass between them."""

    name = "faces of shells"
    remembered = ("_deep", "_between", "_impacts")

    def _begin(self) -> None:
        # by contact: depth in the distance at which it touches, time; first time at which bodies
        # are too near between points, and of the deepest of these intersection, depth, time, place
        self._deep: dict[str, tuple[float, float]] = {}
        self._between: dict[str, tuple[float, tuple[Any, ...]]] = {}
        self._impacts = Impacts()

    def start(self, simulation: Simulation) -> None:
        """Take the start."""
        for faces in simulation.problem.couplings:
            self._impacts.begin(faces.name, self.sources.energy.values[f"{faces.name}.energy"])
        self.idle = not simulation.problem.couplings
        self._look(simulation)

    def accepted(self, simulation: Simulation) -> None:
        """Take the step."""
        for faces in simulation.problem.couplings:
            energy = self.sources.energy.values[f"{faces.name}.energy"]
            self._impacts.step(faces.name, energy, simulation.t)
        self._look(simulation)

    def _look(self, simulation: Simulation) -> None:
        """See how deep points are, and whether bodies intersect."""
        t = simulation.t
        for faces in simulation.problem.couplings:
            name = faces.name
            deep = faces.depth() / faces.contact.law.reach
            self._deep[name] = max(self._deep.get(name, (0.0, 0.0)), (deep, t))
            found = faces.meeting()
            if found is not None:
                now = (found.intersect, found.depth, t, *found.place.tolist())
                first, deepest = self._between.get(name, (t, now))
                self._between[name] = first, max(deepest, now)

    def cautions(self, simulation: Simulation) -> Iterator[RunWarning]:
        """Say what is wrong with contacts."""
        for faces in simulation.problem.couplings:
            yield from self._cautions(faces, simulation.scheme.dynamic)

    def _cautions(self, faces: FacesCoupling, dynamic: bool) -> Iterator[RunWarning]:
        name, contact = faces.name, faces.contact
        who = said(contact.item)
        if name in self._between:
            first, (intersect, depth, when, *place) = self._between[name]
            what = "intersect" if intersect else "come too near to each other"
            how = "have passed through" if intersect else "meet"
            says = (
                f"{who}: '{contact.body}' and '{contact.shell}' {what} between the points that "
                f"touch (first at t = {first:.4g} s), where edges {how} edges or come between "
                f"nodes: they are {depth:.3g} m too deep at "
                f"({', '.join(f'{c:.4g}' for c in place)}) at t = {when:.4g} s. Only nodes touch; "
                f"use elements whose nodes are nearer to each other than {contact.law.reach:.3g} m "
                "there, or a second contact with both bodies exchanged"
            )
            yield self.caution(contact.body, depth, 0.0, says)
        deep, when = self._deep[name]
        if deep > DEEP:
            says = (
                f"{who}: a point of '{contact.body}' comes to {1 - deep:.0%} of the distance from "
                f"the mid-surface of '{contact.shell}' at which it begins to touch (at "
                f"t = {when:.4g} s); behind the mid-surface it would leave on the other side: use "
                "a larger stiffness"
            )
            yield self.caution(contact.body, deep, DEEP, says)
        if dynamic:
            yield from self._impacts.cautions(self.name, contact.body, name, who)
