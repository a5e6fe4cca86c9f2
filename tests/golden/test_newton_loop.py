"""Runs without DOLFINx's `NewtonSolver`, as on its main branch: the same loop, bit for bit."""

import sys

from mpi4py import MPI

import numpy as np
import pytest
from dolfinx import cpp

from shellmb.guarding import silenced
from shellmb.system.newton import solver
from tests.golden.runs import history

# static with many iterations, a step of one stage, of two, of a path; joints; contact; modes
CORE = ("shell static", "beam ed", "joint ep", "chain ep4", "contact ep4", "modal ed3")


@pytest.fixture
def without_nls(monkeypatch):
    def remove() -> None:
        monkeypatch.delattr(cpp, "nls")
        monkeypatch.setitem(sys.modules, "dolfinx.nls", None)
        monkeypatch.setitem(sys.modules, "dolfinx.nls.petsc", None)

    return remove


@pytest.mark.parametrize("name", CORE)
def test_runs_are_bit_for_bit_the_same(name: str, without_nls) -> None:
    assert solver.has_newton_solver(), "the DOLFINx of uv.lock has one"
    kept = history(name)
    without_nls()
    assert not solver.has_newton_solver()
    found = history(name)
    assert found.keys() == kept.keys()
    for column, values in kept.items():
        np.testing.assert_array_equal(found[column], values, column)


def test_dolfinx_says_nothing_of_its_solver_and_others_are_heard(capfd) -> None:
    with silenced(2):
        cpp.nls.petsc.NewtonSolver(MPI.COMM_SELF)
    print("Python", file=sys.stderr)
    assert capfd.readouterr().err == "Python\n"
    cpp.nls.petsc.NewtonSolver(MPI.COMM_SELF)
    assert "deprecated" in capfd.readouterr().err
