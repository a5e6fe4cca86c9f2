"""Probes: one number each at a point of a body over time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from itertools import islice, pairwise
from typing import Any, NamedTuple

import numpy as np

from shellmb.arrays import Floats, Int32s
from shellmb.model.locations.nodes import is_point, local_nodes, local_point, surrounding
from shellmb.model.model import Model
from shellmb.observers.deferred import STEPS, DeferredObserver, Row, SharedTable, StepValues
from shellmb.observers.fields.modal import ModalNodes, modal_members, readable, resultants_of
from shellmb.observers.fields.nodal import Nodes, rotation_vectors, state
from shellmb.observers.fields.resultants import Resultants
from shellmb.restart import Restartable
from shellmb.scene import Probe
from shellmb.simulate.simulation import Simulation

TURN = 2 * math.pi
# from this angle on a rotation vector tells the axis
TELLS = math.pi / 2
# up to this angle across the axis a rotation is a whole turn about it: round-off of directors
ROUND_OFF = 1e-12


class Pose(NamedTuple):
    """A point and its directors in the reference, now, and their velocities, in some steps.

    Args:
        X: Reference positions, shape (k, 3), m.
        change: Displacements.
        v: Velocities, m/s.
        D: Reference directors as rows, shape (k, m, 3).
        d: Directors.
        rate: Their velocities, 1/s.
    """

    X: Floats
    change: Floats
    v: Floats
    D: Floats
    d: Floats
    rate: Floats

    @property
    def spin(self) -> Floats:
        """Angular velocities of a frame in the scene's axes, rad/s."""
        # `sum d x (w x d) = (tr M - M) w`: directors that are interpolated are no unit vectors
        M = self.d.mT @ self.d
        inertia = np.einsum("kii->k", M)[:, None, None] * np.eye(3) - M
        moment = np.cross(self.d, self.rate).sum(axis=1)
        return np.asarray(np.linalg.solve(inertia, moment[..., None])[..., 0])


def posed(rows: Floats) -> Pose:
    """The pose at a spot in some steps, of what is read there, shape (k, 3, 1 + m, 3)."""
    X, change, v = rows[:, :, 0].swapaxes(0, 1)
    D, turn, rate = rows[:, :, 1:].swapaxes(0, 1)
    return Pose(X, change, v, D, D + turn, rate)


# the frame of what is seen from space
STILL, UNIT = np.zeros((1, 3)), np.eye(3)[None]
SPACE = Pose(STILL, STILL, STILL, UNIT, UNIT, 0 * UNIT)


def seen(quantity: str, point: Pose, frame: Pose = SPACE) -> Floats:
    """A quantity relative to a frame, components along its directors, shape (k, 3).

    The frame is that of a rigid body, or of a node of a beam. It has its point `p` and its
    directors `d_k`. With `r = x - p` the point is at `d_k . r` in it and moves there with the rate
    of that, `d_k . (v - p') + d_k' . r`: whatever turns with the frame is at rest in it.

    Args:
        quantity: Name of a motion that a probe records.
        point: The point.
        frame: The frame.
    """
    R, moved, d = point.X - frame.X, point.change - frame.change, frame.d

    def along(axes: Floats, vectors: Floats) -> Floats:
        return np.asarray(np.einsum("kij,k...j->k...i", axes, vectors))

    match quantity:
        case "position":
            return along(d, R + moved)
        case "displacement":
            return along(d, moved) + along(d - frame.D, R)
        case "velocity":
            return along(d, point.v - frame.v) + along(frame.rate, R + moved)
        case "director":
            return along(d, point.d[:, 0])
        case "rotation":
            return rotation_vectors(along(frame.D, point.D), along(d, point.d))
        case "angular_velocity":
            return along(d, point.spin - frame.spin)
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


class Spot(NamedTuple):
    """A point of a body: values at its nodes on this rank times weights add up to those there.

    Args:
        body: Name of the body in the system.
        nodes: The nodes, each on the rank that owns it.
        arms: Components along their directors of arms from the nodes, shape (n, m), m; None: none.
        weights: Weights, shape (n,), whose sum over the ranks is 1.
    """

    body: str
    nodes: Nodes | ModalNodes
    arms: Floats | None
    weights: Floats

    def reads(self, simulation: Simulation) -> SpotVectors | StepValues:
        """Reads what a pose is of, the part of this rank, of each step."""
        if isinstance(self.nodes, Nodes):
            return SpotVectors(self, simulation)
        nodes, arms, weights = self.nodes, self.arms, self.weights

        def find() -> Floats:
            now = nodes.now(simulation)
            now = now if arms is None else now.at(arms)
            points = (now.reference, now.displacement, now.velocity)
            turned = now.directors - now.reference_directors
            vectors = (now.reference_directors, turned, now.director_velocity)
            both = np.concatenate([np.stack(points)[:, :, None], np.stack(vectors)], axis=2)
            return np.asarray(np.einsum("n,pnjx->pjx", weights, both))

        return StepValues(find)


class SpotVectors:
    """Position and directors at a spot by numbers of its nodes, which are taken in each step.

    They are linear in the unknowns: `shares @ q[dofs]`, and so are their rates.

    Args:
        spot: The spot, at nodes whose positions and directors are unknowns.
        simulation: The simulation.
    """

    def __init__(self, spot: Spot, simulation: Simulation) -> None:
        assert isinstance(spot.nodes, Nodes)
        self.dofs, self.shares = linear(spot)
        self._reference = self.shares @ spot.nodes.reference
        rates = simulation.problem.levels[spot.body].rates
        arrays = [state(simulation, spot.body), *([rates["v"].x.array] if "v" in rates else [])]
        self._arrays, self._places = arrays, self.dofs.ravel().astype(np.intp)
        self._taken = np.zeros((STEPS, 2, self.dofs.size))

    def take(self, row: int) -> None:
        """Take the numbers of a step."""
        for array, taken in zip(self._arrays, self._taken[row], strict=False):
            array.take(self._places, out=taken, mode="clip")

    def of(self, rows: slice) -> Floats:
        """Reference, changes and rates in some steps, shape (k, 3, 1 + m, 3)."""
        # a rank may have none of the nodes: the number of steps does not follow from the numbers
        moved = self.shares @ self._taken.reshape(STEPS, 2, *self.dofs.shape)[rows]
        reference = np.broadcast_to(self._reference, (len(moved), 1, *self._reference.shape))
        return np.concatenate([reference, moved], axis=1)


def linear(spot: Spot) -> tuple[Int32s, Floats]:
    """Dofs of vectors at the nodes of a spot, and their shares in its position and directors.

    Args:
        spot: The spot, at nodes whose positions and directors are unknowns.

    Returns:
        Dofs, shape (n (1 + m), 3), and shares, shape (1 + m, n (1 + m)).
    """
    assert isinstance(spot.nodes, Nodes)
    u, w = spot.nodes.dofs
    dofs = np.concatenate([u[:, None], w], axis=1)
    count, size = dofs.shape[:2]
    shares = np.einsum("n,jk->jnk", spot.weights, np.eye(size))
    if spot.arms is not None:
        shares[0, :, 1:] = spot.weights[:, None] * spot.arms
    return dofs.reshape(-1, 3), shares.reshape(size, count * size)


class _Recorded(NamedTuple):
    """A probe as it is read.

    Args:
        probe: The probe.
        reads: Take the part of this rank in each step: of the pose of its point and of that of a
            frame, or of its quantity.
        turns: Counts the turns of a rotation; None of other quantities.
    """

    probe: Probe
    reads: tuple[SpotVectors | StepValues, ...]
    turns: WholeTurns | None = None

    def column(self, parts: Sequence[Floats]) -> Floats:
        """The component that is recorded, of some steps.

        Args:
            parts: What is read, of each of the steps, of all ranks.
        """
        found = parts[0] if parts[0].ndim == 2 else seen(self.probe.quantity, *map(posed, parts))
        if self.turns is not None:
            found = np.array([self.turns.count(vector) for vector in found])
        part = self.probe.component
        return np.sqrt(np.vecdot(found, found)) if part == "norm" else found[:, part]


class Probes(DeferredObserver):
    """Records the probes of the scene, the same on all ranks.

    Motions are those at the end of a step. Forces, moments and other resultants are means over it,
    in statics the values (`Resultants`). Rotations are continuous (`WholeTurns`).
    """

    def __init__(self) -> None:
        super().__init__()
        self._turns: dict[str, WholeTurns] = {}

    @property
    def values(self) -> Row:
        """Value of each probe at the current time, by its name."""
        return self.measure()

    def start(self, simulation: Simulation) -> None:
        """Find the nodes and take the values at the start.

        Raises:
            SceneError: If there is no node at a probe's point.
        """
        self._resultants: dict[str, Resultants] = {}
        probes = simulation.scene.probes
        for probe in probes:
            if probe.quantity == "rotation":
                self._turns.setdefault(probe.name, WholeTurns())
        self._recorded = [self._find(simulation, probe) for probe in probes]
        self._reads = [each for recorded in self._recorded for each in recorded.reads]
        for each in self._reads:
            each.take(0)
        # numbers of all ranks, of what is read one behind the other
        shapes = [each.of(slice(0, 1)).shape[1:] for each in self._reads]
        ends = np.cumsum([0, *map(math.prod, shapes)]).tolist()
        self._places = [slice(*pair) for pair in pairwise(ends)]
        self._shapes, self._sums = shapes, SharedTable(simulation.model.comm, (ends[-1],))
        self._sums.take(0, self._add)
        self.begin(*self.book_rows(slice(0, 1)))

    def _find(self, simulation: Simulation, probe: Probe) -> _Recorded:
        model, who = simulation.model, f"probe '{probe.name}'"
        (given,) = simulation.scene.bodies_of(probe)
        body = readable(model).get(given.name)
        if body is not None and probe.quantity in given.quantities:
            if body.name not in self._resultants:
                self._resultants[body.name] = resultants_of(simulation, body)
            resultants, places = self._resultants[body.name], places_of(body, probe.at, who)
            nodes = [(local_nodes(body, at, who), share) for at, share in places]
            weights = resultants.weights(nodes)
            return _Recorded(probe, (StepValues(partial(resultants.at, weights, probe.quantity)),))
        spots = [spot_of(model, given.name, probe.at, who)]
        if probe.frame is not None:
            # a reduced body is seen from its floating frame, and has coordinates for names there
            seen_from = next(p for p in model.scene.probes if p.name == probe.name)
            assert seen_from.frame is not None
            spots.append(spot_of(model, seen_from.frame, seen_from.frame_at, who, framed=True))
        reads = tuple(spot.reads(simulation) for spot in spots)
        return _Recorded(probe, reads, self._turns.get(probe.name))

    def take_solved(self, simulation: Simulation, row: int) -> None:
        """Means over a step need its start, too."""
        for resultants in self._resultants.values():
            resultants.solved()

    def take_accepted(self, simulation: Simulation, row: int) -> None:
        """Take what is read."""
        for each in self._reads:
            each.take(row)
        self._sums.take(row, self._add)

    def _add(self, rows: slice, sums: Floats) -> None:
        """Add the parts of this rank in some steps."""
        for each, place in zip(self._reads, self._places, strict=True):
            sums[:, place] = each.of(rows).reshape(len(sums), -1)

    def book_rows(self, rows: slice) -> list[Row]:
        """Find the components that are requested."""
        sums, columns = self._sums.of(rows, self._add), dict[str, list[float]]()
        every = zip(self._places, self._shapes, strict=True)
        parts = iter([sums[:, place].reshape(-1, *shape) for place, shape in every])
        for each in self._recorded:
            found = each.column([*islice(parts, len(each.reads))])
            columns[each.probe.name] = found.tolist()
        each_step = zip(*columns.values(), strict=True) if columns else ((),) * len(sums)
        return [dict(zip(columns, row, strict=True)) for row in each_step]

    def kept(self) -> dict[str, Any]:
        """The turns so far."""
        return {name: turns.state() for name, turns in self._turns.items()}

    def take_up(self, state: dict[str, Any]) -> None:
        """Take them up."""
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
    rigid = None if modal else model.rigid
    if rigid is not None and name in rigid.index:
        described: Any = model.scene.body(name)
        number = rigid.index[name]
        node = rigid.bodies[number]
        offset = node.axes.T @ (described.place(at) - node.center)
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
