"""Constants per node are global real-space unknowns, one for each cell: what that saves."""

import time
from collections.abc import Callable

from mpi4py import MPI

import basix.ufl
import numpy as np
import pytest
import ufl
from dolfinx import fem
from dolfinx.fem import petsc

from shellmb.meshes.nodes import NodeMesh, node_mesh

JOINTS, SIZE = 16, 7


class Assembled:
    """Residual and tangent of constraints `a . b = 0` with multipliers, on one node mesh."""

    def __init__(self, nodes: NodeMesh, element: object) -> None:
        self.space = fem.functionspace(nodes.mesh, element)
        self.q, dq = fem.Function(self.space), ufl.TestFunction(self.space)
        a, b, lam = (ufl.as_vector(list(self.q)[3 * k : 3 * k + 3]) for k in (0, 1, 2))
        residual = ufl.derivative(lam[0] * ufl.dot(a, b) * ufl.dx, self.q, dq)
        self.forms = fem.form(residual), fem.form(ufl.derivative(residual, self.q))
        self.vector = petsc.create_vector(self.space)
        self.matrix = petsc.create_matrix(self.forms[1])

    def __call__(self) -> None:
        """Assemble both."""
        self.vector.set(0.0)
        self.matrix.zeroEntries()
        petsc.assemble_vector(self.vector, self.forms[0])
        petsc.assemble_matrix(self.matrix, self.forms[1])
        self.matrix.assemble()


def constants() -> object:
    """What `node_space` is made of."""
    return basix.ufl.element("DG", "interval", 0, shape=(SIZE,))


def reals() -> object:
    """DOLFINx's element of global real-space unknowns."""
    return basix.ufl.real_element("interval", (SIZE,))


def seconds(work: Callable[[], None]) -> float:
    """Least time of several rounds."""
    rounds = []
    for _ in range(20):
        start = time.perf_counter()
        work()
        rounds.append(time.perf_counter() - start)
    return min(rounds)


@pytest.mark.skipif(MPI.COMM_WORLD.size > 1, reason="dense values of one rank")
def test_on_one_cell_they_are_the_same() -> None:
    rng = np.random.default_rng(1)
    values = rng.standard_normal(SIZE)
    found = []
    for element in (constants(), reals()):
        made = Assembled(node_mesh(MPI.COMM_SELF, 1), element)
        made.q.x.array[:] = values
        made()
        found.append((made.vector.array.copy(), made.matrix[:, :]))
    # same numbers in the same order of sums, but for the order in which a compiler adds
    np.testing.assert_allclose(found[0][0], found[1][0], rtol=1e-14)
    np.testing.assert_allclose(found[0][1], found[1][1], rtol=1e-14)


@pytest.mark.skipif(MPI.COMM_WORLD.size > 1, reason="times of one rank")
def test_many_joints_of_one_kind_are_assembled_in_one_call() -> None:
    together = Assembled(node_mesh(MPI.COMM_SELF, JOINTS), constants())
    each = [Assembled(node_mesh(MPI.COMM_SELF, 1), reals()) for _ in range(JOINTS)]

    def one_by_one() -> None:
        for joint in each:
            joint()

    ratio = seconds(one_by_one) / seconds(together)
    print(f"{JOINTS} joints as real elements: {ratio:.1f} times the time of constants per node")
    # 15 on an idle machine: Python's and DOLFINx's share of a call, not the kernels, is what costs
    assert ratio > 4
