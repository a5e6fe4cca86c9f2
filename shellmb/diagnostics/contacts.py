"""Contacts that pass through, pull or slip: obstacles, faces of shells, and joints that roll."""

from typing import Any

import numpy as np

from shellmb.arrays import Floats
from shellmb.diagnostics.base import Cautions, Watch
from shellmb.model.massless import gathered
from shellmb.model.potentials.contact import ContactGroup
from shellmb.scene.lookup import said
from shellmb.simulate.couplings.faces import FacesCoupling
from shellmb.simulate.simulation import Simulation

# part of the radius of a ball or rod, or of half the thickness of a box: deeper, or through it
# within a step, a point soon leaves on the other side
DEEP = 0.5
# part of the largest penetration by which that of a step is too small: the force is too small, too
SLID = 0.1

# part of the largest pressure of a run; the mean of two steps is looked at, since forces of EP
# alternate
PULL = 1e-3
# part of the speeds that it is the difference of: with 0.1 rad in a step it is 4e-3 in EP
SLIP = 2e-2


class Contacts(Watch):
    """Watches how points move in a step, against the obstacles that they touch."""

    name = "contact"
    remembered = ("_largest",)

    def start(self, simulation: Simulation) -> None:
        """Take the places of the points."""
        groups = simulation.model.contacts
        self._before = {group.item.name: _positions(simulation, group) for group in groups}
        self.idle = not groups

    def accepted(self, simulation: Simulation) -> None:
        """Take the step."""
        for group in simulation.model.contacts:
            name = group.item.name
            start, end = self._before[name], _positions(simulation, group)
            self._before[name] = end
            shape, depth = group.shape, group.penetrations(end)
            wrong = np.where(depth > 0, shape.overrated(start, end), 0.0)
            # what is missed of a penetration, m
            self._note(f"slid {name}", float(np.max(wrong, initial=0.0)), simulation.t)
            if np.isfinite(shape.depth):
                depth = group.penetrations(shape.nearest(start, end))
                # part of the radius
                deepest = float(np.max(depth, initial=0.0)) / shape.depth
                self._note(f"deep {name}", deepest, simulation.t)

    def cautions(self, simulation: Simulation) -> Cautions:
        """The contacts that the steps are too long for."""
        for group in simulation.model.contacts:
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
                yield from impacts(self, group.owner, name, said(item))
            most = np.max(self.columns(f"{name}.penetration")[0, 1:], initial=0.0)
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


# part of the largest energy of a contact that comes or goes in one step: of an impact that takes
# n steps it is 3/n
SUDDEN = 0.8


def impacts(watch: Watch, owner: str, name: str, who: str) -> Cautions:
    """A sentence if impacts of a contact are too short for the steps.

    Args:
        watch: The watch that says it.
        owner: Name of the body that has the points.
        name: Name of the contact.
        who: Name of it in sentences.
    """
    t, energy = watch.columns("t", f"{name}.energy")
    change = np.abs(np.diff(energy))
    largest = float(np.max(energy[1:], initial=0.0))
    share = float(np.max(change, initial=0.0)) / largest if largest > 0 else 0.0
    if share > SUDDEN:
        says = (
            f"{who}: {share:.0%} of the largest energy of the contact comes or goes in one step "
            f"(at t = {t[1 + np.argmax(change)]:.4g} s): impacts are shorter than four steps, and "
            "when and where bodies rebound is coarse; use a smaller step or a smaller stiffness"
        )
        yield watch.caution(owner, share, SUDDEN, says)


class TouchingFaces(Watch):
    """Watches how deep points come in a shell, and whether the bodies pass between them."""

    name = "faces of shells"
    remembered = ("_between",)

    def _begin(self) -> None:
        # by contact: first time at which bodies are too near between points, and of the deepest of
        # these intersection, depth, time, place
        self._between: dict[str, tuple[float, tuple[Any, ...]]] = {}

    def start(self, simulation: Simulation) -> None:
        """Take the start."""
        self.idle = not simulation.problem.couplings
        self.accepted(simulation)

    def accepted(self, simulation: Simulation) -> None:
        """See whether bodies intersect."""
        for faces in simulation.problem.couplings:
            found = faces.meeting()
            if found is not None:
                now = (found.intersect, found.depth, simulation.t, *found.place.tolist())
                first, deepest = self._between.get(faces.name, (simulation.t, now))
                self._between[faces.name] = first, max(deepest, now)

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
        t, depths = self.columns("t", f"{name}.penetration")
        # in the distance at which it touches
        deep, when = float(depths.max() / contact.law.reach), t[depths.argmax()]
        if deep > DEEP:
            says = (
                f"{who}: a point of '{contact.body}' comes to {1 - deep:.0%} of the distance from "
                f"the mid-surface of '{contact.shell}' at which it begins to touch (at "
                f"t = {when:.4g} s); behind the mid-surface it would leave on the other side: use "
                "a larger stiffness"
            )
            yield self.caution(contact.body, deep, DEEP, says)
        if dynamic:
            yield from impacts(self, contact.body, name, who)


class Lifting(Watch):
    """Watches the normal forces of rolling and knife-edge joints."""

    name = "lifting"
    remembered = ("_last", "_press", "_largest")

    def _begin(self) -> None:
        self._last: dict[str, float] = {}
        # the largest pressure
        self._press: dict[str, float] = {}

    def start(self, simulation: Simulation) -> None:
        """Find the joints."""
        self._groups = simulation.model.mechanism.contacts
        self.idle = not self._groups

    def accepted(self, simulation: Simulation) -> None:
        """Take the forces of the step."""
        for group in self._groups:
            q = simulation.problem.levels[group.name].q.x.array
            forces = gathered(group.nodes, group.sliding(q, 0 * q)[:, 4])
            for name, force in zip(group.labels, forces.tolist(), strict=True):
                mean = (force + self._last.get(name, force)) / 2
                self._last[name] = force
                self._press[name] = max(self._press.get(name, 0.0), abs(mean))
                self._note(name, -mean, simulation.t)

    def cautions(self, simulation: Simulation) -> Cautions:
        """The contacts that pull."""
        for name, (pull, when) in self._largest.items():
            share = pull / self._press[name]
            if share > PULL:
                bound = simulation.model.mechanism.joints[name]
                says = (
                    f"{bound.joint.said} pulls at '{bound.joint.second}' by up to {pull:.3g} N (at "
                    f"t = {when:.4g} s): it would lift off, and the joint holds it down; load it "
                    "more, or move it more slowly"
                )
                yield self.caution(bound.joint.second, share, PULL, says)


class Slipping(Watch):
    """Looks at the end of a run at the slip of contacts, which EP leaves."""

    name = "slipping"

    def cautions(self, simulation: Simulation) -> Cautions:
        """The contacts that slip by more than that."""
        for group in simulation.model.mechanism.contacts:
            levels = simulation.problem.levels[group.name]
            slips = group.sliding(levels.q.x.array, levels.rates["v"].x.array)
            shares = slips[:, 0] / np.maximum(slips[:, 1], 1e-300)
            mine = [(int(k), float(s)) for k, s in zip(group.nodes.item, shares, strict=True)]
            for item, share in sorted(
                {p for part in group.nodes.mesh.comm.allgather(mine) for p in part}
            ):
                if share > SLIP:
                    joint = group.joints[item].joint
                    says = (
                        f"{joint.said} slips by {share:.1%} of its speeds at the end of the run: "
                        "use --scheme ep4, --scheme ed3 or a smaller step"
                    )
                    yield self.caution(joint.second, share, SLIP, says)
