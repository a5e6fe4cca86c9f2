"""Ranks that wait for one that compiles or draws leave it their cores."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

# who comes last waits for a message, which the other sends when it has paused often enough: without
# pauses nobody would ever come
SOURCE = """
from mpi4py import MPI
from shellmb import barrier

comm, looks, pauses = MPI.COMM_WORLD, [], []

class Counted:
    size = comm.size

    def Ibarrier(self):
        self.request = comm.Ibarrier()
        return self

    def Test(self):
        looks.append(1)
        return self.request.Test()

def pause(seconds):
    pauses.append(seconds)
    sleep(seconds)
    if len(pauses) == 20 and comm.rank == 1:
        comm.send("paused", dest=0)

sleep, barrier.time.sleep = barrier.time.sleep, pause
if comm.rank == 0:
    comm.recv(source=1)
barrier.arrive(Counted())
found = comm.gather((len(looks), len(pauses), min(pauses, default=1.0)))
if comm.rank == 0:
    print(*found[1])
"""


@pytest.mark.mpi
def test_who_waits_does_nothing(mpirun) -> None:
    looks, pauses, shortest = map(float, mpirun(2, "-c", SOURCE, alone=True).split())
    # one look behind each pause, which leaves the core to others
    assert looks == pauses + 1 > 20
    assert shortest >= 1e-3


RUN = """
from mpi4py import MPI
from shellmb import barrier
from shellmb.running import execute as run
from shellmb.scene import Gravity, Revolute, RigidBody, Scene
from shellmb.show import pictures

comm, pauses, written = MPI.COMM_WORLD, [], []

def pause(seconds):
    sleep(seconds)
    if written and comm.rank == 1:
        pauses.append(seconds)
        if len(pauses) == 20:
            comm.send("paused", dest=0, tag=77)

def write(*args):
    made = _write(*args)
    written.append(True)
    return made

sleep, barrier.time.sleep = barrier.time.sleep, pause
_write, run._write = run._write, write
pictures.draw_directory = lambda *args, **more: comm.recv(source=1, tag=77)
arm = RigidBody("arm", 2.0, (0.01, 0.2, 0.2), com=(0.5, 0, 0))
pin = Revolute("pin", "ground", "arm", at=(0, 0, 0), axis=(0, 1, 0))
scene = Scene("pendulum", rigid_bodies=arm, joints=pin, scheme="ep", dt=1e-3, t_end=4e-3,
              loads=Gravity((0, 0, -9.81)), results=lambda run: {"one": 1.0})
run.execute(scene, "out", comm=comm)
found = comm.gather(len(pauses))
if comm.rank == 0:
    print(found[1])
"""


@pytest.mark.mpi
def test_nor_does_who_waits_for_the_pictures_of_a_run(mpirun) -> None:
    """Results, which all ranks give together, come behind them."""
    assert int(mpirun(2, "-c", RUN, alone=True)) >= 20


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
