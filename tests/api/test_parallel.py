"""The same run on two ranks: all of them hold it, the first one writes."""

import pytest

SOURCE = """
from mpi4py import MPI
import shellmb as sm
run = sm.run({file!r}, "out", pictures=False)
assert len(run.history) == 6 and run.fields["plate"].sizes["node"] == 65
temporary = sm.run({file!r})
assert temporary.directory.is_dir() and len(temporary.history) == 6
MPI.COMM_WORLD.Barrier()
if MPI.COMM_WORLD.rank == 0:
    print(run)
"""


@pytest.mark.mpi
def test_two_ranks(mpirun) -> None:
    from pathlib import Path

    file = str(Path(__file__).parents[1] / "run" / "scene_small.py")
    assert "<Run 'small': ep, 5 steps" in mpirun(2, "-c", SOURCE.format(file=file))
