"""DOLFINx's `NewtonSolver`: it says nothing, and keeps nothing of what it solved."""

import gc
import sys
import weakref

from mpi4py import MPI

import pytest
from dolfinx import cpp

from shellmb.guarding import silenced
from shellmb.scene import Solver
from shellmb.simulate.simulation import Simulation
from tests.scenes import cantilever


def test_dolfinx_says_nothing_of_its_solver_and_others_are_heard(capfd) -> None:
    with silenced(2):
        cpp.nls.petsc.NewtonSolver(MPI.COMM_SELF)
    print("Python", file=sys.stderr)
    assert capfd.readouterr().err == "Python\n"
    cpp.nls.petsc.NewtonSolver(MPI.COMM_SELF)
    assert "deprecated" in capfd.readouterr().err


@pytest.mark.parametrize("backend", ["newton", "snes"])
def test_callbacks_keep_no_mesh(backend: str) -> None:
    """MPI has room for some hundreds of meshes, and loops in C++ keep their callbacks."""
    scene = cantilever((0.0, 0.0, 1e-3), dt=0.1, t_end=0.1, solver=Solver(backend=backend))
    simulation = Simulation(scene)
    simulation.run([])
    newton = weakref.ref(simulation.problem.newton)
    mesh = weakref.ref(simulation.model.shells["plate"].mixed.space.mesh)
    assert newton() is not None and mesh() is not None
    del simulation
    gc.collect()
    assert newton() is None and mesh() is None
