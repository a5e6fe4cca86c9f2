"""Probes: one number each at a point of a body over time."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from typing import Any, NamedTuple, cast

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats, Int32s
from shellmb.model.locations.nodes import is_point, local_nodes, local_point, surrounding
from shellmb.observers.deferred_observer import STEPS, DeferredObserver, Row
from shellmb.observers.fields.modal import ModalNodes, modal_members, readable, resultants_of
from shellmb.observers.fields.nodal import NodalValues, NodeGroup, Nodes, Reading, rotation_vectors
from shellmb.observers.fields.resultants import Resultants, has_resultants
from shellmb.restart import Restartable
from shellmb.scene import Probe, RigidBody
from shellmb.scene.description import Body
from shellmb.simulate.simulation import Simulation

TURN = 2 * math.pi
# from this angle on a rotation vector tells the axis
TELLS = math.pi / 2
# up to this angle across the axis a rotation is a whole turn about it: round-off of directors
ROUND_OFF = 1e-12


class Pose(NamedTuple):
    """A point and its directors in the reference, now, and their velocities.

    Args:
        X: Reference position, shape (3,), m.
        x: Position.
        v: Velocity, m/s.
        D: Reference directors as rows, shape (m, 3).
        d: Directors.
        rate: Their velocities, 1/s.
    """

    X: Floats
    x: Floats
    v: Floats
    D: Floats
    d: Floats
    rate: Floats

    @property
    def spin(self) -> Floats:
        """Angular velocity of a frame in the scene's axes, shape (3,), rad/s."""
        return np.asarray(np.cross(self.d, self.rate).sum(axis=0) / 2)


def packed(values: NodalValues) -> Floats:
    """Sums over nodes of all that a pose consists of, shape (9 + 9 m,)."""
    points = (values.reference, values.position, values.velocity)
    vectors = (values.reference_directors, values.directors, values.director_velocity)
    return np.concatenate([v.sum(axis=0).ravel() for v in (*points, *vectors)])


def unpacked(row: Floats) -> Pose:
    """The pose of `packed` means."""
    X, x, v = row[:9].reshape(3, 3)
    return Pose(X, x, v, *row[9:].reshape(3, -1, 3))


def seen(quantity: str, point: Pose, frame: Pose) -> Floats:
    """A quantity relative to a frame, components along its directors, shape (3,).

    The frame is that of a rigid body, or of a node of a beam. It has its point `p` and its
    directors `d_k`. With `r = x - p` the point is at `d_k . r` in it and moves there with the rate
    of that, `d_k . (v - p') + d_k' . r`: whatever turns with the frame is at rest in it.

    Args:
        quantity: Name of a motion that a probe records.
        point: The point.
        frame: The frame.
    """
    r, d = point.x - frame.x, frame.d
    match quantity:
        case "position":
            return np.asarray(d @ r)
        case "displacement":
            return np.asarray(d @ r - frame.D @ (point.X - frame.X))
        case "velocity":
            return np.asarray(d @ (point.v - frame.v) + frame.rate @ r)
        case "director":
            return np.asarray(d @ point.d[0])
        case "rotation":
            before, now = point.D @ frame.D.T, point.d @ d.T
            return rotation_vectors(before[None], now[None])[0]
        case "angular_velocity":
            return np.asarray(d @ (point.spin - frame.spin))
    raise NotImplementedError(f"no {quantity} in a frame")


class WholeTurns(Restartable):
    """Counts the whole turns of one rotation, whose vector is known up to pi.

    At half a turn a rotation vector goes over from `pi n` to `-pi n`. A continuous one keeps count,

        c = p + 2 pi k m

    with `p` up to pi, whole turns `k` and their axis `m`. That axis follows the one of `p` where
    `p` is long enough to tell; near a whole turn, where `p` is small and has any direction, it
    stays. There `c` keeps the count but is no rotation vector of the rotation. So the result is the
    one next to `c` that is: all of them are `p + 2 pi j p/|p|`. It is so for steps of less than
    half a turn.
    """

    remembered = ("_turns", "_axis", "_last")

    def __init__(self) -> None:
        self._turns, self._axis = 0, np.zeros(3)
        # the last vector, up to pi
        self._last = np.zeros(3)

    def count(self, vector: Floats) -> Floats:
        """The continuous rotation vector, shape (3,), rad.

        Args:
            vector: The rotation vector up to pi, shape (3,), rad.
        """
        size = float(np.linalg.norm(vector))
        axis = vector / (size or 1.0)
        # next to the last one is not it, but what goes on behind half a turn the other way
        passed = bool(axis @ self._last - size < -math.pi)
        if passed or size > TELLS:
            way = -axis if passed else axis
            along = -1 if self._turns and way @ self._axis < 0 else 1
            self._axis = along * way
            self._turns += along * passed
        self._last = vector
        counted = np.asarray(vector + TURN * self._turns * self._axis)
        if np.linalg.norm(vector - vector @ self._axis * self._axis) < ROUND_OFF:
            return counted
        return np.asarray(vector + TURN * round(float(axis @ counted - size) / TURN) * axis)


# sum of what a probe reads over its nodes on this rank, and their number behind it, shape (n + 1,)
type Sum = Callable[[], Floats]
# name of a body in the system, nodes of a point, and arms from them
type Where = tuple[str, NodeGroup, Floats | None]


@dataclass(frozen=True)
class _Spot:
    """A probe where it is.

    Args:
        probe: The probe.
        sums: What it reads, between two steps: its quantity, or its pose and that of a frame; of a
            point between nodes that of each of them.
        weights: Of the nodes that it lies between, shape (nodes,).
        turns: Counts the turns of a rotation; None of other quantities.
        later: Reads its quantity for many steps at a time; None: in each step.
    """

    probe: Probe
    sums: tuple[Sum, ...]
    weights: Floats
    turns: WholeTurns | None
    later: Reading | None

    def vector(self, means: list[Floats]) -> Floats:
        """The quantity by the means of what is read, shape (3,)."""
        count = len(self.weights)
        found = means[0] if count == 1 else self.weights @ np.array(means[:count])
        if self.probe.frame is not None:
            found = seen(self.probe.quantity, unpacked(found), unpacked(means[count]))
        elif self.turns is not None:
            pose = unpacked(found)
            (found,) = rotation_vectors(pose.D[None], pose.d[None])
        return found if self.turns is None else self.turns.count(found)


class Probes(DeferredObserver):
    """Records the probes of the scene, the same on all ranks.

    Motions are those at the end of a step. Forces, moments and other resultants are means over it,
    in statics the values (`Resultants`). Rotations are continuous (`WholeTurns`).
    """

    def __init__(self) -> None:
        super().__init__()
        self._turns: dict[str, WholeTurns] = {}
        self._kept: dict[str, Any] = {}

    @property
    def values(self) -> Row:
        """Value of each probe at the current time, by its name."""
        return self.measure()

    def start(self, simulation: Simulation) -> None:
        """Find the nodes and take the values at the start.

        Raises:
            SceneError: If there is no node at a probe's point.
        """
        self._comm = simulation.model.comm
        self._alone = self._comm.size == 1
        self._resultants: dict[str, Resultants] = {}
        probes = simulation.scene.probes
        for probe in probes:
            if probe.quantity == "rotation":
                self._turns.setdefault(probe.name, WholeTurns())
        self._spots = [self._find(simulation, probe) for probe in probes]
        self._names = [probe.name for probe in probes]
        sizes = [0 if spot.later is None else spot.later.size for spot in self._spots]
        self._numbers = [np.zeros((STEPS, size)) for size in sizes]
        both = zip(self._spots, self._numbers, strict=True)
        self._later = [(spot.later, to) for spot, to in both if spot.later is not None]
        self._at_once = {k: spot for k, spot in enumerate(self._spots) if spot.later is None}
        # of each step: vectors, and the turns so far, which the next vectors have to be next to
        self._vectors = np.zeros((STEPS, len(probes), 3))
        self._counted: list[dict[str, Any]] = [{}] * STEPS
        self.take_accepted(simulation, 0)
        self.begin(*self.book_rows(slice(0, 1)))

    def _find(self, simulation: Simulation, probe: Probe) -> _Spot:
        (given,) = simulation.scene.bodies_of(probe)
        names, weights = places_of(simulation, given.name, probe)
        each = [self._sum(simulation, given, replace(probe, at=at)) for at in names]
        turns, sums = self._turns.get(probe.name), tuple(each)
        if probe.frame is not None:
            who = f"probe '{probe.name}'"
            # a reduced body is seen from its floating frame, and has coordinates for names there
            scene = simulation.model.scene
            seen_from = next(p for p in scene.probes if p.name == probe.name)
            assert seen_from.frame is not None
            frame = plain_spot(simulation, seen_from.frame, seen_from.frame_at, who)
            sums += (partial(_pose, simulation, *frame[1:]),)
        later = getattr(sums[0], "reading", None) if self._comm.size == 1 else None
        return _Spot(probe, sums, weights, turns, None if len(sums) > 1 else later)

    def _sum(self, simulation: Simulation, given: Body, probe: Probe) -> Sum:
        """Reading at one node, or at the nodes of one place."""
        who = f"probe '{probe.name}'"
        body = readable(simulation.model).get(given.name)
        if body is not None and has_resultants(body, probe.quantity):
            if body.name not in self._resultants:
                self._resultants[body.name] = resultants_of(simulation, body)
            nodes = local_nodes(body, cast(Any, probe.at), who)
            return partial(self._resultants[body.name].sums, nodes, probe.quantity)
        _, spot, arms = _spot(simulation, given.name, probe.at, who)
        if probe.frame is None and probe.name not in self._turns:
            return _Total(spot.reader(simulation, probe.quantity, arms), spot.count)
        return partial(_pose, simulation, spot, arms)

    def take_solved(self, simulation: Simulation, row: int) -> None:
        """Means over a step need its start, too."""
        for resultants in self._resultants.values():
            resultants.solved()

    def take_accepted(self, simulation: Simulation, row: int) -> None:
        """Take the vectors."""
        for later, taken in self._later:
            later.take(taken[row])
        if not self._at_once:
            return
        sums = [read() for spot in self._at_once.values() for read in spot.sums]
        if not self._alone:
            flat = np.concatenate(sums)
            self._comm.Allreduce(MPI.IN_PLACE, flat)
            sums = np.split(flat, np.cumsum([len(each) for each in sums])[:-1])
        means = iter([each[:-1] / each[-1] for each in sums])
        for k, spot in self._at_once.items():
            self._vectors[row, k] = spot.vector([*islice(means, len(spot.sums))])
        if self._turns:
            self._counted[row] = {name: turns.state() for name, turns in self._turns.items()}

    def book_rows(self, rows: slice) -> list[Row]:
        """Take the components that are requested."""
        self._kept = self._counted[rows][-1]
        vectors = self._vectors[rows]
        columns = []
        for k, spot in enumerate(self._spots):
            part, each = spot.probe.component, vectors[:, k]
            if spot.later is not None:
                read = spot.later.of(self._numbers[k][rows])
                each[:] = np.add.reduce(read, axis=1) / read.shape[1]
            found = np.sqrt(np.vecdot(each, each)) if part == "norm" else each[:, part]
            columns.append(found.tolist())
        every = zip(*columns, strict=True) if columns else ((),) * len(vectors)
        return [dict(zip(self._names, row, strict=True)) for row in every]

    def kept(self) -> dict[str, Any]:
        """The turns so far."""
        return dict(self._kept)

    def take_up(self, state: dict[str, Any]) -> None:
        """Take them up."""
        self._kept = dict(state)
        for name, turns in state.items():
            self._turns.setdefault(name, WholeTurns()).restore(turns)


def places_of(simulation: Simulation, name: str, probe: Probe) -> tuple[list[Any], Floats]:
    """Places that a probe is read at, and the weights of what is read there; collective.

    Args:
        simulation: The simulation.
        name: Name of its body.
        probe: The probe.

    Returns:
        Its own place, or the nodes that it lies between, and weights, shape (places,).

    Raises:
        SceneError: If it is not on its body.
    """
    body: Any = {**readable(simulation.model), **simulation.model.own}.get(name)
    if body is None or not is_point(probe.at):
        return [probe.at], np.ones(1)
    found, weights = surrounding(body, probe.at, f"probe '{probe.name}'")
    return list(found), weights


def _spot(simulation: Simulation, name: str, point: Any, who: str) -> Where:
    """Name of a body in the system, the nodes of a point on this rank, and its arms there."""
    model = simulation.model
    modal = modal_members(model).get(name)
    if modal is None:
        return plain_spot(simulation, name, point, who)
    nodes, arms = _owned(modal.members[name].body, point, who)
    return name, ModalNodes(model, name, nodes), arms


def plain_spot(
    simulation: Simulation, name: str, point: Any, who: str
) -> tuple[str, Nodes, Floats | None]:
    """Spot on a rigid body, or a body whose nodes are unknowns."""
    model = simulation.model
    described = model.scene.body(name)
    if isinstance(described, RigidBody):
        rigid = model.rigid
        assert rigid is not None
        number = rigid.index[described.name]
        node = rigid.bodies[number]
        offset = node.directors @ (described.place(point) - node.center)
        here = np.flatnonzero(rigid.node_mesh.item == number).astype(np.int32)
        return rigid.name, Nodes(rigid, here), np.tile(offset, (len(here), 1))
    body: Any = {**model.meshed, **model.own}[described.name]
    nodes, arms = _owned(body, point, who)
    return body.name, Nodes(body, nodes), arms


def _owned(body: Any, point: Any, who: str) -> tuple[Int32s, Floats | None]:
    """Nodes of a point, each once, on the rank that owns it, and its arms there."""
    nodes, arms = local_point(body, point, who)
    mine = nodes < body.mixed.subspaces["u"].dofmap.index_map.size_local
    return nodes[mine], None if arms is None else arms[mine]


class _Total:
    """Sum of what nodes have.

    Args:
        read: Reads it, shape (n, 3).
        count: Number of the nodes.

    Attributes:
        reading: Reads them of many steps later, from numbers that were taken; None: nothing does.
    """

    def __init__(self, read: Callable[[], Floats] | Reading, count: int) -> None:
        self._read, self._count = read, count
        self.reading = read if isinstance(read, Reading) else None

    def __call__(self) -> Floats:
        """Sum and number."""
        return np.append(np.add.reduce(self._read()), self._count)


def _pose(simulation: Simulation, nodes: NodeGroup, arms: Floats | None) -> Floats:
    """Sum of poses, and the number of nodes."""
    values = nodes.now(simulation)
    return np.append(packed(values if arms is None else values.at(arms)), nodes.count)
