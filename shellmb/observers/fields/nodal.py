"""Nodal values of a body at the current time: of a shell, a beam, or all rigid bodies."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from shellmb.arrays import Bools, Floats, Int32s, Ints
from shellmb.model.frames.beam import BeamModel
from shellmb.model.frames.rigid import RigidBodies
from shellmb.model.model import Model
from shellmb.model.shells.shell import ShellModel
from shellmb.model.user_bodies.placed import PlacedBody
from shellmb.simulate.simulation import Simulation

# so many nodes of several states are summed at a time
MOST = 20_000


class NodeSums:
    """Sums over nodes: positions first, then directors and what turns like them.

    Args:
        dofs: Of vectors of three: positions and what turns with the body, shape (n, 3).
        reference: Their values where the dofs are zero, shape (n, 3).
        positions: How many of them are positions.
        sized: Of how many of them sizes of forces are added up; None: of positions.
    """

    def __init__(
        self, dofs: Ints, reference: Floats, positions: int, sized: int | None = None
    ) -> None:
        self._dofs, self._reference, self._positions = dofs, reference, positions
        self._sized = positions if sized is None else sized
        # one, what is there in the middle of a step, and what it changes by, side by side
        self._rows = np.ones((len(dofs), 7))

    def resultants(self, q: Floats, whole: float, forces: Floats, counted: Floats) -> Floats:
        """Force, moment about the origin and sum of the sizes of forces at nodes, shape (k, 7).

        Args:
            q: Dofs of states, or changes of them, shape (k, dofs).
            whole: One for states, zero for changes.
            forces: Forces at all dofs of the body, shape (k, dofs).
            counted: One at dofs that count, zero at others.
        """
        found = np.empty((len(q), 7))
        # as many states at a time as memory is there for; each is summed by itself, so that its
        # last digit is the same whatever others are there
        at_once = max(1, MOST // max(1, len(self._dofs)))
        for begin in range(0, len(q), at_once):
            some = slice(begin, begin + at_once)
            force = (counted * forces[some]).take(self._dofs, axis=1)
            x = whole * self._reference + q[some].take(self._dofs, axis=1)
            found[some, :3] = force[:, : self._positions].sum(axis=1)
            products = x.swapaxes(1, 2) @ force
            turning = products - products.swapaxes(1, 2)
            found[some, 3:6] = turning[:, (1, 2, 0), (2, 0, 1)]
            sized = force[:, : self._sized]
            found[some, 6] = np.sqrt(np.vecdot(sized, sized)).sum(axis=1)
        return found

    def rotation_sums(self, directors: int, start: Floats, end: Floats, sums: Floats) -> float:
        """Largest square of the changes of a node's directors in a step; fills the sums.

        Args:
            directors: Number of directors of a node.
            start: Dofs of the body at the start of the step.
            end: Those at its end.
            sums: Number of positions, their sum in the middle of the step, that of their changes,
                and the sums of `x x, x dx, d d, d dd` of positions and directors, shape (43,).
        """
        first, last, n, rows = start[self._dofs], end[self._dofs], self._positions, self._rows
        rows[:, 1:4] = self._reference + (first + last) / 2
        rows[:, 4:] = last - first
        products = rows[:n, :4].T @ rows[:n]
        sums[:7], products = products[0], products[1:]
        for place in (7, 25):
            sums[place : place + 9] = products[:, 1:4].ravel()
            sums[place + 9 : place + 18] = products[:, 4:].ravel()
            products = rows[n:, 1:4].T @ rows[n:]
        change = rows[n:, 4:].reshape(-1, 3 * directors)
        return float(np.vecdot(change, change).max(initial=0.0))


type NodalBody = ShellModel | BeamModel | PlacedBody | RigidBodies


class NodalValues(NamedTuple):
    """Values at the nodes (owned and ghost) of a body on this rank.

    Args:
        reference: Reference positions, shape (n, 3), m.
        displacement: Displacements, shape (n, 3), m.
        reference_directors: Reference directors, shape (n, m, 3): one of a shell, three of frames.
        directors: Directors, shape (n, m, 3).
        velocity: Velocities, shape (n, 3), m/s; zero in statics.
        director_velocity: Velocities of the directors, shape (n, m, 3), 1/s; zero in statics.
    """

    reference: Floats
    displacement: Floats
    reference_directors: Floats
    directors: Floats
    velocity: Floats
    director_velocity: Floats

    @property
    def position(self) -> Floats:
        """Positions, m."""
        return np.asarray(self.reference + self.displacement)

    @property
    def director(self) -> Floats:
        """Directors of a shell, first directors of frames, shape (n, 3)."""
        return np.asarray(self.directors[:, 0])

    @property
    def angular_velocity(self) -> Floats:
        """Angular velocities `d_k x d_k' / 2` of the frames in the scene's axes, shape (n, 3)."""
        return np.asarray(np.cross(self.directors, self.director_velocity).sum(axis=1) / 2)

    def at(self, offsets: Floats) -> NodalValues:
        """Values at points fixed to the frames.

        Args:
            offsets: Their components along the directors, shape (n, 3), m.
        """

        def moved(values: Floats, vectors: Floats) -> Floats:
            return np.asarray(values + np.einsum("nk,nki->ni", offsets, vectors))

        change = self.directors - self.reference_directors
        return NodalValues(
            moved(self.reference, self.reference_directors),
            moved(self.displacement, change),
            self.reference_directors,
            self.directors,
            moved(self.velocity, self.director_velocity),
            self.director_velocity,
        )

    def take(self, nodes: Int32s) -> NodalValues:
        """Values at some of the nodes, in that order; one node may stand there several times."""
        return NodalValues(*(values[nodes] for values in self))


def rotation_vectors(reference: Floats, directors: Floats) -> Floats:
    """Rotation vectors that turn one triple of directors into another, shape (n, 3), rad.

    Args:
        reference: Directors as rows, shape (n, 3, 3).
        directors: The same turned.
    """
    R = np.einsum("nki,nkj->nij", directors, reference)
    trace = np.einsum("nii->n", R)[:, None]
    # a unit quaternion from its largest component, accurate at all angles (S. W. Shepperd,
    # J. Guidance Control 1 (1978) 223): a row of its products, times 4
    products = np.zeros((len(R), 4, 4))
    products[:, :1, 0] = 1 + trace
    products[:, 0, 1:] = (R.mT - R)[:, (1, 2, 0), (2, 0, 1)]
    products[:, 1:, 0] = products[:, 0, 1:]
    products[:, 1:, 1:] = R + R.mT + (1 - trace)[:, None] * np.eye(3)
    largest = np.argmax(np.einsum("nii->ni", products), axis=1)
    quaternions = products[np.arange(len(R)), largest]
    size = np.linalg.norm(quaternions[:, 1:], axis=1)
    sign = np.where(quaternions[:, 0] < 0, -1.0, 1.0)
    angle = 2 * np.arctan2(size, np.abs(quaternions[:, 0]))
    scale = sign * angle / np.where(size > 0, size, 1.0)
    return np.asarray(scale[:, None] * quaternions[:, 1:])


def nodal_bodies(model: Model) -> dict[str, NodalBody]:
    """All bodies with nodes of their own by their names in the system."""
    found: dict[str, NodalBody] = {**model.shells, **model.beams, **model.own}
    if model.rigid is not None:
        found[model.rigid.name] = model.rigid
    return found


def state(simulation: Simulation, body: str) -> Floats:
    """Dofs of a body's current state."""
    return np.asarray(simulation.problem.state(body).x.array)


def nodal_values(simulation: Simulation, name: str) -> NodalValues:
    """Values at the nodes of a body, in the order of the displacement's space.

    Args:
        simulation: The simulation, between two steps.
        name: Name of the body in the system.
    """
    return Nodes(nodal_bodies(simulation.model)[name]).now(simulation)


class Nodes:
    """Nodes whose positions and directors are unknowns.

    Args:
        body: The body.
        which: Numbers of the nodes on this rank; one may stand there several times. None: all.

    Attributes:
        dofs: Dofs of displacements, shape (n, 3), and of directors, shape (n, m, 3).
        directors: Number of directors of each.
    """

    def __init__(self, body: NodalBody, which: Int32s | None = None) -> None:
        here = slice(None) if which is None else which
        X, D = body.node_positions(), body.node_directors()
        self.name, self._X, self._D = body.name, X[here], D[here]
        dofs = body.mixed.dofs
        self._u = dofs["u"].reshape(-1, 3)[here]
        self._w = dofs["w"].reshape(D.shape)[here]
        self.dofs, self.directors = (self._u, self._w), int(D.shape[1])

    def values(self, q: Floats, velocity: Floats | None = None) -> NodalValues:
        """Values at the nodes, in their order.

        Args:
            q: Dofs of the state.
            velocity: Dofs of its rate; None: at rest.
        """
        v = np.zeros_like(q) if velocity is None else velocity
        return NodalValues(
            self._X, q[self._u], self._D, self._D + q[self._w], v[self._u], v[self._w]
        )

    def dofs_of(self, marked: Bools) -> Int32s:
        """Dofs of some of the nodes.

        Args:
            marked: Which, shape (n,).
        """
        return np.concatenate([self._u[marked].ravel(), self._w[marked].ravel()])

    def sums(self) -> NodeSums:
        """Sums over the nodes."""
        dofs = np.concatenate([self._u, self._w.reshape(-1, 3)]).astype(np.int64)
        reference = np.concatenate([self._X, self._D.reshape(-1, 3)])
        return NodeSums(dofs, reference, len(self._X))

    @property
    def reference(self) -> Floats:
        """Position and directors of each in the reference, one behind the other, (n (1 + m), 3)."""
        return np.concatenate([self._X[:, None], self._D], axis=1).reshape(-1, 3)

    def now(self, simulation: Simulation) -> NodalValues:
        """Values at the nodes, between two steps of a simulation."""
        rates = simulation.problem.levels[self.name].rates
        v = np.asarray(rates["v"].x.array) if "v" in rates else None
        return self.values(state(simulation, self.name), v)
