"""Joints with their masses, drivers and force elements, which tie bodies together."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from shellmb.errors import SceneError
from shellmb.model import elements as force_elements
from shellmb.model.body import Body, FixedDofs, PrescribedTurn
from shellmb.model.joints import coordinates as relative
from shellmb.model.joints import switches
from shellmb.model.joints.constraints import ConstraintGroup
from shellmb.model.joints.edge_hinges import bind_hinges
from shellmb.model.joints.joints import BoundJoint, JointGroup, bind, joint_groups, point_masses
from shellmb.model.joints.rolling import ContactGroup, bind_contact
from shellmb.model.locations.nodes import FindEnd
from shellmb.model.massless import Scale, gathered
from shellmb.model.shells.shell import ShellModel
from shellmb.model.signals import Signals
from shellmb.scene import Scene
from shellmb.scene.checks.signals import coordinate_read
from shellmb.scene.multibody.couplings import Relation

# a driver's motion begins where the joint is, to this part of what is large for its coordinate
AT_START = 1e-9
# what tells the constraint of a screw's pitch from the others of its joint
SCREW = ".pitch"


class Mechanism:
    """The joints of a scene, and what drives and resists them.

    Args:
        scene: The scene.
        scale: Communicator and sizes.
        find: Places on bodies by name.
        shells: The shells by name.
        signals: What controllers command and events switch.

    Attributes:
        joints: All joints with their places, of a weld along a region that of its first node.
        groups: Their groups, by kind; those of contacts are last.
        contacts: Groups of contacts alone.
        bodies: All bodies of the system that it consists of.
        table: The coordinates that something acts on: of joints, and distances of elements.
        coordinate_groups: Their groups, by kind.
        element_groups: Springs, dampers and motors.
        lock_groups: Locks.
        screws: Pitches of screws.
        couplings: Couplings of coordinates.
        drivers: Coordinates that drivers prescribe, by column of their torque or force.
        switches: What acts in windows of time only.
        edges: Frames of hinges of edges.
        several: Coordinates of hinges of edges with several angles, with their shares, by joint.

    Raises:
        SceneError: If a place does not exist, a joint does not fit its bodies, or what acts on it
            is impossible.
    """

    def __init__(
        self,
        scene: Scene,
        scale: Scale,
        find: FindEnd,
        shells: Mapping[str, ShellModel],
        signals: Signals,
    ) -> None:
        self._scene, self._scale = scene, scale
        self.joints: dict[str, BoundJoint] = {}
        plain: list[BoundJoint] = []
        joints: tuple[Any, ...] = scene.joints
        edges = [joint for joint in joints if joint.along_edges]
        hinges, self.edges = bind_hinges(edges, find, shells, scale, not scene.static)
        for joint in joints:
            if joint.rolls:
                self.joints[joint.name] = bind_contact(joint, find, scale.length)
                continue
            hinge = hinges.get(joint.name)
            bound = bind(joint, find, shells, scale.length) if hinge is None else hinge.nodes
            self.joints[joint.name] = bound[0]
            plain += bound
        switched = frozenset(j.name for j in scene.joints if j.active is not None)
        contacts = [joint for joint in self.joints.values() if joint.start]
        self.groups = joint_groups(scale, plain, switched, JointGroup)
        self.contacts = joint_groups(scale, contacts, switched, ContactGroup)
        self.groups += self.contacts
        needed = self._coordinates(find)
        needed += [c for hinge in hinges.values() for c in hinge.coordinates]
        self.coordinate_groups, self.table = relative.coordinate_groups(scale, needed)
        self.screws, self.couplings = self._screws(), self._couplings()
        self.several = {name: hinge.several for name, hinge in hinges.items() if hinge.several}
        elements = [bound for e in scene.force_elements for bound in self._bound(e)]
        self.element_groups = force_elements.element_groups(scale.comm, elements)
        force_elements.check_at_rest(scene, self.element_groups)
        self.drivers: dict[str, relative.Coordinate] = {}
        self._drive(signals)
        windowed, locks = self._windows([*self.groups, *self.screws]), self._locks(signals)
        self.lock_groups = [lock.group for lock in locks]
        self.switches = switches.Switches([*windowed, *locks])
        masses = point_masses(scene, scale.comm, list(self.joints.values()))
        self.bodies: list[Body] = [*self.groups, *self.edges, *masses, *self.coordinate_groups]
        self.bodies += [*self.screws, *self.couplings, *self.element_groups, *self.lock_groups]

    def refresh(self, levels: Mapping[str, Any]) -> None:
        """Count rotations from where they are, and take rates from the places, before a step.

        Without it drivers never correct what velocities violate constraints by
        (`CoordinateGroup.refresh`), and under ED their torques oscillate as under EP.

        Args:
            levels: Functions of the bodies: `q` the state, `rates["v"]` its velocities.
        """
        for group in self.coordinate_groups:
            here = levels[group.name]
            group.begin(here.q)
            if "v" in here.rates:
                group.refresh(here.q, here.rates["v"])

    def command(self, signals: Signals) -> None:
        """Give motors the torques and forces that are commanded now."""
        for group in self.element_groups:
            group.command(signals)

    def coordinates(self, problem: Any) -> dict[str, float]:
        """Columns of the history: coordinates, and what drives and locks them; collective.

        `JOINT.rotation` [rad], `JOINT.translation` [m], `ELEMENT.length` [m]; `NAME.torque` [N m]
        or `NAME.force` [N] of drivers; `JOINT.lock_torque` or `JOINT.lock_force`; of contacts those
        of `ContactGroup.columns`.

        Args:
            problem: The problem, a step of which is accepted.
        """
        values, _ = self.read(problem)
        found = {
            f"{name}.{relative.COLUMN[kind]}": self.table[name, kind].start + value
            for (name, kind), value in values.items()
        }
        return found | self.efforts(problem) | self.tracks(problem)

    def read(self, problem: Any) -> tuple[dict[relative.Key, float], dict[relative.Key, float]]:
        """Changes of all coordinates and their rates; collective."""
        values: dict[relative.Key, float] = {}
        rates: dict[relative.Key, float] = {}
        for group in self.coordinate_groups:
            q = problem.state(group.name).x.array
            v = problem.levels[group.name].rates.get("v")
            values |= group.by_name(q)
            rates |= group.by_name(0 * q if v is None else v.x.array)
        return values, rates

    def elements(self, problem: Any, t: float) -> dict[str, float]:
        """Columns of force elements at a state; collective.

        `NAME.torque` [N m] or `NAME.force` [N], of springs the tension, of dampers the resistance,
        of motors what they exert, from coordinates and rates there.

        Args:
            problem: The problem, which has the state.
            t: Its time, s.
        """
        if not self.element_groups:
            return {}
        values, rates = self.read(problem)
        found: dict[str, float] = {}
        for group in self.element_groups:
            keys = [(item.coordinate.name, item.coordinate.kind) for item in group.items]
            x, v = (np.array([each[key] for key in keys]) for each in (values, rates))
            forces = group.forces(x, v, t)
            if (branches := problem.branches.get(group.name)) is not None:
                forces = forces + gathered(group.nodes, branches.forces())
            found |= group.columns(forces)
        return found

    def efforts(self, problem: Any) -> dict[str, float]:
        """Columns of what drives and locks coordinates alone; collective.

        Args:
            problem: What the forces are found in: of a step, or of its end.
        """
        found = {name: c.drive(problem) for name, c in self.drivers.items()}
        for group in (*self.lock_groups, *self.couplings):
            found |= group.columns(problem.state(group.name))
        return found

    def tracks(self, problem: Any) -> dict[str, float]:
        """Columns of contacts; collective."""
        levels = problem.levels
        each = (group.columns(levels[group.name]) for group in self.contacts)
        return {name: value for found in each for name, value in found.items()}

    def _coordinates(self, find: FindEnd) -> list[relative.BoundCoordinate]:
        """The coordinates that something acts on, or that sensors read; others do not exist.

        Raises:
            SceneError: If something acts on a joint that acts at times only.
        """
        scene = self._scene
        read = [coordinate_read(scene, sensor.column) for sensor in scene.sensors]
        keys: dict[relative.Key, None] = {key: None for key in read if key is not None}
        items: list[Any] = [*scene.drivers, *scene.acting_locks, *scene.joint_elements]
        items += [coupled for coupling in scene.couplings for coupled in coupling.terms]
        for item in items:
            joint = self.joints[item.joint].joint
            if joint.active is not None:
                who = f"{item.label} '{item.name}'" if hasattr(item, "name") else "a lock"
                raise SceneError(
                    f"{joint.said}: it has windows of time, and {who} acts on its coordinate; a "
                    "joint with drivers, locks or force elements must act always"
                )
            keys |= dict.fromkeys((item.joint, kind) for kind in scene.coordinates_of(item))
        keys |= dict.fromkeys((joint.name, kind) for joint in scene.joints for kind in joint.tied)
        found = [
            relative.joint_coordinate(self.joints[name], kind)
            for name, kind in keys
            # that of a hinge of edges is there anyway
            if not self.joints[name].joint.along_edges
        ]
        for element in scene.point_elements:
            who = f"{element.label} '{element.name}'"
            first = find(element.first, element.at, who)
            ends = first, find(element.second, element.second_at, who)
            found.append(relative.distance_coordinate(element.name, ends, self._scale.length, who))
        return found

    def _bound(self, element: Any) -> list[force_elements.BoundElement]:
        """A force element on its coordinate, or on all of a hinge of edges by their shares."""
        joint, kind = force_elements.coordinate_of(self._scene, element)
        bound, static = force_elements.BoundElement, self._scene.static
        if joint not in self.several:
            return [bound(element, self.table[joint, kind], static)]
        found = []
        for name, share in self.several[joint]:
            values = {k: getattr(element, k, None) for k in ("stiffness", "damping")}
            part = replace(element, **{k: share * v for k, v in values.items() if v is not None})
            found.append(bound(part, self.table[name, kind], static))
        return found

    def _screws(self) -> list[switches.TiedCoordinates]:
        """Translation in proportion to rotation, for all screws."""
        joints: tuple[Any, ...] = self._scene.joints
        screws, scale = [joint for joint in joints if joint.tied], self._scale
        if not screws:
            return []
        labels = [f"{joint.name}{SCREW}" for joint in screws]
        pairs = [[self.table[joint.name, kind] for kind in joint.tied] for joint in screws]
        factors = np.array([(-joint.pitch / (2 * np.pi), 1.0) for joint in screws])
        switched = any(joint.active is not None for joint in screws)
        tied = labels, pairs, factors, screws, scale.length, switched
        return [switches.TiedCoordinates(scale, "screw pitches", *tied)]

    def _couplings(self) -> list[switches.TiedCoordinates]:
        """Sums of coordinates that are given; those of as many coordinates are a group."""
        scene, groups = self._scene, dict[tuple[int, int], list[Relation]]()
        for coupling in scene.couplings:
            groups.setdefault((len(coupling.terms), len(coupling.given)), []).append(coupling)
        found = []
        for (count, given), group in groups.items():
            members, factors = [], np.ones((len(group), count + given))
            for row, coupling in zip(factors, group, strict=True):
                here = [self.table[c.joint, scene.coordinates_of(c)[0]] for c in coupling.terms]
                row[:count] = [c.factor for c in coupling.terms]
                row[count:] = -1.0
                # a violation of one is as large as coordinates of their sizes
                sizes = [coordinate.size for coordinate in here]
                row /= np.max(np.abs(row[:count]) * sizes)
                members.append(here)
                if coupling.given:
                    self._begins_as_zero(coupling.given[0](0.0), f"{coupling.said}: value")
            title = f"couplings of {count} coordinates" + ", over time" * bool(given)
            labels = [coupling.name for coupling in group]
            tied = labels, members, factors, group, 1.0, False
            found.append(switches.TiedCoordinates(self._scale, title, *tied))
        return found

    def _begins_as_zero(self, start: float, who: str, size: float = 1.0) -> None:
        """Check that a dynamic scene begins where a motion of coordinates does.

        Raises:
            SceneError: If it does not.
        """
        if not self._scene.static and not self._scene.assemble and abs(start) > AT_START * size:
            raise SceneError(
                f"{who} is {start:g} at the time 0; it must begin as 0, because it counts from the "
                "given positions, or use assemble=True"
            )

    def _drive(self, signals: Signals) -> None:
        """Prescribe the coordinates of drivers.

        Raises:
            SceneError: If a dynamic scene does not begin where a driver does.
        """
        for driver in self._scene.drivers:
            for kind in driver.coordinates:
                who = f"driver '{driver.name}': {kind}"
                motion = signals.bound(getattr(driver, kind), who)
                coordinate = self.table[driver.joint, kind]
                self._begins_as_zero(motion(0.0), who, coordinate.size)
                self.drivers[f"{driver.name}.{coordinate.effort}"] = coordinate
                turn = None
                if kind == "rotation":
                    turn = PrescribedTurn(f"driver '{driver.name}'", motion, unknown=True)
                coordinate.group.fixed.append(FixedDofs(coordinate.local(), motion, turn))

    def _windows(self, groups: Sequence[ConstraintGroup]) -> list[switches.Switched]:
        """Joints that act in windows of time."""
        windows = {joint.name: joint.active for joint in self._scene.joints}
        found = []
        for group in groups:
            mine: list[Any] = [windows[name.removesuffix(SCREW)] for name in group.labels]
            if any(w is not None for w in mine):
                found.append(switches.Switched(group, mine, self._scene.t_end))
        return found

    def _locks(self, signals: Signals) -> list[switches.Locks]:
        """Groups of locks, of rotations and of translations."""
        scene = self._scene
        items = [(lock, k) for lock in scene.acting_locks for k in scene.coordinates_of(lock)]
        found = []
        for kind in dict.fromkeys(kind for _, kind in items):
            each = [
                (lock, self.table[name, kind])
                for lock, other in items
                if other == kind
                for name, _ in self.several.get(lock.joint, [(lock.joint, 1.0)])
            ]
            locks, coordinates = [lock for lock, _ in each], [c for _, c in each]
            labels = [f"{c.name}.{kind} lock" for c in coordinates]
            group = switches.HeldCoordinates(self._scale, kind, labels, coordinates)
            # an event's windows are known as the run goes on
            windows = [signals.windows[k.switch] if k.switch else k.active or () for k in locks]
            found.append(switches.Locks(group, windows, scene.t_end))
        return found
