"""Ranks that wait for one that compiles or draws leave it their cores."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

SOURCE = """
import time
from mpi4py import MPI
from shellmb.barrier import arrive
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
    # who comes last goes on at once, as far as a busy machine lets it
    assert worked < 0.5 and waited < 5.0


RUN = """
import time
from mpi4py import MPI
from shellmb.running import execute as run
from shellmb.scene import Gravity, Revolute, RigidBody, Scene
from shellmb.show import pictures

comm, clocks = MPI.COMM_WORLD, (time.monotonic, time.process_time)

def timed(name):
    # what comes behind the pictures
    made = getattr(run, name)
    def wrapped(*args):
        found = made(*args)
        times.append([clock() for clock in clocks])
        return found
    setattr(run, name, wrapped)

times = []
timed("_write")
timed("arrive")
pictures.draw_directory = lambda *args, **more: time.sleep(1.0)
arm = RigidBody("arm", 2.0, (0.01, 0.2, 0.2), com=(0.5, 0, 0))
pin = Revolute("pin", "ground", "arm", at=(0, 0, 0), axis=(0, 1, 0))
scene = Scene("pendulum", rigid_bodies=arm, joints=pin, scheme="ep", dt=1e-3, t_end=4e-3,
              loads=Gravity((0, 0, -9.81)), results=lambda run: {"one": 1.0})
run.execute(scene, "out", comm=comm)
found = comm.gather([b - a for a, b in zip(*times[:2])])
if comm.rank == 0:
    print(*found[1])
"""


@pytest.mark.mpi
def test_nor_does_who_waits_for_the_pictures_of_a_run(mpirun) -> None:
    """Results, which all ranks give together, come behind them."""
    waited, worked = map(float, mpirun(2, "-c", RUN).split())
    assert worked < 0.3 < 0.8 < waited


DRAWING = """
import sys, time
from mpi4py import MPI
from shellmb.cli.failures import failures_reported
from shellmb.barrier import arrive

@failures_reported
def command():
    # both are where a signal is awaited
    MPI.COMM_WORLD.Barrier()
    if MPI.COMM_WORLD.rank == 0:
        print("drawing", flush=True)
        time.sleep(60.0)
    if "in the run" in sys.argv:
        arrive(MPI.COMM_WORLD)

command()
"""


@pytest.mark.mpi
@pytest.mark.parametrize("waits", ["in the run", "at the end"])
def test_a_signal_ends_two_ranks_one_of_which_draws(waits: str, tmp_path: Path) -> None:
    """The other, which waits for it, has nothing to say."""
    mpiexec = Path(sys.executable).parent / "mpiexec"
    command = [str(mpiexec), "-n", "2", sys.executable, "-c", DRAWING, waits]
    process = subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    try:
        assert process.stdout.readline() == "drawing\n"
        # the other one comes to its end
        time.sleep(1.0)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=120)
    finally:
        process.kill()
    assert process.returncode == 130
    assert said.count("error: stopped at once") == 1
    assert "Traceback" not in said
