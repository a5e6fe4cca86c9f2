"""Constraints on velocities at the end of a step that begins with a jump: what they work, (N2)."""

from mpi4py import MPI

import numpy as np
import pytest
import ufl
from dolfinx import fem

from shellmb.forms.constraints.held import Held, JumpRow, VelocityJump
from shellmb.forms.constraints.nonholonomic import slip_row
from shellmb.forms.steps.discrete import variation
from shellmb.meshes.nodes import node_mesh, node_space

SIZE, STEP = 3, 0.3
GENERAL = np.random.default_rng(8)
# A(q) = a + M q, not symmetric; and a symmetric Hessian
A0, M = GENERAL.normal(size=SIZE), GENERAL.normal(size=(SIZE, SIZE))
H = M + M.T


def form_of(slope: np.ndarray):
    def slip(q, dq):
        rows = range(SIZE)
        turned = [sum(float(slope[i, j]) * q[j] for j in rows) for i in rows]
        return ufl.as_vector([sum((float(A0[i]) + turned[i]) * dq[i] for i in rows)])

    return slip


def position(q):
    return ufl.as_vector(
        [
            sum(
                float(A0[i]) * q[i] + sum(float(H[i, j]) / 2 * q[i] * q[j] for j in range(SIZE))
                for i in range(SIZE)
            )
        ]
    )


class Step:
    """A step between random states that obey nothing but eq. (31), `a + b = 2 D/h - 2 v_i`."""

    def __init__(self) -> None:
        nodes = node_mesh(MPI.COMM_SELF, 1)
        space = node_space(nodes, {"x": SIZE}).space
        self.dq = ufl.TestFunction(space)
        states = [fem.Function(space) for _ in range(6)]
        self.start, self.inner, self.end, self.v = GENERAL.normal(size=(4, SIZE))
        self.jump = GENERAL.normal(size=SIZE)
        self.chord = self.end - self.start
        self.gain = 2 * self.chord / STEP - 2 * self.v - self.jump
        values = self.start, self.inner, self.end, self.jump, self.gain, self.v + self.gain
        for state, value in zip(states, values, strict=True):
            state.x.array[:] = value
        self.step = VelocityJump(*states, fem.Constant(nodes.mesh, STEP))

    def along(self, row) -> np.ndarray:
        return np.array(fem.assemble_vector(fem.form(row[0] * ufl.dx)).array)

    def work(self, row: JumpRow) -> float:
        """Of a multiplier of one."""
        impulses = self.along(row.impulse) @ self.jump / 2
        return float(impulses + self.along(row.force) @ self.chord)


@pytest.mark.parametrize("slope", [M, H], ids=["velocities", "positions"])
def test_work_is_of_what_vanishes(slope: np.ndarray) -> None:
    """For any states: both sub-intervals, and the rates at both ends of the step."""
    step = Step()
    row = slip_row(form_of(slope), step.step, step.dq)

    def exact(q, dq):
        return float((A0 + slope @ q) @ dq)

    rates = exact(step.end, step.v + step.gain), exact(step.start, step.v)
    intervals = [
        exact((a + b) / 2, b - a) for a, b in ((step.start, step.inner), (step.inner, step.end))
    ]
    value = fem.assemble_scalar(fem.form(row.value[0] * ufl.dx))
    assert value == pytest.approx(rates[0], rel=1e-12)
    assert step.work(row) == pytest.approx(sum(intervals) / STEP - sum(rates) / 2, rel=1e-11)


def test_positions_are_the_symmetric_case() -> None:
    step = Step()
    held, general = (
        Held(position).jump(step.step, step.dq),
        slip_row(lambda q, dq: variation(position, q, dq), step.step, step.dq),
    )
    for ours, theirs in zip(held[1:], general[1:], strict=True):
        assert step.along(ours) == pytest.approx(step.along(theirs), rel=1e-11)
