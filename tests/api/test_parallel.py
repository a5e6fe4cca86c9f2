"""The same run on two ranks: all of them hold it, the first one writes."""

from pathlib import Path

import pytest

FILE = str(Path(__file__).parents[1] / "run" / "scene_small.py")
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
    assert "<Run 'small': ep, 5 steps" in mpirun(2, "-c", SOURCE.format(file=FILE))


LATE = """
from mpi4py import MPI
import shellmb as sm
comm = MPI.COMM_WORLD
run = sm.run({file!r})
folder = run.directory
if comm.rank == {first}:
    del run
comm.Barrier()
if comm.rank != {first}:
    assert len(run.history) == 6 and run.summary["steps"] == 5
    del run
comm.Barrier()
assert not folder.parent.exists()
# and one that is held to the end of the program
run = sm.run({file!r})
if comm.rank == 0:
    print(run.directory.parent)
"""


@pytest.mark.mpi
@pytest.mark.parametrize("first", [0, 1])
def test_a_temporary_directory_goes_with_the_last_rank(first: int, mpirun) -> None:
    """Each rank reads its run when it is asked for, whatever the others have let go of."""
    left = mpirun(2, "-c", LATE.format(file=FILE, first=first), alone=True).strip()
    assert left and not Path(left).exists()
