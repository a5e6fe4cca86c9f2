"""Memory of a block matrix is asked for once: no row has more entries than are counted before."""

import numpy as np
import pytest

from shellmb.scene import Clamped, Join, Rectangle, Scene
from shellmb.simulate.simulation import Simulation
from shellmb.system.assembly.entries import most_entries
from tests.scenes import plate


def joined(scheme: str) -> Scene:
    """Two plates that share an edge: unknowns of one are linked to those of the other."""
    return Scene(
        "joined",
        [plate(), plate(name="other", surface=Rectangle(1.0, 0.5, origin=(1.0, 0, 0)))],
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
    # but for what is zero to round-off here, and was exactly where the pattern was found: of forces
    # in the plane with one another
    assert A.getInfo()["mallocs"] <= 4
    system.symmetric_jacobian()
    assert A.getInfo()["mallocs"] <= 4


def test_a_matrix_whose_entries_are_counted_is_that_of_a_hash_table(monkeypatch) -> None:
    system = Simulation(joined("static")).problem.system
    counted = system.symmetric_matrix(None, 1.0)
    monkeypatch.setattr("shellmb.system.assembly.blocks.most_entries", lambda *given: None)
    hashed = system.symmetric_matrix(None, 1.0)
    for a, b in zip(counted.getValuesCSR(), hashed.getValuesCSR(), strict=True):
        assert np.array_equal(a, b)
