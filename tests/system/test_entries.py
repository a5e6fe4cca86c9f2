"""Memory of a block matrix is asked for once: no row has more entries than are counted before."""

import numpy as np
import pytest

from shellmb.scene import Clamped, Join, Rectangle, Scene
from shellmb.simulate.simulation import Simulation
from shellmb.system.assembly.numbering import most_entries
from tests.scenes import plate


def joined(scheme: str, mesh: tuple[int, int] = (2, 1)) -> Scene:
    """Two plates that share an edge: unknowns of one are linked to those of the other."""
    other = plate(name="other", surface=Rectangle(1.0, 0.5, origin=(1.0, 0, 0)), mesh=mesh)
    return Scene(
        "joined",
        [plate(mesh=mesh), other],
        joins=Join("plate", "other", "right", "left"),
        supports=Clamped("left", body="plate"),
        scheme=scheme,
        dt=0.1,
        t_end=0.1,
    )


@pytest.mark.parametrize("scheme", ["static", "ep4"])
def test_rows_have_no_more_entries_than_are_counted(scheme) -> None:
    system = Simulation(joined(scheme)).problem.system
    A = system.symmetric_jacobian()
    most = most_entries(system.comm, system.numbering, system.fields, system.jacobians)
    assert most is not None
    rows = np.diff(A.getValuesCSR()[0])
    assert np.all(rows <= most)
    # and not far more: each cell's matrix has zeros, and cells share their sides
    assert np.sum(most) < 5 * np.sum(rows)
    # forces of a cell are orthogonal to one another up to round-off, or exactly
    assert A.getInfo()["mallocs"] == 0
    system.symmetric_jacobian()
    assert A.getInfo()["mallocs"] == 0


@pytest.mark.parametrize("scheme", ["static", "ep4"])
def test_no_memory_is_asked_for_later(scheme) -> None:
    """Kind: entries that appear after the pattern; each would move the whole matrix."""
    A = Simulation(joined(scheme, (5, 4))).problem.system.symmetric_jacobian()
    assert A.getInfo()["mallocs"] == 0


def test_a_matrix_whose_entries_are_counted_is_that_of_a_hash_table(monkeypatch) -> None:
    system = Simulation(joined("static")).problem.system
    counted = system.symmetric_matrix(None, 1.0)
    monkeypatch.setattr("shellmb.system.assembly.blocks.most_entries", lambda *given: None)
    hashed = system.symmetric_matrix(None, 1.0)
    for a, b in zip(counted.getValuesCSR(), hashed.getValuesCSR(), strict=True):
        assert np.array_equal(a, b)
