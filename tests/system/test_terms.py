"""Combinations of unknowns in reduced ones: what their lists leave out is zero at any state."""

from collections.abc import Callable
from typing import Any

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import numpy as np
import pytest

from shellmb.native import library as native
from shellmb.scene import Revolute, Scene
from shellmb.simulate.simulation import Simulation
from shellmb.system.condensation.meshreduction import MeshReduction
from shellmb.system.condensation.reduction import Reduction
from shellmb.system.nullspace.prolongation import RowMap
from tests.simulate.test_reduction import driven, held_component, rods, symmetric

links = rods({"revolute": (Revolute, {"axis": (0, 1, 0)})})


def listed(part: MeshReduction, name: str, table: RowMap) -> tuple[np.ndarray, np.ndarray]:
    """Whether each coefficient of the unknowns of each cell is in its list, and all of them."""
    own, cells = part._projection[name], part.cells
    shared = cells.dofs[:, : cells.shared]
    count = own["begin"][cells.count * own["rows"]]
    at = np.array(native.cells().ffi.unpack(own["at"], count) if count else [], dtype=int)
    found = np.zeros(table.values.size, dtype=bool)
    found[at] = True
    there = table.places[shared] < table.there
    return found.reshape(table.values.shape)[shared][there], table.values[shared][there]


# frames and joints, directors of which some components are held; the first states have many zeros
# that others have not: bodies along axes, at rest
@pytest.mark.parametrize(
    ("scene", "scheme"),
    [(driven, "ep"), (links, "ep4"), (symmetric, "ep"), (held_component, "ed")],
)
def test_what_is_left_out_is_zero(scene: Callable[..., Scene], scheme: str) -> None:
    given: dict[str, Any] = {"alpha": 1.0} if scheme == "ed" else {}
    simulation = Simulation(scene(scheme=scheme, **given))
    linear = simulation.problem.newton.iteration.linear
    assert isinstance(linear, Reduction)
    numbers, left_out = linear.numbers, 0
    for _ in range(3):
        tables = {"left": numbers.left, "right": numbers.right, "multiplier": numbers.forces}
        for part in linear.parts:
            for name, table in tables.items():
                inside, values = listed(part, name, table)
                assert not np.any(values[~inside])
                left_out += int(np.sum(~inside))
        simulation.advance()
        linear.factorise()
    # turned frames have them
    assert left_out or scene not in (driven, links)
