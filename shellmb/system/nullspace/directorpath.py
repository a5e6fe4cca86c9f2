"""Directors over a step that is quadratic in time: what their forces and increments are tangent to.

At the end of a step directors `d` and their velocities `V` (times the step) obey `g(d) = 0` and
`C(d) V = 0`, `C` being the derivative of `g`, which is linear in `d`. Increments are columns of

    Z = [ T_d, 0; -C(d)^+ C(V) T_d, T_d ],       C(d) T_d = 0.

The forces of the multipliers of both rows act along the columns of (eq. Q4)

    G = [ C(x)^T, C(s)^T; C(D)^T/6, C(m)^T ]

with mean `x`, mean velocity `s`, chord `D` and middle `m` of the path. Tests are the columns of
`Y` with `G^T Y = 0`: those of single directors at `x` and at `m`, corrected along
`C(x)^+` and `C(m)^+`.

Directors without inertia obey `g(d) = 0` at the middle in place of `C(d) V = 0`, and have other
`s`, `m` and increments for it (`MasslessPath`).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from shellmb.arrays import Bools, Floats, Int32s
from shellmb.native import library as native
from shellmb.system.nullspace.directors import (
    any_pseudo_inverse,
    constraint,
    null_space,
    orthonormal,
    pseudo_inverse,
    violation,
)


class Bases(NamedTuple):
    """Tangent spaces of nodes; vectors of nodes that have fewer than others are zero.

    Args:
        right: Increments, shape (n, 3 k, m).
        left: Test vectors, shape (n, 3 k, m).
        forces: What makes multipliers of forces, `(C^T)^+`, shape (n, 3 k, c).
        right_other: Of rates, their change with the increments of the state, shape (n, 3 k, m).
        left_other: Over a path, tests of the field in the equations of the other one.
        forces_other: Over a path, what makes multipliers of the other field of forces.
    """

    right: Floats
    left: Floats
    forces: Floats
    right_other: Floats | None = None
    left_other: Floats | None = None
    forces_other: Floats | None = None


class NodeBases:
    """Bases of nodes in a step, by a loop of `bases.c`.

    Args:
        loop: Its name.
        counts: Numbers of tangent spaces, and of what makes multipliers of forces.
        held: Nodes whose directors are given, shape (n,): they have none.
        dofs: Local dofs of the nodes, shape (n, 3 k).
        reference: Directors where the values are zero, shape (n, 3 k).
        values: Numbers of all local dofs: directors at the start and their velocities there times
            the step, directors at the end and their velocities there.
        weights: Weights of these in the states that the loop takes, shape (states, 4).

    Attributes:
        found: The bases, shape (n, 3 k, vectors) each.
    """

    def __init__(
        self,
        loop: str,
        counts: tuple[int, int],
        held: Bools,
        dofs: Int32s,
        reference: Floats,
        values: Sequence[Floats],
        weights: Sequence[Floats],
    ) -> None:
        pointer, (nodes, size) = native.CArrays(), dofs.shape
        widths = np.repeat((2, 1) if size == 3 else (3, 6), counts)
        self.found = [np.zeros((nodes, size, width)) for width in widths]
        given = {
            "dofs": pointer(dofs.astype(np.int64)),
            "reference": pointer(np.array(reference, dtype=float)),
            "values": [pointer(one) for one in values],
            "weights": pointer(np.array(weights, dtype=float)),
        }
        marks = held.astype(np.uint8)
        self._kept = pointer, marks
        where = pointer.many("PathNodes", [given]), native.bytes_of(marks)
        out = pointer.many("double *", [pointer(values) for values in self.found])
        self._loop = getattr(native.cells().lib, loop)
        self._arguments = nodes, size // 3, *where, out

    def __call__(self) -> None:
        """Find them at the current state."""
        self._loop(*self._arguments)


class PathDirectors(NamedTuple):
    """States of the directors of a step, shape (n, 3 k) each.

    Args:
        start: Directors at the start.
        start_velocity: Their velocities there times the step.
        end: Directors at the end.
        rate: Their velocities there times the step.
        alpha: Dissipation.
    """

    start: Floats
    start_velocity: Floats
    end: Floats
    rate: Floats
    alpha: float

    def of(self, node: int) -> "PathDirectors":
        """Path of one node."""
        one = slice(node, node + 1)
        states = self.start[one], self.start_velocity[one], self.end[one], self.rate[one]
        return type(self)(*states, self.alpha)

    @property
    def middle(self) -> Floats:
        """Mean of both ends."""
        return (self.start + self.end) / 2

    @property
    def chord(self) -> Floats:
        """Difference of both ends."""
        return self.end - self.start

    @property
    def bow(self) -> Floats:
        """Bow of the path."""
        a = self.alpha
        return ((1 + a) * self.rate - (1 - a) * self.start_velocity - 2 * a * self.chord) / 12

    @property
    def mean(self) -> Floats:
        """Mean of the path."""
        return self.middle - self.bow

    @property
    def second(self) -> Floats:
        """Places where the second multiplier's force acts along `C` in its own row."""
        return self.middle

    @property
    def mean_velocity(self) -> Floats:
        """Velocity that the second multiplier's force turns with."""
        a = self.alpha
        return ((1 - a) * self.start_velocity + (1 + a) * self.rate) / 4

    def rate_rows(self) -> tuple[Floats, Floats]:
        """Directors that the rate is tangent at, and those whose constraints have the state."""
        return self.end, self.rate

    def allowed(self) -> Floats:
        """The rate without what the constraints forbid."""
        C = constraint(self.end)
        return np.asarray(self.rate - _applied(pseudo_inverse(C), _applied(C, self.rate)))

    def excess(self) -> Floats:
        """Residual of the constraints of the rate, in terms of it, shape (n, c)."""
        return _applied(constraint(self.end), self.rate)

    def force_rows(self) -> Floats:
        """`G^T`, shape (n, 2 c, 6 k)."""
        x, s, D, m = (
            constraint(d) for d in (self.mean, self.mean_velocity, self.chord / 6, self.second)
        )
        return np.block([[x, D], [s, m]])


class MasslessPath(PathDirectors):
    """Directors without inertia: `rate` stands for the directors at the middle (eq. Q6)."""

    @property
    def half(self) -> Floats:
        """Directors at the middle of the step."""
        return self.middle - 1.5 * self.bow

    @property
    def second(self) -> Floats:
        """Mean of the middle of the chord and the middle of the path."""
        return (self.middle + self.half) / 2

    @property
    def mean_velocity(self) -> Floats:
        """Velocity that the second multiplier's force turns with."""
        return self.chord / 2

    def rate_rows(self) -> tuple[Floats, Floats]:
        """The directors at the middle change by `(2 + a)/4` of the state, `-(1 + a)/8` of it."""
        half, a = self.half, self.alpha
        return half, -(4 + 2 * a) / (1 + a) * half

    def allowed(self) -> Floats:
        """The rate with which directors at the middle are orthonormal."""
        a, bow = self.alpha, (self.middle - orthonormal(self.half)) / 1.5
        return np.asarray((12 * bow + (1 - a) * self.start_velocity + 2 * a * self.chord) / (1 + a))

    def excess(self) -> Floats:
        """Residual of the constraints at the middle, in terms of the rate, shape (n, c)."""
        return -8 / (1 + self.alpha) * violation(self.half)


class PathBases(NodeBases):
    """Bases of nodes over a step, of the states and of the velocities.

    Args:
        held: As of `NodeBases`, as are `dofs`, `reference` and `values`.
        dofs: Local dofs.
        reference: Directors where the values are zero.
        values: Numbers of all local dofs.
        kind: What the path is.
        alpha: Dissipation.

    Attributes:
        halves: The bases of both fields.
    """

    def __init__(
        self,
        held: Bools,
        dofs: Int32s,
        reference: Floats,
        values: Sequence[Floats],
        kind: type[PathDirectors],
        alpha: float,
    ) -> None:
        weights = _weights(kind, alpha)
        super().__init__("path_bases", (7, 4), held, dofs, reference, values, weights)
        T, T_v, along, left, other, left_v, other_v, *forces = self.found
        self.halves = (
            Bases(T, left, forces[0], None, other, forces[1]),
            Bases(T_v, left_v, forces[2], along, other_v, forces[3]),
        )


def _weights(kind: type[PathDirectors], alpha: float) -> list[Floats]:
    """Weights of the states of a path in what `path_bases` takes of it, 7 of shape (4,)."""
    start, start_velocity, end, rate = np.eye(4)
    path = kind(start, start_velocity, end, rate, alpha)
    after = path.mean, path.second, path.chord / 6, path.mean_velocity
    return [path.end, *path.rate_rows(), *after]


def partial_bases(path: PathDirectors, free: Bools, size: int) -> tuple[Bases, Bases]:
    """Bases of one node, of which only some components are free, `size` directions in all.

    Args:
        path: States of that node, shape (1, 3 k).
        free: Which components are free, shape (3 k,).
        size: Number of directions left.
    """
    n, m = len(free), 2 if len(free) == 3 else 3
    held = np.eye(n)[~free]
    place, other = path.rate_rows()
    end, at = constraint(path.end)[0], constraint(place)[0]
    T, T_v = np.zeros((n, m)), np.zeros((n, m))
    T[:, :size] = null_space(np.concatenate([end, held]), size)
    T_v[:, :size] = null_space(np.concatenate([at, held]), size)
    along = np.zeros((n, m))
    along[free] = -any_pseudo_inverse(at[:, free]) @ (constraint(other)[0] @ T)
    G = path.force_rows()[0]
    c = len(G) // 2
    none = np.zeros_like(held)
    both = np.concatenate([G, np.block([[held, none], [none, held]])])
    Y = null_space(both, 2 * size)
    every = np.concatenate([free, free])
    inverse = np.zeros((2 * n, 2 * c))
    inverse[every] = any_pseudo_inverse(G[:, every])
    left, other = np.zeros((2 * n, m)), np.zeros((2 * n, m))
    left[:, :size], other[:, :size] = Y[:, :size], Y[:, size:]
    states = Bases(T, left[:n], inverse[:n, :c], None, other[:n], inverse[:n, c:])
    rates = Bases(T_v, other[n:], inverse[n:, c:], along, left[n:], inverse[n:, :c])
    return states, rates


def _applied(matrices: Floats, vectors: Floats) -> Floats:
    return np.asarray(np.einsum("nij,nj->ni", matrices, vectors))
