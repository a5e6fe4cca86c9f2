"""Notation of the schemes: strains along a path, and what stresses act on.

A path has a mean `x`, a chord `D`, a bow `z` and a mean velocity `y` (`forms.steps.path`). Measures
are quadratic, `e(q) = lin(q) + quad(q, q)/2`. On a page stand

    e(a), lin(a), quad(a, b)      values at combinations of these, as `quad(x, x) + quad(D, D) / 4`
    De(a)                         what a stress acts on, `lin(dq) + quad(a, dq)`
    H(a)                          its part that turns, `quad(a, dq)`

They are arrays of numbers, added and multiplied as such, with which the same forms are taken for
all schemes (`residuals.rows`). A strain over a step, `sum_a l_a lin(s_a) + sum_ab w_ab quad(s_a,
s_b)`, has the weights `l` of the states x, D, z, y, then those `w` of their pairs as in `PAIRS`;
what a stress acts on, `c lin(dq) + quad(sum_a w_a s_a, dq)`, has `c`, then the weights.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from shellmb.arrays import Floats
from shellmb.forms.steps.path import PAIRS, Path, PathRow

x, D, z, y = np.eye(4)


def lin(a: Floats) -> Floats:
    """Linear part of a measure at a combination of the states."""
    return np.append(a, np.zeros(len(PAIRS)))


def quad(a: Floats, b: Floats) -> Floats:
    """Bilinear part of a measure at two combinations of the states.

    Raises:
        ValueError: If there is a product of states that no template has.
    """
    both = np.outer(a, b) + np.outer(b, a)
    found = [both[i, j] / (2 if i == j else 1) for i, j in PAIRS]
    rest = np.triu(both) - np.diag(np.diag(both)) / 2
    for (i, j), product in zip(PAIRS, found, strict=True):
        rest[i, j] -= product
    if np.any(rest):
        raise ValueError("products of the mean velocity with other states than the chord have none")
    return np.append(np.zeros(4), found)


def e(a: Floats) -> Floats:
    """A measure at a combination of the states."""
    return lin(a) + quad(a, a) / 2


def De(a: Floats) -> Floats:
    """Derivative of a measure at a combination of the states."""
    return np.append(1.0, a)


def H(a: Floats) -> Floats:
    """Second derivative of a measure along a combination of the states."""
    return np.append(0.0, a)


class Acting(NamedTuple):
    """The stress of a strain, and what it acts on in a row.

    Args:
        strain: The strain over the step.
        on: What the stress acts on.
    """

    strain: Floats
    on: Floats


class PathPage(NamedTuple):
    """The page of a scheme that is quadratic in time.

    Args:
        path_of: Path from the states and scaled velocities at both ends and the dissipation.
        strains: Strains of which both stresses are, from the dissipation.
        bow: Bow of a strain.
        rows: The rows P0 and P1.
    """

    path_of: Callable[[Any, Any, Any, Any, Any], Path]
    strains: Callable[[float], tuple[Floats, Floats]]
    bow: Floats
    rows: tuple[PathRow, PathRow]

    def states(self, alpha: float) -> Floats:
        """States of the path as combinations of `q_i, h v_i, q_f, h v_f`, shape (4, 4)."""
        q_i, hv_i, q_f, hv_f = np.eye(4)
        return np.array(self.path_of(q_i, q_f, hv_i, hv_f, alpha).states)

    @property
    def slopes(self) -> tuple[tuple[Floats, Floats], ...]:
        """Virtual strains of each stress, row by row."""
        return tuple(zip(*(row.stresses for row in self.rows), strict=True))
