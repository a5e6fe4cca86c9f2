"""Small runs of every scheme and kind of body, modes, paths and gradients are what they were.

`python -m tests.golden.runs` (in the checkout) says by how much each one differs from what is
frozen in `runs.json`, and with `--freeze` writes that file anew. The scenes of `scenes` run every
day, in 9 s of processor time with kernels at hand; all else is slow.
"""

from pathlib import Path

import pytest

from tests.golden.features import SHARED as SHARED_SLOWLY
from tests.golden.runs import BOUND, NAMES, STORED, bound, differences, frozen, history
from tests.golden.scenes import SCENES, SHARED

DAILY = [n if n in SCENES else pytest.param(n, marks=pytest.mark.slow) for n in NAMES]


@pytest.mark.parametrize("name", DAILY)
def test_it_is_as_frozen(name: str) -> None:
    apart = differences(history(name), frozen()[name])
    worst = max(apart, key=apart.__getitem__)
    assert apart[worst] < bound(name), worst


@pytest.mark.mpi
@pytest.mark.parametrize("names", [SHARED, pytest.param(SHARED_SLOWLY, marks=pytest.mark.slow)])
def test_histories_of_two_ranks_are_those_of_one(names: tuple[str, ...], mpirun) -> None:
    source = (
        "import sys; "
        f"sys.path.insert(0, {str(Path(__file__).parents[2])!r}); "
        f"from tests.golden.runs import main; main({list(names)!r})"
    )
    found = dict(line.split(": ") for line in mpirun(2, "-c", source).splitlines())
    assert found.keys() == set(names)
    wrong = {n: line for n, line in found.items() if not float(line.split()[0]) < bound(n)}
    assert not wrong


def test_all_that_is_frozen_is_run() -> None:
    assert [name for name in frozen() if name in STORED] == list(STORED)


@pytest.mark.parametrize(
    "column", ["position_x", "total_energy", "momentum_z", "bearing.M2", "ball.F3", "drive.torque"]
)
def test_a_small_change_is_seen(column: str) -> None:
    kept = frozen()["joint ed"]
    changed = dict(kept) | {column: kept[column] * (1 + 1e-8)}
    apart = differences(changed, kept)
    assert apart.pop(column) > BOUND
    assert max(apart.values()) == 0
