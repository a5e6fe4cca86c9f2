"""Constraints on velocities over a step that is quadratic in time: what they work, and (Q4)."""

from mpi4py import MPI

import numpy as np
import pytest
import ufl
from dolfinx import fem

from shellmb.forms.constraints.held import Held
from shellmb.forms.constraints.nonholonomic import path_row
from shellmb.forms.steps.discrete import variation
from shellmb.meshes.nodes import node_mesh, node_space
from shellmb.schemes.quadratic import path_of

SIZE, ROWS = 3, 2
GENERAL = np.random.default_rng(5)
# A(q) = a + M q, of each row, not symmetric
A0, M = GENERAL.normal(size=(ROWS, SIZE)), GENERAL.normal(size=(ROWS, SIZE, SIZE))


class Step:
    """A step between random states that obey nothing."""

    def __init__(self, alpha: float) -> None:
        nodes = node_mesh(MPI.COMM_SELF, 1)
        self.space = node_space(nodes, {"x": SIZE}).space
        self.dq = ufl.TestFunction(self.space)
        states = [fem.Function(self.space) for _ in range(4)]
        for state in states:
            state.x.array[:] = GENERAL.normal(size=SIZE)
        self.start, self.end, self.push, self.rate = (s.x.array.copy() for s in states)
        self.path = path_of(*states, fem.Constant(nodes.mesh, alpha))
        a = alpha
        self.chord = self.end - self.start
        swing = ((1 + a) * self.rate - (1 - a) * self.push) / 2
        self.bow = (swing - a * self.chord) / 6

    def force(self, row: ufl.core.expr.Expr) -> np.ndarray:
        """Both rows along each unknown, shape (ROWS, SIZE)."""
        return np.array([fem.assemble_vector(fem.form(row[k] * ufl.dx)).array for k in range(ROWS)])

    def value(self, row: ufl.core.expr.Expr) -> np.ndarray:
        return np.array([fem.assemble_scalar(fem.form(row[k] * ufl.dx)) for k in range(ROWS)])


def slip(q, dq):
    def row(k):
        turned = [sum(float(M[k, i, j]) * q[j] for j in range(SIZE)) for i in range(SIZE)]
        return sum((float(A0[k, i]) + turned[i]) * dq[i] for i in range(SIZE))

    return ufl.as_vector([row(k) for k in range(ROWS)])


def exact(q, dq):
    return (A0 + M @ q) @ dq


@pytest.mark.parametrize("alpha", [0.0, 0.6])
def test_work_of_the_multipliers(alpha: float) -> None:
    """It is the multipliers times what the step demands to vanish, for any states."""
    step = Step(alpha)
    first, second = (path_row(slip, step.path, k, step.dq) for k in range(2))
    D, z = step.chord, step.bow
    taus, weights = np.polynomial.legendre.leggauss(4)
    x = (step.start + step.end) / 2 - z
    mean = sum(
        w / 2 * exact(x + D * s / 2 + z * (3 * s**2 - 1) / 2, D + 6 * z * s)
        for s, w in zip(taus, weights, strict=True)
    )
    end = exact(step.end, step.rate)
    begin = exact(step.start, step.push)
    assert step.value(first.value) == pytest.approx(mean, rel=1e-12)
    assert step.value(second.value) == pytest.approx(end, rel=1e-12)
    work_0 = step.force(first.own) @ D + step.force(second.other) @ (6 * z)
    work_1 = step.force(first.other) @ D + step.force(second.own) @ (6 * z)
    assert work_0 == pytest.approx(mean, rel=1e-12)
    expected = ((1 + alpha) * end - (1 - alpha) * begin) / 6 - alpha / 3 * mean
    assert work_1 == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("alpha", [0.0, 0.6])
def test_rates_of_positions_have_the_forces_of_positions(alpha: float) -> None:
    """Where `A q'` is the rate of a quadratic `g`, (N1) is (Q4)."""
    step = Step(alpha)

    def position(q):
        return ufl.as_vector([slip(q, q)[k] for k in range(ROWS)])

    def rate(q, dq):
        return variation(position, q, dq)

    for k in range(2):
        ours, theirs = (
            path_row(rate, step.path, k, step.dq),
            Held(position).path(step.path, k, step.dq, False),
        )
        # the second multiplier of (Q4) is a third of ours
        own, other = (1, 1 / 3) if k == 0 else (1 / 3, 1)
        assert step.force(ours.own) == pytest.approx(own * step.force(theirs.own), rel=1e-11)
        assert step.force(ours.other) == pytest.approx(other * step.force(theirs.other), rel=1e-11)
    assert step.value(ours.value) == pytest.approx(step.value(theirs.value), rel=1e-12)
