"""Rotations of bodies in a step: of each as a whole, and at its nodes.

For a body that turns by the angle `a` about `n`, the change of its nodes over a step is
`2 tan(a/2) n x` of what they are in the middle of it, relative to its centre. So the best fit of
`v = w x r` to the changes of positions and directors gives the angle of a rotation of any size,
and of a deforming body its mean. A part of the body may turn by more: the directors of the nodes
tell.
"""

import math
from dataclasses import dataclass
from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats
from shellmb.model.frames.rigid import RigidBodies
from shellmb.observers.deferred import STEPS, Booked, DeferredObserver, Row, SharedTable
from shellmb.observers.fields.nodal import Nodes, NodeSums
from shellmb.scene.multibody.joints import GROUND
from shellmb.simulate.simulation import Simulation

# the square of the way of a wave in a step over the radius, at which a body loses half of what one
# loses that does not stretch (`diagnostics.steps`)
HALF_STIFF = 40.0
# of the diagonal, so that what does not turn at all has a fit, too
TINY = 1e-12
UNIT = np.eye(3)

# dofs of a body at the start and at the end of a step
type Ends = tuple[Floats, Floats]


@dataclass
class Turn:
    """Rotation of a body of the scene.

    Args:
        angle: Largest angle of the body or of a part of it in the last step, rad.
        mean: Angle of the body as a whole in the last step, rad.
        radius: Radius of gyration of its nodes about the axis of the last step, m.
        largest: Largest `angle` so far, rad.
        t: Time at the end of the step with that, s.
        dt: Length of that step, s.
        total: Sum of the angles `mean` of all steps so far, rad.
        speed: Speed of waves in the body, m/s; zero: what stiff bodies lose is of no interest.
        stiff: Sum of `mean^2` over the steps, each times the part of it that a body loses which is
            as stiff (`diagnostics.steps`).
    """

    angle: float = 0.0
    mean: float = 0.0
    radius: float = 0.0
    largest: float = 0.0
    t: float = 0.0
    dt: float = 0.0
    total: float = 0.0
    speed: float = 0.0
    stiff: float = 0.0

    def add(self, angle: float, mean: float, radius: float, t: float, dt: float) -> None:
        """Add a step."""
        self.angle, self.mean, self.radius = max(angle, mean), mean, radius
        self.total += mean
        if radius > 0 and self.speed > 0:
            self.stiff += mean**2 / (1 + HALF_STIFF * (radius / (self.speed * dt)) ** 2)
        if self.angle > self.largest:
            self.largest, self.t, self.dt = self.angle, t, dt


class BodyRotations(DeferredObserver):
    """Follows how all bodies of a dynamic scene turn.

    Attributes:
        turns: Rotations, by name of the body in the scene.
    """

    turns = Booked[dict[str, Turn]]()
    remembered = ("_turns",)

    def __init__(self) -> None:
        super().__init__()
        self._turns: dict[str, Turn] = {}

    def start(self, simulation: Simulation) -> None:
        """Find the nodes."""
        model, problem = simulation.model, simulation.problem
        # names of shells and beams, nodes of them that this rank owns, and their directors
        self._flexible: list[tuple[str, NodeSums, int, Ends]] = []
        self._rigid: list[_Frames] = []
        # of each step its end and length
        self._when = [(0.0, 0.0)] * STEPS
        if "v" not in simulation.scheme.rates:
            return

        def ends(name: str) -> Ends:
            levels = problem.levels[name]
            return levels.q.x.array, levels.unknown[problem.last].x.array

        if model.rigid is not None:
            self._rigid = [_Frames(model.rigid, ends(model.rigid.name), model.comm)]
        for name, body in model.meshed.items():
            index_map = body.mixed.space.dofmap.index_map
            first = body.mixed.dofs["u"].reshape(-1, 3)[:, 0]
            mine = np.flatnonzero(first < index_map.size_local).astype(np.int32)
            nodes = Nodes(body, mine)
            self._flexible.append((name, nodes.sums(), nodes.directors, ends(name)))
        names = [*model.meshed, *(name for frames in self._rigid for name in frames.names)]
        self._turns = {name: Turn() for name in names} | self._turns
        # chords and sums of flexible bodies
        self._sums = np.zeros((STEPS, len(self._flexible), 44))

    def take_solved(self, simulation: Simulation, row: int) -> None:
        """Take what turns in the step: both of its ends are at hand."""
        last = simulation.last
        if last is None or not self._turns:
            return
        self._when[row] = last.t + last.dt, last.dt
        comm = simulation.model.comm
        for k, (_, nodes, directors, ends) in enumerate(self._flexible):
            sums = self._sums[row, k]
            square = nodes.rotation_sums(directors, *ends, sums[1:])
            # the largest chord of the nodes
            sums[0] = math.sqrt(square / _directions(directors))
            if comm.size > 1:
                comm.Allreduce(MPI.IN_PLACE, sums[1:])
                sums[0] = comm.allreduce(sums[0], op=MPI.MAX)
        for frames in self._rigid:
            frames.take(row)

    def book_rows(self, rows: slice) -> list[Row]:
        """Add the angles of the steps."""
        when = self._when[rows]
        if self._turns:
            for k, (who, *_) in enumerate(self._flexible):
                turn = self._turns[who]
                chords = map(_angle, self._sums[rows, k, 0].tolist())
                found = (part.tolist() for part in fit(self._sums[rows, k, 1:]))
                for angle, mean, radius, (t, dt) in zip(chords, *found, when, strict=True):
                    turn.add(angle, mean, radius, t, dt)
            for frames in self._rigid:
                for name, each in zip(frames.names, frames.of(rows).T.tolist(), strict=True):
                    turn = self._turns[name]
                    for angle, (t, dt) in zip(map(_angle, each), when, strict=True):
                        # no part of it turns by more
                        turn.add(angle, angle, 0.0, t, dt)
        return [{} for _ in when]

    def take_up(self, state: dict[str, Any]) -> None:
        """Take up findings so far."""
        self._turns = {name: Turn(**values) for name, values in state["turns"].items()}


class _Frames:
    """The rigid bodies.

    Args:
        body: The rigid bodies of the model.
        ends: Their dofs.
        comm: Communicator.

    Attributes:
        names: Names of all but ground.
    """

    def __init__(self, body: RigidBodies, ends: Ends, comm: MPI.Comm) -> None:
        self._start, self._end = ends
        self.names = [rigid.name for rigid in body.bodies if rigid.name != GROUND]
        place = {name: k for k, name in enumerate(self.names)}
        found = [(place.get(body.bodies[k].name), n) for n, k in enumerate(body.node_mesh.item)]
        here = [pair for pair in found if pair[0] is not None]
        self._places, rows = np.array(here, dtype=np.intp).reshape(-1, 2).T
        self._dofs = Nodes(body).dofs[1][rows].reshape(len(rows), 9)
        # changes of the dofs in each step, and chords of the bodies
        self._changes = np.zeros((STEPS, len(self._start)))
        self._chords = SharedTable(comm, (len(self.names),), MPI.MAX)

    def take(self, row: int) -> None:
        """Take the changes of a step; collective."""
        np.subtract(self._end, self._start, out=self._changes[row])
        self._chords.take(row, self._find)

    def of(self, rows: slice) -> Floats:
        """Chord of each body in some steps, shape (k, n)."""
        return self._chords.of(rows, self._find)

    def _find(self, rows: slice, chords: Floats) -> None:
        # in one order, however many steps there are: sums in another one differ in their last digit
        turned = np.ascontiguousarray(self._changes[rows][:, self._dofs])
        chords[:, self._places] = np.sqrt(np.vecdot(turned, turned) / _directions(3))


def fit(sums: Floats) -> tuple[Floats, Floats]:
    """Angles of a body as a whole, rad, and its radii of gyration about the axes, m, of some steps.

    Args:
        sums: Of its nodes, as from `NodeSums.rotation_sums`, shape (k, 43).
    """
    count, x, dx = sums[:, :1], sums[:, 1:4], sums[:, 4:7]
    xx, xdx, dd, ddd = sums[:, 7:].reshape(-1, 4, 3, 3).swapaxes(0, 1)
    over = x[:, :, None] / count[:, :, None]
    about, moved = _inertia(xx - over * x[:, None]), xdx - over * dx[:, None]
    size = about.trace(axis1=1, axis2=2) / (2 * count[:, 0])
    there = size > 0
    share = 1 / np.where(there, size, 1.0)[:, None, None]
    # of `dr = w x r`
    inertia = share * about + _inertia(dd)
    inertia += TINY * inertia.max(axis=(1, 2), keepdims=True) * UNIT
    turned = share * moved + ddd
    axial = (turned - turned.swapaxes(1, 2))[:, (1, 2, 0), (2, 0, 1)]
    spin = np.zeros(x.shape)
    spin[there] = np.linalg.solve(inertia[there], axial[there, :, None])[:, :, 0]
    tangent = np.sqrt(np.vecdot(spin, spin))
    # of nodes on the axis there may be less than nothing, by round-off
    square = np.maximum(np.vecdot(np.vecdot(about, spin[:, None]), spin), 0.0)
    radius = np.sqrt(square / count[:, 0]) / np.where(tangent > 0, tangent, np.inf)
    return 2 * np.arctan(tangent / 2), radius


def _inertia(squares: Floats) -> Floats:
    """`sum (r.r I - r r)` of `sum r r`, shape (k, 3, 3)."""
    trace = squares.trace(axis1=1, axis2=2)[:, None, None]
    return np.asarray(trace * UNIT - squares)


def _directions(directors: int) -> int:
    """Number of directions of a node that turn: of a triple two of three see the same rotation."""
    return 2 if directors == 3 else 1


def _angle(chord: float) -> float:
    """Angle that belongs to a chord of the unit circle, rad."""
    return 2 * math.asin(min(chord / 2, 1.0))
