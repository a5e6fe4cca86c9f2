"""What joints carry: force and moment on the second body, in the frame of the joint."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from mpi4py import MPI

import numpy as np
import numpy.typing as npt

from shellmb.model.joints.columns import element_columns
from shellmb.model.joints.joints import BoundJoint, JointGroup
from shellmb.model.joints.mechanism import Mechanism
from shellmb.model.model import Model
from shellmb.observers.forces.freedoms import Freedoms, rows
from shellmb.observers.forces.holding import Assembled, resistance
from shellmb.observers.forces.impulse import last_middle
from shellmb.schemes.base import END
from shellmb.simulate.simulation import Silent, Simulation
from shellmb.system.assembly.loops import LoopResiduals

Floats = npt.NDArray[np.float64]

# a group of joints, what assembles the virtual work of its forces, and place for it
type GroupLoop = tuple[JointGroup, LoopResiduals, Floats]

COMPONENTS = ("F1", "F2", "F3", "M1", "M2", "M3")


class JointForces(Silent):
    """Forces [N] and moments [N m] that joints exert on their second bodies.

    They are means over the step, in statics the values: those of the row that balances the momentum
    of the step, at the middle of the path (of ED from the state j to f, which is where its eq. (29)
    has its forces). What they are at the end of the step, `EndForceColumns` tells. The moment is
    about the joint's point on the second body; of a weld along an edge or area, which has many
    there, about that on the first. Components are along the axes `e1, e2, e3` that turn with the
    first body, `e3` being the joint's axis or normal; of joints without axes (spherical, distance)
    along those of the scene; of wheels and blades `e1` is the direction they move in.
    What drivers, springs, dampers and motors add about or along the axis is theirs, not the
    joint's.

    Attributes:
        values: Columns of the history: `JOINT.F1` to `JOINT.M3`, NaN before the first step; the
            coordinates of all joints that have some, at the end of the step, with the forces of
            drivers and locks (`Mechanism.coordinates`); and those of force elements, means over the
            step, which begin with the values at the start.
        acting: Force and moment on the second body in the scene's axes, shape (2, 3), by the name
            of the joint; zero before the first step.
    """

    def __init__(self) -> None:
        self.values: dict[str, float] = {}
        self.acting: dict[str, Floats] = {}
        self._freedoms = Freedoms()

    def start(self, simulation: Simulation) -> None:
        """Prepare the loops that assemble the forces, and list the columns."""
        problem, mechanism = simulation.problem, simulation.model.mechanism
        self._loops = group_loops(problem, mechanism)
        for name in mechanism.joints:
            for component in COMPONENTS:
                self.values[f"{name}.{component}"] = float("nan")
            self.acting[name] = np.zeros((2, 3))
        self._freedoms.start(simulation)
        self.values.update(self._freedoms.values)
        # dampers have no forces in statics
        acting = [g for g in mechanism.element_groups if problem.forms[g.name][END].residual]
        self._elements = [(g, *resistance(problem, g.name)) for g in acting]
        self.values.update(mechanism.coordinates(problem))
        self.values.update(mechanism.elements(problem, simulation.t))
        # what moves a driven coordinate is known from a step on
        self.values.update(dict.fromkeys(mechanism.drivers, float("nan")))

    def solved(self, simulation: Simulation) -> None:
        """Take the forces of the step."""
        middle = partial(last_middle, simulation)
        found = joint_forces(simulation.model, self._loops, middle)
        self.values.update(columns(found))
        self.acting.update({name: both[2:] for name, both in found.items()})
        for group, residuals, r in self._elements:
            r[:] = 0.0
            residuals.refresh()
            residuals.add(r)
            self.values.update(element_columns(group, group.acted(r)))

    def accepted(self, simulation: Simulation) -> None:
        """Take the coordinates."""
        mechanism = simulation.model.mechanism
        self.values.update(mechanism.coordinates(simulation.problem))
        self.values.update(self._freedoms.measure(simulation))

    def measure(self) -> dict[str, float]:
        """Columns of the history."""
        return dict(self.values)

    def state(self) -> dict[str, Any]:
        """Rotations, whose turns count."""
        return self._freedoms.state()

    def restore(self, state: dict[str, Any]) -> None:
        """Take them up."""
        self._freedoms.restore(state)


def group_loops(problem: Assembled, mechanism: Mechanism) -> list[GroupLoop]:
    """What assembles the forces of all joints.

    Args:
        problem: The system that has their multipliers.
        mechanism: The joints.
    """
    return [(g, *resistance(problem, g.name)) for g in mechanism.groups]


def joint_forces(
    model: Model, loops: list[GroupLoop], state: Callable[[str], Floats]
) -> dict[str, Floats]:
    """Force and moment of each joint in its frame and in the scene's, shape (4, 3); collective.

    Args:
        model: The bodies.
        loops: What assembles them.
        state: State of a group at which they act, by its name.
    """
    number = {name: k for k, name in enumerate(model.mechanism.joints)}
    if not number:
        return {}
    found = np.zeros((len(number), 4, 3))
    for group, residuals, r in loops:
        r[:] = 0.0
        residuals.refresh()
        residuals.add(r)
        q = state(group.name)
        for row, item in enumerate(group.nodes.item):
            joint = group.joints[item]
            # a weld along a region has an item for each of its nodes
            found[number[joint.joint.name]] += _force(group, joint, row, q, r)
    model.comm.Allreduce(MPI.IN_PLACE, found)
    return {name: found[k] for name, k in number.items()}


def columns(forces: dict[str, Floats], ending: str = "") -> dict[str, float]:
    """Forces and moments of joints in their frames as columns of the history.

    Args:
        forces: Those of `joint_forces`.
        ending: What the names of the columns end with.
    """
    return {
        f"{name}.{component}{ending}": float(value)
        for name, both in forces.items()
        for component, value in zip(COMPONENTS, both[:2].ravel(), strict=True)
    }


def _force(group: JointGroup, joint: BoundJoint, row: int, q: Floats, r: Floats) -> Floats:
    """Force and moment on the second body in the joint's frame and in the scene's, shape (4, 3).

    Args:
        group: The group.
        joint: The joint.
        row: Its local cell.
        q: State of the group at which its forces act.
        r: Virtual work of its forces for each dof, positive on the left-hand side.
    """
    # a weld to a shell has its ends the other way round
    second = 0 if joint.ends[0].owner == joint.joint.second else 1
    end = group.ends[second]
    x, d, force, couples = _end(group, joint, second, row, q, r)
    point = x + joint.ends[second].offset @ d if end.turns else x
    if joint.about is not None:
        first, axes, _, _ = _end(group, joint, 0, row, q, r)
        point = first + (joint.ends[0].directors @ (joint.about - joint.ends[0].node)) @ axes
    moment = np.cross(x - point, force) + np.cross(d, couples).sum(axis=0)
    axes = _axes(group, joint, row, q)
    # what the left-hand side resists with is the opposite of what acts; without a sign of zero
    return 0.0 - np.stack([axes @ force, axes @ moment, force, moment])


def _end(
    group: JointGroup, joint: BoundJoint, which: int, row: int, q: Floats, r: Floats
) -> tuple[Floats, Floats, Floats, Floats]:
    """Position and directors of a node, and the virtual work on them."""
    place, end = group.ends[which], joint.ends[which]
    at = rows(group, place, "u", row)
    x, force = end.node + q[at], r[at]
    if not place.turns:
        return x, np.zeros((0, 3)), force, np.zeros((0, 3))
    at = rows(group, place, "w", row)
    return x, end.directors + q[at].reshape(-1, 3), force, r[at].reshape(-1, 3)


def _axes(group: JointGroup, joint: BoundJoint, row: int, q: Floats) -> Floats:
    """The joint's axes as rows: those that turn with its first place, if its kind has them."""
    if joint.vectors[0] == 0:
        return np.eye(3)
    _, d, _, _ = _end(group, joint, 0, row, q, q)
    axes, heading = joint.shown @ joint.ends[0].directors.T @ d, group.heading(row, q)
    if heading is not None:
        (c, s), axes = heading / np.linalg.norm(heading), np.array(axes)
        axes[:2] = c * axes[0] + s * axes[1], c * axes[1] - s * axes[0]
    return np.asarray(axes)
