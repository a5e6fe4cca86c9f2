"""Contact of shells on one and on two ranks.

The kind: what is counted once on each rank, or on one rank only; entries of the matrix in rows of
another rank; nodes and facets in an order that depends on how the mesh is shared out.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.contact.faces_ranks import found

PROGRAM = Path(__file__).parent / "faces_ranks.py"
# clocks, round-off itself, and iterations that end a last digit apart
LEFT = {"wall_s", "iterations", "energy_balance", "director_error", "constraint_error"}
MORE = ("ed3", "fine", "full", "itself")


@pytest.mark.mpi
@pytest.mark.parametrize("names", [("ep",), pytest.param(MORE, marks=pytest.mark.slow)])
def test_one_and_two_ranks_agree(names: tuple[str, ...], mpirun, tmp_path: Path) -> None:
    file = tmp_path / "two.json"
    mpirun(2, PROGRAM, *names, file)
    two, one = json.loads(file.read_text()), found(list(names))
    for name in names:
        here, there = (runs[name]["history"] for runs in (one, two))
        assert list(here) == list(there)
        assert np.nanmax(here["touch.normal"]) > 0.5
        assert name == "itself" or here["touch.loss"][-1] > 1.0
        momenta = [key for key in here if "momentum" in key]
        for key in set(here) - LEFT:
            a, b = (np.array(values[key], dtype=float) for values in (here, there))
            size = max(abs(a[np.isfinite(a)]), default=0.0)
            if key in momenta:
                # of those that are zero only round-off is there
                size = max(size, 1e-3)
            # Newton's method ends 1e-11 apart; 2e-12 was seen
            np.testing.assert_allclose(b, a, rtol=0, atol=1e-9 * max(size, 1e-6), err_msg=key)
        energy = np.max(np.abs(here["total_energy"]))
        for run in (here, there):
            # of 270 J 3e-13 was seen
            assert np.max(np.abs(run["energy_balance"])) < 1e-12 * energy
        assert one[name]["warnings"] == two[name]["warnings"]
