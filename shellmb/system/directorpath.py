"""Directors over a step that is quadratic in time: what their forces and increments are tangent to.

At the end of a step directors `d` and their velocities `V` (times the step) obey `g(d) = 0` and
`C(d) V = 0`, `C` being the derivative of `g`, which is linear in `d`. Increments are columns of

    Z = [ T_d, 0; -C(d)^+ C(V) T_d, T_d ],       C(d) T_d = 0.

The forces of the multipliers of both rows act along the columns of (eq. Q4)

    G = [ C(x)^T, C(s)^T; C(D)^T/6, C(m)^T ]

with the mean `x`, the swing `s`, the chord `D` and the middle `m` of the path. Tests are the
columns of `Y` with `G^T Y = 0`: those of single directors at `x` and at `m`, corrected along
`C(x)^+` and `C(m)^+`.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from shellmb.system.directors import any_pseudo_inverse, constraint, pseudo_inverse, tangent

Floats = npt.NDArray[np.float64]


class Half(NamedTuple):
    """What one of both fields has of the bases of a pair.

    Args:
        right: Increments of the field with its own, shape (n, 3 k, m).
        right_other: The same with those of the other field.
        left: Tests of the field in its own equations.
        left_other: The same in the other's.
        forces: What makes its own multipliers of its forces, shape (n, 3 k, c).
        forces_other: What makes those of the other field of them.
    """

    right: Floats
    right_other: Floats
    left: Floats
    left_other: Floats
    forces: Floats
    forces_other: Floats


class PathDirectors(NamedTuple):
    """States of the directors of a step, shape (n, 3 k) each.

    Args:
        start: Directors at the start.
        push: Their velocities there times the step.
        end: Directors at the end.
        rate: Their velocities there times the step.
        alpha: Dissipation.
    """

    start: Floats
    push: Floats
    end: Floats
    rate: Floats
    alpha: float

    def of(self, node: int) -> "PathDirectors":
        """Those of one node."""
        one = slice(node, node + 1)
        states = self.start[one], self.push[one], self.end[one], self.rate[one]
        return PathDirectors(*states, self.alpha)

    @property
    def middle(self) -> Floats:
        """Mean of both ends."""
        return (self.start + self.end) / 2

    @property
    def chord(self) -> Floats:
        """Difference of both ends."""
        return self.end - self.start

    @property
    def mean(self) -> Floats:
        """Mean of the path."""
        a = self.alpha
        bow = ((1 + a) * self.rate - (1 - a) * self.push - 2 * a * self.chord) / 12
        return self.middle - bow

    @property
    def swing(self) -> Floats:
        """What the second multiplier's force turns with."""
        a = self.alpha
        return ((1 - a) * self.push + (1 + a) * self.rate) / 4

    def force_rows(self) -> Floats:
        """`G^T`, shape (n, 2 c, 6 k)."""
        x, s, D, m = (constraint(d) for d in (self.mean, self.swing, self.chord / 6, self.middle))
        return np.block([[x, D], [s, m]])


def path_bases(path: PathDirectors) -> tuple[Half, Half]:
    """Bases of all nodes, of the states and of the velocities."""
    end, rate = constraint(path.end), constraint(path.rate)
    T = tangent(path.end)
    along = -pseudo_inverse(end) @ (rate @ T)
    T_x, T_m = tangent(path.mean), tangent(path.middle)
    P_x, P_m = (pseudo_inverse(constraint(d)) for d in (path.mean, path.middle))
    D, s = constraint(path.chord / 6), constraint(path.swing)
    # Y = [T_x a + P_x beta; T_m b + P_m gamma] with beta + D (..) = 0 and gamma + s (..) = 0
    DP, sP = D @ P_m, s @ P_x
    one = np.eye(D.shape[1])
    beta_a, beta_b = _solve(one - DP @ sP, DP @ (s @ T_x), -(D @ T_m))
    gamma_a, gamma_b = _solve(one - sP @ DP, -(s @ T_x), sP @ (D @ T_m))
    G = path.force_rows()
    inverse = pseudo_inverse_of(G)
    n, c = D.shape[2], D.shape[1]
    nothing = np.zeros_like(T)
    states = Half(
        T, nothing, T_x + P_x @ beta_a, P_x @ beta_b, inverse[:, :n, :c], inverse[:, :n, c:]
    )
    rates = Half(
        T, along, T_m + P_m @ gamma_b, P_m @ gamma_a, inverse[:, n:, c:], inverse[:, n:, :c]
    )
    return states, rates


def partial_bases(path: PathDirectors, free: npt.NDArray[np.bool_], size: int) -> tuple[Half, Half]:
    """The same of one node, of which only some components are free, `size` directions in all.

    Args:
        path: States of that node, shape (1, 3 k).
        free: Which components are free, shape (3 k,).
        size: Number of directions left.
    """
    n, m = len(free), 2 if len(free) == 3 else 3
    held = np.eye(n)[~free]
    end, rate = constraint(path.end)[0], constraint(path.rate)[0]
    T = np.zeros((n, m))
    T[:, :size] = _null(np.concatenate([end, held]), size)
    along = np.zeros((n, m))
    along[free] = -any_pseudo_inverse(end[:, free]) @ (rate @ T)
    G = path.force_rows()[0]
    c = len(G) // 2
    none = np.zeros_like(held)
    both = np.concatenate([G, np.block([[held, none], [none, held]])])
    Y = _null(both, 2 * size)
    every = np.concatenate([free, free])
    inverse = np.zeros((2 * n, 2 * c))
    inverse[every] = any_pseudo_inverse(G[:, every])
    left, other = np.zeros((2 * n, m)), np.zeros((2 * n, m))
    left[:, :size], other[:, :size] = Y[:, :size], Y[:, size:]
    states = Half(T, 0 * T, left[:n], other[:n], inverse[:n, :c], inverse[:n, c:])
    rates = Half(T, along, other[n:], left[n:], inverse[n:, c:], inverse[n:, :c])
    return states, rates


def pseudo_inverse_of(rows: Floats) -> Floats:
    """`R^T (R R^T)^-1` of the rows of all nodes."""
    turned = rows.transpose(0, 2, 1)
    return np.asarray(turned @ _solve(rows @ turned, np.eye(rows.shape[1])[None])[0])


def _null(rows: Floats, size: int) -> Floats:
    if not np.all(np.isfinite(rows)):
        return np.full((rows.shape[1], size), np.nan)
    return np.asarray(np.linalg.svd(rows)[2][rows.shape[1] - size :].T)


def _solve(matrices: Floats, *sides: Floats) -> list[Floats]:
    """Solutions; NaN if a matrix has none, as of iterates far away."""
    count = len(matrices)
    try:
        return [
            np.linalg.solve(matrices, np.broadcast_to(b, (len(matrices), *b.shape[1:])))
            for b in sides
        ]
    except np.linalg.LinAlgError:
        return [np.full((count, *b.shape[1:]), np.nan) for b in sides]
