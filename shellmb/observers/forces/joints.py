"""Forces of joints: force and moment on the second body, in the frame of the joint."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from shellmb.arrays import Floats
from shellmb.model.joints.coordinates import CoordinateGroup
from shellmb.model.joints.joints import BoundJoint, JointGroup
from shellmb.model.joints.mechanism import Mechanism
from shellmb.model.joints.switches import TiedCoordinates
from shellmb.model.massless import gathered
from shellmb.model.model import Model
from shellmb.observers.deferred import STEPS, DeferredObserver, Row, SharedTable, StepValues
from shellmb.observers.forces.locations import FreeCoordinates, Group, Places
from shellmb.observers.forces.reactions import Assembled, resistance
from shellmb.schemes.base import END
from shellmb.simulate.simulation import Simulation

COMPONENTS = ("F1", "F2", "F3", "M1", "M2", "M3")


class JointForces(DeferredObserver):
    """Forces [N] and moments [N m] that joints exert on their second bodies.

    They are means over the step, in statics the values: the force is that of the row that balances
    the momentum of the step, the moment the mean of arms times forces over the step (`Span`). What
    they are at the end of the step, `EndForceColumns` tells. The moment is about the joint's point
    on the second body; of a weld along an edge or area, which has many there, about that on the
    first. Components are along the axes `e1, e2, e3` that turn with the first body, half-way
    between their directions at the start and at the end of the step, `e3` being the joint's axis or
    normal; of hinges and welds along edges, along the scene's axes as they turn with the first
    body; of joints without axes (spherical, distance) along those of the scene, as of hinges along
    edges of two flexible shells; of wheels and blades `e1` is the direction they move in.
    What drivers, locks, springs, dampers and motors add about or along the axis is theirs, not the
    joint's; what the pitch of a screw adds is the joint's.

    Columns of the history are `JOINT.F1` to `JOINT.M3`, NaN before the first step; the coordinates
    of all joints that have some, at the end of the step, with the forces of drivers and locks
    (`Mechanism.coordinates`); and those of force elements, means over the step, which begin with
    the values at the start.
    """

    remembered = ("_freedoms",)

    def __init__(self) -> None:
        super().__init__()
        self._found = np.zeros((0, 4, 3))
        self._freedoms = FreeCoordinates()

    @property
    def values(self) -> Row:
        """Columns of the history."""
        return self.measure()

    def start(self, simulation: Simulation) -> None:
        """Prepare the loops that assemble the forces, and list the columns."""
        problem, mechanism = simulation.problem, simulation.model.mechanism
        self._forces = JointColumns(simulation.model, problem, simulation.scheme.balance)
        self._found = np.zeros((len(mechanism.joints), 4, 3))
        columns: Row = dict.fromkeys(self._forces.names, float("nan"))
        self._freedoms.start(simulation)
        columns |= self._freedoms.values
        # dampers have no forces in statics
        acting = [g for g in mechanism.element_groups if problem.forms[g.name][END].residual]
        self._elements = [(g, resistance(problem, [(g.name, END)])) for g in acting]
        # terms of two rows at once are not in the row of a group alone
        self._branches = {
            name: branches
            for name, branches in problem.branches.items()
            if problem.forms[name][END].stage is None
        }
        # what is read of the system is known at once
        self._read: list[Row] = [{} for _ in range(STEPS)]
        there = mechanism.coordinates(problem)
        self._reads = bool(there)
        columns |= there
        columns |= mechanism.elements(problem, simulation.t)
        # what moves a driven coordinate is known from a step on
        columns |= dict.fromkeys(mechanism.drivers, float("nan"))
        self._columns = columns
        self.begin(dict(columns))

    def take_solved(self, simulation: Simulation, row: int) -> None:
        """Take the forces of the step."""
        self._forces.take(partial(span_of_step, simulation), row)
        read: Row = {}
        for group, works in self._elements:
            acted = group.acted(works())
            if (branches := self._branches.get(group.name)) is not None:
                acted = acted + gathered(group.nodes, branches.forces(mean=True))
            read |= group.columns(acted)
        self._read[row] = read

    @property
    def acting(self) -> dict[str, Floats]:
        """Force and moment on the second body in the scene's axes, shape (2, 3), by joint.

        Zero before the first step.
        """
        self.book()
        return dict(zip(self._forces.joints, self._found[:, 2:], strict=True))

    def take_accepted(self, simulation: Simulation, row: int) -> None:
        """Take the coordinates."""
        if self._reads:
            self._read[row] |= simulation.model.mechanism.coordinates(simulation.problem)
        self._freedoms.take(row)

    def book_rows(self, rows: slice) -> list[Row]:
        """Find forces in the axes of the joints, and count turns."""
        forces = self._forces.of(rows)
        self._found = forces[-1].copy()
        each = self._forces.columns(forces), self._read[rows], self._freedoms.count(rows)
        found = []
        for values, read, turned in zip(*each, strict=True):
            self._columns = {**self._columns, **values, **read, **turned}
            found.append(self._columns)
        return found


class Span(NamedTuple):
    """States of a group over a step, shape (..., dofs): of an instant all three are the same.

    With the forces `F` of the row that balances the momentum of the step, and their first moment in
    time `F'` where the scheme has a row for it (`Scheme.balance`), the mean moment is
    `middle x F + (end - start)/2 x F'`.

    Args:
        start: At the start.
        end: At the end.
        middle: Where `F` acts.
    """

    start: Floats
    end: Floats
    middle: Floats


def span_of_step(simulation: Simulation, name: str) -> Span:
    """States of a group over the step that was just solved."""
    forms = simulation.problem.steps[name]
    return Span(*forms.ends(), forms.middle())


def span_of_state(simulation: Simulation, name: str) -> Span:
    """The state of a group between two steps."""
    return Span(*[np.asarray(simulation.problem.levels[name].q.x.array)] * 3)


class JointColumns:
    """Forces and moments of all joints, also in their frames as columns of the history.

    Args:
        model: The bodies.
        problem: The system that has the multipliers of joints.
        balance: Stages of the rows that balance momenta, as of a scheme.

    Attributes:
        joints: Names of the joints.
        names: Names of their columns.
    """

    def __init__(self, model: Model, problem: Assembled, balance: Sequence[str] = (END,)) -> None:
        mechanism = model.mechanism
        self.joints, self.names = list(mechanism.joints), column_names(mechanism)
        number = {name: k for k, name in enumerate(self.joints)}
        groups, self._balance = mechanism.groups, len(balance)
        works = resistance(problem, [(group.name, s) for group in groups for s in balance])
        pitches = [
            PitchForces(problem, group, mechanism.joints, number, balance, screws)
            for screws in mechanism.screws
            for group in {c.group.name: c.group for pair in screws.members for c in pair}.values()
        ]
        # what finds works of forces: of all groups at once, and of pitches
        self._works: list[StepValues | PitchForces] = [StepValues(works), *pitches]
        self._groups = [GroupForces(problem, g, joints_of(g), number) for g in groups]
        self._groups += pitches
        # of each step: states of the groups, one behind the other, and forces
        self._ends = np.cumsum([0, *(group.size for group in self._groups)]).tolist()
        self._spans = np.zeros((STEPS, 3, self._ends[-1]))
        self._forces = SharedTable(model.comm, (len(number), 4, 3))

    def take(self, at: Callable[[str], Span], row: int = 0) -> None:
        """Take the forces of a step; collective.

        Args:
            at: States of a group over which forces act, by its name.
            row: Which of the steps that are kept it becomes.
        """
        for works in self._works:
            works.take(row)
        spans = zip(*[at(group.name) for group in self._groups], strict=True)
        for kept, states in zip(self._spans[row], spans, strict=False):
            np.concatenate(states, out=kept)
        self._forces.take(row, self._add)

    def _add(self, rows: slice, forces: Floats) -> None:
        """Forces of some steps on this rank."""
        works = np.concatenate([each.of(rows) for each in self._works], axis=1)
        for group, first, last in zip(self._groups, self._ends, self._ends[1:], strict=False):
            mine = works[:, self._balance * first : self._balance * last]
            each = mine.reshape(len(mine), self._balance, group.size).swapaxes(0, 1)
            group.add(forces, Span(*self._spans[rows, :, first:last].swapaxes(0, 1)), each)

    def of(self, rows: slice) -> Floats:
        """Forces and moments of some steps in the joints' frames and the scene's, (k, n, 4, 3)."""
        return self._forces.of(rows, self._add)

    def columns(self, forces: Floats) -> list[Row]:
        """Columns of some steps, of their forces and moments."""
        rows = forces[:, :, :2].reshape(len(forces), len(self.names)).tolist()
        return [dict(zip(self.names, row, strict=True)) for row in rows]

    def __call__(self, at: Callable[[str], Span]) -> Row:
        """Columns now; collective; arguments as of `take`."""
        self.take(at)
        return self.columns(self.of(slice(0, 1)))[0]


def column_names(mechanism: Mechanism) -> list[str]:
    """Names of the columns of all joints."""
    return [f"{name}.{c}" for name in mechanism.joints for c in COMPONENTS]


type Joints = list[tuple[int, BoundJoint]]


def joints_of(group: JointGroup) -> Joints:
    """Local cells of a group with their joints."""
    return [(row, group.joints[item]) for row, item in enumerate(group.nodes.item.tolist())]


def parts_of(group: Group, joints: Joints, number: Mapping[str, int]) -> list[Acting]:
    """Parts of a group that find forces of its joints, by the ends that are on the second bodies.

    Args:
        group: The group.
        joints: Local cells of the joints, and the joints.
        number: Place of each joint in what is found, by its name.
    """
    items: dict[tuple[int, bool], Joints] = {}
    for row, joint in joints:
        # a weld to a shell has its ends the other way round
        second = 0 if joint.ends[0].owner == joint.joint.second else 1
        items.setdefault((second, joint.about is not None), []).append((row, joint))
    return [
        Acting(group, second, [*zip(*some, strict=True)], number)
        for (second, _), some in items.items()
    ]


class GroupForces:
    """Forces and moments of the joints of a group on this rank.

    Args:
        problem: The system that has their multipliers.
        group: The group.
        joints: Local cells of the joints, and the joints.
        number: Place of each joint in what is found, by its name.

    Attributes:
        size: Number of the group's dofs.
    """

    def __init__(
        self, problem: Assembled, group: Group, joints: Joints, number: Mapping[str, int]
    ) -> None:
        self.name = group.name
        self.size = problem.fields[problem.number(group.name, problem.last)].size_all
        self._parts = parts_of(group, joints, number)

    def add(self, found: Floats, at: Span, works: Floats) -> None:
        """Add forces and moments in the joints' frames and in the scene's.

        Args:
            found: Shape (steps, joints, 4, 3).
            at: States of the group over the steps, shape (steps, dofs).
            works: Works of its forces in the rows that balance momenta, shape (rows, steps, dofs).
        """
        for part in self._parts:
            # a weld along a region has an item for each of its nodes
            values = part.values(at, *works)
            np.add.at(found.swapaxes(0, 1), part.numbers, values.swapaxes(0, 1))


class PitchForces(GroupForces):
    """Forces and moments along and about the axes of screws, of their pitches.

    They reach the bodies through coordinates, on which drivers, locks and force elements may act,
    too. So the forces of the coordinates are taken with what the pitches exert alone.

    Args:
        problem: The system that has their multipliers.
        group: Coordinates, some of which are of screws.
        joints: All joints by name.
        number: Place of each joint in what is found, by its name.
        balance: Stages of the rows that balance momenta, as of a scheme.
        screws: The pitches.
    """

    def __init__(
        self,
        problem: Assembled,
        group: CoordinateGroup,
        joints: Mapping[str, BoundJoint],
        number: Mapping[str, int],
        balance: Sequence[str],
        screws: TiedCoordinates,
    ) -> None:
        self._group, self._screws = group, screws
        items = {
            c.item: joints[c.name] for pair in screws.members for c in pair if c.group is group
        }
        here = [(row, items[k]) for row, k in enumerate(group.nodes.item.tolist()) if k in items]
        super().__init__(problem, group, here, number)
        self._works = StepValues(resistance(problem, [(group.name, s) for s in balance]))
        self._held = [(problem.unknown(g.name), g.mixed.dofs["mu"]) for g in (group, screws)]

    def of(self, rows: slice) -> Floats:
        """Works in some steps that were taken, shape (steps, rows of the balance times dofs)."""
        return self._works.of(rows)

    def take(self, row: int) -> None:
        """Take the works of a step; collective."""
        (mine, dofs), (theirs, _) = self._held
        kept = [function.x.array[dofs] for function in mine]
        for function, pitch in zip(mine, theirs, strict=True):
            shares = self._screws.shares(pitch, self._group)
            function.x.array[dofs] = shares[self._group.nodes.item]
        self._works.take(row)
        for function, values in zip(mine, kept, strict=True):
            function.x.array[dofs] = values


class Acting:
    """Forces of joints of a group whose second bodies are at the same end.

    Args:
        group: The group.
        second: Which end is on the second body.
        items: Local cells of the joints, and the joints.
        number: Place of each joint in what is found, by its name.
    """

    def __init__(
        self, group: Group, second: int, items: Sequence[Any], number: Mapping[str, int]
    ) -> None:
        self._group, (self.cells, joints) = group, items
        self.numbers = [number[joint.joint.name] for joint in joints]
        self._second = Places(group, second, self.cells, joints)
        self._first = Places(group, 0, self.cells, joints)
        self._about: Floats | None = None
        self._axes: Floats | None = None
        if joints[0].about is not None:
            ends = [joint.ends[0] for joint in joints]
            arms = [e.directors @ (j.about - e.node) for e, j in zip(ends, joints, strict=True)]
            self._about = np.array(arms)
        if joints[0].vectors[0] > 0 and joints[0].ends[0].framed:
            axes = [joint.shown @ joint.ends[0].directors.T for joint in joints]
            self._axes = np.array(axes)

    def values(self, at: Span, work: Floats, first: Floats | None = None) -> Floats:
        """Force and moment on the second bodies in joint's and scene's frames, (steps, n, 4, 3).

        Args:
            at: States of the group, shape (steps, dofs).
            work: Virtual work of its forces for each dof, positive on the left-hand side.
            first: That of their first moment in time; None: there is none.
        """
        scene = self._moments(at.middle, work, 1.0)
        if first is not None:
            scene[..., 1, :] += self._moments((at.end - at.start) / 2, first, 0.0)[..., 1, :]
        own = scene
        if self._axes is not None:
            axes = halfway(*(self._axes @ self._first.directors(q) for q in (at.start, at.end)))
            if self._group.heads:
                for row, state in zip(axes, (at.start + at.end) / 2, strict=True):
                    self._turn(row, state)
            own = scene @ axes.swapaxes(-1, -2)
        # what the left-hand side resists with is the opposite of what acts; without a sign of zero
        return 0.0 - np.concatenate([own, scene], axis=-2)

    def _moments(self, q: Floats, work: Floats, whole: float) -> Floats:
        """Forces and moments in the scene's frame at states, or (`whole` 0) at changes of them."""
        if self._about is None:
            about = self._second.points(q, whole)
        else:
            arms = self._about[:, None] @ self._first.directors(q, whole)
            about = self._first.nodes(q, whole) + arms[..., 0, :]
        return self._second.moments(q, work, about, whole)

    def _turn(self, axes: Floats, q: Floats) -> None:
        """Turn axes as rows about their third ones to where joints head."""
        for k, row in enumerate(self.cells):
            c, s = (heading := self._group.heading(row, q)) / np.linalg.norm(heading)
            axes[k, :2] = [c * axes[k, 0] + s * axes[k, 1], c * axes[k, 1] - s * axes[k, 0]]


# half-way between frames that are turned by half a turn there is none
LEAST_COSINE = 1e-8


def halfway(first: Floats, second: Floats) -> Floats:
    """Frames midway between others, by half of the rotation from these to those.

    With the cosines `c` of its angle and `h` of half of it the root of a rotation `Q` is
    `(1 + Q)/2h - [(Q + Q^T)/2 - c]/[2h (1 + h)]`.

    Args:
        first: Unit vectors as rows, shape (..., 3, 3).
        second: Unit vectors as rows, shape (..., 3, 3).
    """
    turn = first.swapaxes(-1, -2) @ second
    double = np.trace(turn, axis1=-2, axis2=-1)[..., None, None] - 1
    h = np.maximum(np.sqrt(np.maximum(2 + double, 0.0)) / 2, LEAST_COSINE)
    bent = (turn + turn.swapaxes(-1, -2) - double * np.eye(3)) / (2 * (1 + h))
    return np.asarray(first @ (np.eye(3) + turn - bent) / (2 * h))
