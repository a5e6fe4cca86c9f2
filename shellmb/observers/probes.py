"""Probes: one number each at a point of a body over time."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import Any, NamedTuple

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats
from shellmb.model.locations.nodes import is_point, local_nodes, local_point, surrounding
from shellmb.model.model import Model
from shellmb.observers.deferred_observer import STEPS, DeferredObserver, Row
from shellmb.observers.fields.modal import ModalNodes, modal_members, readable, resultants_of
from shellmb.observers.fields.nodal import NodalValues, Nodes, Reading, rotation_vectors
from shellmb.observers.fields.resultants import Resultants, has_resultants
from shellmb.restart import Restartable
from shellmb.scene import Probe, RigidBody
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


def packed(values: NodalValues, weights: Floats) -> Floats:
    """All that a pose consists of, from values at nodes times weights, shape (9 + 9 m,)."""
    points = (values.reference, values.position, values.velocity)
    vectors = (values.reference_directors, values.directors, values.director_velocity)
    return np.concatenate([np.einsum("n,n...->...", weights, v).ravel() for v in points + vectors])


def unpacked(row: Floats) -> Pose:
    """The pose of what was `packed`."""
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


@dataclass(frozen=True)
class Spot:
    """A point of a body: values at its nodes on this rank times weights add up to those there.

    Args:
        body: Name of the body in the system.
        nodes: The nodes, each on the rank that owns it.
        arms: Components along their directors of arms from the nodes, shape (n, 3), m; None: none.
        weights: Weights, shape (n,), whose sum over the ranks is 1.
    """

    body: str
    nodes: Nodes | ModalNodes
    arms: Floats | None
    weights: Floats

    def pose(self, simulation: Simulation) -> Floats:
        """Part of this rank in the `packed` pose between two steps; collective."""
        values = self.nodes.now(simulation)
        return packed(values if self.arms is None else values.at(self.arms), self.weights)


type Read = Callable[[], Floats]


@dataclass(frozen=True)
class _Recorded:
    """A probe as it is read.

    Args:
        probe: The probe.
        reads: Give the part of this rank, between two steps: of its quantity, or of its pose and
            that of a frame.
        turns: Counts the turns of a rotation; None of other quantities.
        later: Reads vectors of nodes for many steps at a time, and their weights; None: it is read
            in each step.
    """

    probe: Probe
    reads: tuple[Read, ...]
    turns: WholeTurns | None = None
    later: tuple[Reading, Floats] | None = None

    def vector(self, found: Floats, frame: Floats | None = None) -> Floats:
        """The quantity by what is read, shape (3,)."""
        if frame is not None:
            found = seen(self.probe.quantity, unpacked(found), unpacked(frame))
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
        self._recorded = [self._find(simulation, probe) for probe in probes]
        self._names = [probe.name for probe in probes]
        # numbers of steps that vectors are read from later
        self._later = {
            k: (*each.later, np.zeros((STEPS, each.later[0].size)))
            for k, each in enumerate(self._recorded)
            if each.later is not None
        }
        self._at_once = {k: e for k, e in enumerate(self._recorded) if e.later is None}
        # of each step: vectors, and the turns so far, which the next vectors have to be next to
        self._vectors = np.zeros((STEPS, len(probes), 3))
        self._counted: list[dict[str, Any]] = [{}] * STEPS
        self.take_accepted(simulation, 0)
        self.begin(*self.book_rows(slice(0, 1)))

    def _find(self, simulation: Simulation, probe: Probe) -> _Recorded:
        model, who = simulation.model, f"probe '{probe.name}'"
        (given,) = simulation.scene.bodies_of(probe)
        body = readable(model).get(given.name)
        if body is not None and has_resultants(body, probe.quantity):
            if body.name not in self._resultants:
                self._resultants[body.name] = resultants_of(simulation, body)
            resultants, places = self._resultants[body.name], places_of(body, probe.at, who)
            nodes = [(local_nodes(body, at, who), share) for at, share in places]
            weights = resultants.weights(nodes)
            return _Recorded(probe, (partial(resultants.at, weights, probe.quantity),))
        spot, turns = spot_of(model, given.name, probe.at, who), self._turns.get(probe.name)
        if probe.frame is not None:
            # a reduced body is seen from its floating frame, and has coordinates for names there
            seen_from = next(p for p in model.scene.probes if p.name == probe.name)
            assert seen_from.frame is not None
            frame = spot_of(model, seen_from.frame, seen_from.frame_at, who, framed=True)
            reads = tuple(partial(each.pose, simulation) for each in (spot, frame))
            return _Recorded(probe, reads, turns)
        if turns is not None:
            return _Recorded(probe, (partial(spot.pose, simulation),), turns)
        read = spot.nodes.reader(simulation, probe.quantity, spot.arms)
        later = (read, spot.weights) if isinstance(read, Reading) and self._alone else None
        return _Recorded(probe, (lambda: spot.weights @ read(),), later=later)

    def take_solved(self, simulation: Simulation, row: int) -> None:
        """Means over a step need its start, too."""
        for resultants in self._resultants.values():
            resultants.solved()

    def take_accepted(self, simulation: Simulation, row: int) -> None:
        """Take the vectors."""
        for later, _, taken in self._later.values():
            later.take(taken[row])
        if not self._at_once:
            return
        found = [read() for each in self._at_once.values() for read in each.reads]
        if not self._alone:
            flat = np.concatenate(found)
            self._comm.Allreduce(MPI.IN_PLACE, flat)
            found = np.split(flat, np.cumsum([len(each) for each in found])[:-1])
        numbers = iter(found)
        for k, each in self._at_once.items():
            self._vectors[row, k] = each.vector(*islice(numbers, len(each.reads)))
        if self._turns:
            self._counted[row] = {name: turns.state() for name, turns in self._turns.items()}

    def book_rows(self, rows: slice) -> list[Row]:
        """Take the components that are requested."""
        self._kept = self._counted[rows][-1]
        vectors = self._vectors[rows]
        for k, (later, weights, taken) in self._later.items():
            vectors[:, k] = weights @ later.of(taken[rows])
        columns = []
        for each, found in zip(self._recorded, vectors.swapaxes(0, 1), strict=True):
            part = each.probe.component
            column = np.sqrt(np.vecdot(found, found)) if part == "norm" else found[:, part]
            columns.append(column.tolist())
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


def places_of(body: Any, at: Any, who: str) -> list[tuple[Any, float]]:
    """Places on a shell, a beam or a body with nodes that a point is read at; collective.

    Args:
        body: The body.
        at: The point.
        who: Who asks, for the error.

    Returns:
        The point itself, or the nodes that it lies between, each with the weight of what is read
        there.

    Raises:
        SceneError: If it is not on the body.
    """
    if not is_point(at):
        return [(at, 1.0)]
    places, weights = surrounding(body, at, who)
    return list(zip(places, weights.tolist(), strict=True))


def spot_of(model: Model, name: str, at: Any, who: str, framed: bool = False) -> Spot:
    """Nodes that a point of a body is read at; collective.

    Args:
        model: The bodies.
        name: Name of the body in the scene.
        at: The point.
        who: Who asks, for the error.
        framed: Whether the point of a reduced body is one of its floating frame.

    Raises:
        SceneError: If there is no node at the point.
    """
    # of shells that are reduced together the scene of the model has the first
    modal = name in modal_members(model) and not framed
    if not modal and isinstance(described := model.scene.body(name), RigidBody):
        rigid = model.rigid
        assert rigid is not None
        number = rigid.index[described.name]
        node = rigid.bodies[number]
        offset = node.directors @ (described.place(at) - node.center)
        here = np.flatnonzero(rigid.node_mesh.item == number).astype(np.int32)
        count = len(here)
        return Spot(rigid.name, Nodes(rigid, here), np.tile(offset, (count, 1)), np.ones(count))
    body: Any = {**readable(model), **model.own}[name]
    owned = body.mixed.subspaces["u"].dofmap.index_map.size_local
    places = places_of(body, at, who)
    found = [local_point(body, place, who) for place, _ in places]
    mine = [nodes < owned for nodes, _ in found]
    counts = model.comm.allreduce(np.array([np.sum(each) for each in mine]))
    shares = zip(mine, places, counts, strict=True)
    weights = np.concatenate([np.full(np.sum(m), share / n) for m, (_, share), n in shares])
    which = np.concatenate([each[m] for (each, _), m in zip(found, mine, strict=True)])
    # what has arms has a name
    arms = None if found[0][1] is None else found[0][1][mine[0]]
    nodes = ModalNodes(model, name, which) if modal else Nodes(body, which)
    return Spot(body.name, nodes, arms, weights)
