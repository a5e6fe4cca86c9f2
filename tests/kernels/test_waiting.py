"""Ranks that wait for one that compiles or draws leave it their cores."""

import pytest

SOURCE = """
import time
from mpi4py import MPI
from shellmb.waiting import arrive
comm = MPI.COMM_WORLD
comm.Barrier()
if comm.rank == 0:
    time.sleep(1.0)
came, worked = time.monotonic(), time.process_time()
arrive(comm)
worked, waited = time.process_time() - worked, time.monotonic() - came
found = comm.gather((worked, waited))
if comm.rank == 0:
    print(*found[0], *found[1])
"""


@pytest.mark.mpi
def test_who_waits_does_nothing(mpirun) -> None:
    worked, waited, worked_there, waited_there = map(float, mpirun(2, "-c", SOURCE).split())
    # a barrier works all of the second
    assert worked_there < 0.3 < 0.8 < waited_there
    assert max(worked, waited) < 0.5
