"""Plane stress by quadrilaterals of degree 6, in NumPy: values for sheets that owe shellmb nothing.

Units: modulus times thickness is one.
"""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from numpy.polynomial.legendre import Legendre, leggauss
from scipy.sparse.linalg import spsolve

DEGREE = 6

Array = np.ndarray


def basis(x: Array) -> tuple[Array, Array]:
    """Lagrange polynomials at Gauss-Lobatto points of [0, 1] and their derivatives, (points, n)."""
    nodes = lobatto()
    powers = np.arange(DEGREE + 1)
    inverse = np.linalg.inv(nodes[:, None] ** powers)
    slopes = powers[1:] * x[:, None] ** powers[:-1]
    return x[:, None] ** powers @ inverse, slopes @ inverse[1:]


def lobatto() -> Array:
    inner = np.sort(Legendre.basis(DEGREE).deriv().roots().real)
    return (np.concatenate([[-1], inner, [1]]) + 1) / 2


def graded(n: int, levels: int) -> Array:
    """Sides of elements on [0, 1], halved `levels` times towards both ends."""
    ends = 0.5 ** np.arange(levels, 0, -1) / n
    inner = np.arange(1, n) / n
    return np.concatenate([[0], ends, inner, 1 - ends[::-1], [1]])


class Sheet:
    """A mapped square of elements.

    Args:
        place: From (xi, eta) in [0, 1], each (n,), to positions (n, 2).
        cells: Numbers of elements along both before grading.
        nu: Poisson's ratio.
        levels: How often elements are halved towards the sides.
    """

    def __init__(
        self,
        place: Callable[[Array, Array], Array],
        cells: tuple[int, int],
        nu: float = 0.3,
        levels: int = 6,
    ) -> None:
        sides = [graded(n, levels) for n in cells]
        inner = lobatto()[:-1]
        lines = [
            np.concatenate([a + (b - a) * inner for a, b in pairwise(s)] + [[1.0]]) for s in sides
        ]
        self.xi, self.eta = (v.ravel() for v in np.meshgrid(*lines, indexing="ij"))
        self.x = place(self.xi, self.eta)
        n, m = (len(s) - 1 for s in sides)
        number = np.arange(len(self.x)).reshape([len(line) for line in lines])
        self.cells = np.array(
            [
                number[DEGREE * i : DEGREE * (i + 1) + 1, DEGREE * j : DEGREE * (j + 1) + 1].ravel()
                for i in range(n)
                for j in range(m)
            ]
        )
        g, w = leggauss(DEGREE + 2)
        value, slope = basis((g + 1) / 2)
        along, across = np.kron(slope, value), np.kron(value, slope)
        X = self.x[self.cells]
        F = np.stack([np.einsum("qn,enk->eqk", d, X) for d in (along, across)], axis=-1)
        J, G = np.abs(np.linalg.det(F)), np.linalg.inv(F)
        d = np.einsum("aqn,eqak->eqkn", np.stack([along, across]), G)
        B = np.zeros((*d.shape[:2], 3, 2 * d.shape[-1]))
        B[:, :, 0, ::2], B[:, :, 1, 1::2] = d[:, :, 0], d[:, :, 1]
        B[:, :, 2, ::2], B[:, :, 2, 1::2] = d[:, :, 1], d[:, :, 0]
        C = np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]]) / (1 - nu**2)
        weight = J * np.kron(w, w) / 4
        CB = C @ B * weight[..., None, None]
        K = np.einsum("eqai,eqaj->eij", B, CB, optimize=True)
        unknowns = (2 * self.cells[..., None] + np.arange(2)).reshape(len(K), -1)
        size = unknowns.shape[1]
        rows, columns = np.repeat(unknowns, size, 1).ravel(), np.tile(unknowns, (1, size)).ravel()
        self.K = sp.csc_matrix((K.ravel(), (rows, columns)), shape=(2 * len(self.x),) * 2)

    def side(
        self, nodes: Array, force: tuple[float, float], part: tuple[float, float] = (0, 1)
    ) -> Array:
        """A force spread over a side, or a part of it by its parameter; sums to `force`."""
        line = np.flatnonzero(nodes)
        s = self.eta[line] if np.ptp(self.eta[line]) > np.ptp(self.xi[line]) else self.xi[line]
        line = line[np.argsort(s)]
        loads = np.zeros(len(line))
        g, w = leggauss(DEGREE + 2)
        value, slope = basis((g + 1) / 2)
        for k in range(0, len(line) - 1, DEGREE):
            some = slice(k, k + DEGREE + 1)
            if not part[0] - 1e-9 < np.sort(s)[k : k + DEGREE + 1].mean() < part[1] + 1e-9:
                continue
            length = np.linalg.norm(slope @ self.x[line[some]], axis=1)
            loads[some] += value.T @ (length * w / 2)
        f = np.zeros((len(self.x), 2))
        f[line] = loads[:, None] / loads.sum() * force
        return f

    def solve(self, f: Array, fixed: Array) -> Array:
        """Displacements, shape (n, 2), under forces (n, 2) where components are fixed (n, 2)."""
        free = np.flatnonzero(~fixed.ravel())
        u = np.zeros(f.size)
        u[free] = spsolve(self.K[free][:, free], f.ravel()[free])
        return u.reshape(-1, 2)

    def at(self, *point: float) -> int:
        """The node nearest to a point."""
        return int(np.argmin(np.linalg.norm(self.x - point, axis=1)))
