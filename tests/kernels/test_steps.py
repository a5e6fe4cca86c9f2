"""Numbers that are found later are those of the step they were taken in.

Kind: something that a kernel reads and that is not kept, so that a later step's value enters.
"""

from mpi4py import MPI

import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh

from shellmb.native.assembler import assembled_as
from shellmb.native.expressions import values_at_states
from shellmb.observers.deferred import StepValues
from shellmb.scene import Solver
from shellmb.system.assembly.functionals import functionals

# the same kernels on the same numbers; by DOLFINx in another order of operations
ROUND_OFF = 1e-13


@pytest.fixture(scope="module")
def parts() -> tuple[fem.Function, fem.Function, fem.Constant]:
    """State, velocity and a parameter on a mesh of lines."""
    domain = mesh.create_interval(MPI.COMM_SELF, 3, (0.0, 2.0))
    space = fem.functionspace(domain, ("Lagrange", 1, (2,)))
    return fem.Function(space), fem.Function(space), fem.Constant(domain, 1.0)


def changed(parts: tuple[fem.Function, fem.Function, fem.Constant], step: int) -> None:
    """Give all that is read new values."""
    q, v, c = parts
    rng = np.random.default_rng(step)
    q.x.array[:], v.x.array[:] = rng.normal(size=(2, len(q.x.array)))
    c.value = 1.0 + step


def test_sums_of_steps_are_those_of_each_step(parts) -> None:
    q, v, c = parts
    sums = [[c * ufl.dot(q, q) * ufl.dx, ufl.dot(q, v) * ufl.dx], [c * ufl.dot(v, v) * ufl.dx]]
    now = functionals(sums, MPI.COMM_SELF)
    later = StepValues(functionals(sums, MPI.COMM_SELF))
    expected = []
    for step in (3, 1, 4, 2):
        changed(parts, step)
        expected.append(now().copy())
        later.take(len(expected) - 1)
    changed(parts, 9)
    assert np.array_equal(later.of(slice(0, 4)), expected)
    assert np.array_equal(later.of(slice(2, 3)), expected[2:3])
    # a row is taken anew
    later.take(1)
    assert np.array_equal(later.of(slice(1, 2))[0], now())
    assert np.array_equal(later.of(slice(0, 1)), expected[:1])


@pytest.mark.parametrize("assembler", ["native", "reference"])
def test_values_at_states_are_those_in_the_middles_of_cells(parts, assembler) -> None:
    """States in a row, with a Constant that changes between two calls."""
    _, v, c = parts
    state = fem.Function(v.function_space)
    changed(parts, 1)
    make = assembled_as(lambda *_: Solver(assembler=assembler))(values_at_states)
    find = make(ufl.as_vector([c * state[0], state[1] * v[0]]), state)
    rng = np.random.default_rng(5)
    states = rng.normal(size=(3, len(state.x.array)))
    for step in (2, 7):
        changed(parts, step)
        found = find(states)
        middles = (states.reshape(3, -1, 2)[:, :-1] + states.reshape(3, -1, 2)[:, 1:]) / 2
        rates = v.x.array.reshape(-1, 2)
        rate = (rates[:-1] + rates[1:])[:, 0] / 2
        expected = np.stack([c.value * middles[..., 0], middles[..., 1] * rate], axis=-1)
        assert np.abs(found - expected).max() < ROUND_OFF * np.abs(expected).max()
