"""A run goes on with another number of ranks, and ends as if it had never stopped, to round-off.

Kind: what is saved in the numbers that a rank happens to give cells, dofs and nodes.
"""

import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
import pyvista

from shellmb.errors import SceneError
from shellmb.observers.files.checkpoint import Saved
from shellmb.running.execute import execute, take_up
from shellmb.scene import Modal, Scene

HERE = Path(__file__).parent
sys.path.append(str(HERE))
import other_ranks  # noqa: E402

# of the largest value of a column, or of a hundredth of what bodies of one metre measure: first
# guesses of Newton's method begin anew, and it stops 2e-12 m apart
CLOSE = 1e-8
# what has no such size: round-off itself, and times of clocks
MORE = [("small", 2), ("all", 1), ("all", 2), ("faces", 1), ("faces", 2)]
LEFT = {"wall_s", "energy_balance", "director_error", "constraint_error", "iterations"}


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("scene", "first"),
    [("small", 1), *(pytest.param(*case, marks=pytest.mark.slow) for case in MORE)],
)
def test_a_run_goes_on_with_other_ranks(scene, first, tmp_path, mpirun) -> None:
    whole = execute(other_ranks.SCENES[scene](), tmp_path / "whole", pictures=False)
    mpirun(first, HERE / "other_ranks.py", scene, "begin", "run")
    assert mpirun(3 - first, HERE / "other_ranks.py", scene, "end", "run").split() == [
        str(3 - first)
    ]
    history = pd.read_csv(tmp_path / "run" / "history.csv")
    assert list(history) == list(whole.history) and len(history) == len(whole.history)
    found, wanted = history.fillna(0.0), whole.history.fillna(0.0)
    for name in set(history) - LEFT:
        size = max(float(np.max(np.abs(wanted[name]))), 1e-2)
        np.testing.assert_allclose(
            found[name], wanted[name], rtol=0, atol=CLOSE * size, err_msg=name
        )
    assert found["energy_balance"].abs().max() < 1e-11
    # files have the same nodes and cells, whoever wrote them
    for file in sorted((tmp_path / "whole" / "fields").glob("*.vtu")):
        one, other = (pyvista.read(f) for f in (file, tmp_path / "run" / "fields" / file.name))
        np.testing.assert_array_equal(one.cells, other.cells)
        np.testing.assert_allclose(one.points, other.points, rtol=0, atol=1e-9)


def test_what_ranks_decide_is_not_taken_up() -> None:
    """Signs of eigenvectors."""
    shell = other_ranks.scene_small.scene(steps=6, sides=(4, 1)).shells[0]
    modal = replace(shell, model=Modal(modes=2))
    simulation: Any = SimpleNamespace(scene=Scene("s", modal, scheme="ep", dt=1, t_end=1))
    with pytest.raises(SceneError, match=r"made on 2 ranks, and the model of shell 'plate' is Mod"):
        take_up(simulation, {}, Saved({}, {}, {}, ranks=(({}, {}),) * 2))
