"""Contacts: steps that pass through obstacles or are too long for impacts, and faces of shells."""

from __future__ import annotations

from typing import Any

import numpy as np

from shellmb.arrays import Floats
from shellmb.diagnostics.base import Cautions, RunWarning, Watch
from shellmb.model.potentials.contact import ContactGroup
from shellmb.restart import Restartable
from shellmb.scene.lookup import said
from shellmb.simulate.couplings.faces import FacesCoupling
from shellmb.simulate.simulation import Simulation

# part of the radius of a ball or rod, or of half the thickness of a box: deeper, or through it
# within a step, a point soon leaves on the other side
DEEP = 0.5
# part of the largest penetration by which that of a step is too small: the force is too small, too
SLID = 0.1


class Contacts(Watch):
    """Watches how points move in a step, against the obstacles that they touch."""

    name = "contact"
    remembered = ("_largest", "_impacts")

    def _begin(self) -> None:
        self._before: dict[str, Floats] = {}
        self._impacts = Impacts()

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
            # the largest penetration; what is missed of one, m
            self._note(f"pressed {name}", float(np.max(depth, initial=0.0)), simulation.t)
            self._note(f"slid {name}", float(np.max(wrong, initial=0.0)), simulation.t)
            if np.isfinite(shape.depth):
                depth = group.penetrations(shape.nearest(start, end))
                # part of the radius
                deepest = float(np.max(depth, initial=0.0)) / shape.depth
                self._note(f"deep {name}", deepest, simulation.t)

    def cautions(self, simulation: Simulation) -> Cautions:
        """The contacts that the steps are too long for."""
        for group in _contacts(simulation):
            item, name = group.item, group.item.name
            deep, when = self._worst(simulation, f"deep {name}")
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
            most, _ = self._worst(simulation, f"pressed {name}")
            missed, then = self._worst(simulation, f"slid {name}")
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


# part of the largest energy of a contact that comes or goes in one step: of an impact that takes
# n steps it is 3/n
SUDDEN = 0.8


class Impacts(Restartable):
    """Largest changes of energies of contacts in a step."""

    remembered = ("_found",)

    def __init__(self) -> None:
        self._energy: dict[str, float] = {}
        # largest energy, largest change in a step, time
        self._found: dict[str, tuple[float, float, float]] = {}

    def begin(self, name: str, energy: float) -> None:
        """Take the energy of a contact that steps begin with, J."""
        self._energy[name] = energy

    def step(self, name: str, energy: float, t: float) -> None:
        """Take the energy of a contact at the end of a step.

        Args:
            name: Name of the contact.
            energy: The energy, J.
            t: The time, s.
        """
        change = abs(energy - self._energy[name])
        self._energy[name] = energy
        largest, most, when = self._found.get(name, (0.0, 0.0, 0.0))
        if change > most:
            most, when = change, t
        self._found[name] = max(largest, energy), most, when

    def cautions(self, watch: str, owner: str, name: str, who: str) -> Cautions:
        """A sentence if impacts of a contact are too short for the steps.

        Args:
            watch: Name of the watch.
            owner: Name of the body that has the points.
            name: Name of the contact.
            who: Name of it in sentences.
        """
        largest, change, when = self._found.get(name, (0.0, 0.0, 0.0))
        share = change / largest if largest > 0 else 0.0
        if share > SUDDEN:
            says = (
                f"{who}: {share:.0%} of the largest energy of the contact comes or goes in one "
                f"step (at t = {when:.4g} s): impacts are shorter than four steps, and when and "
                "where bodies rebound is coarse; use a smaller step or a smaller stiffness"
            )
            yield RunWarning(watch, owner, share, SUDDEN, says)


class TouchingFaces(Watch):
    """Watches how deep points come in a shell, and whether the bodies pass between them."""

    name = "faces of shells"
    remembered = ("_largest", "_between", "_impacts")

    def _begin(self) -> None:
        # by contact: first time at which bodies are too near between points, and of the deepest of
        # these intersection, depth, time, place
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
            # in the distance at which it touches
            self._note(name, faces.depth() / faces.contact.law.reach, t)
            found = faces.meeting()
            if found is not None:
                now = (found.intersect, found.depth, t, *found.place.tolist())
                first, deepest = self._between.get(name, (t, now))
                self._between[name] = first, max(deepest, now)

    def cautions(self, simulation: Simulation) -> Cautions:
        """Say what is wrong with contacts."""
        for faces in simulation.problem.couplings:
            yield from self._cautions(faces, simulation.scheme.dynamic)

    def _cautions(self, faces: FacesCoupling, dynamic: bool) -> Cautions:
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
        deep, when = self._noted(name)
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
