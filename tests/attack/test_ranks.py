"""Functions that ask for their rank: each rank would compute its part of another scene, or wait."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

import shellmb as sm
from shellmb import errors
from shellmb.scene.values.user_functions import given_functions

FUNCTIONS = """
import sys
from mpi4py import MPI
import basix.ufl, dolfinx.mesh, ufl
import numpy as np
from dolfinx import fem
import shellmb as sm
from shellmb.model.rank_consistency import TimesAlike, same_on_all
from shellmb.native.kernels import compile_all
world = MPI.COMM_WORLD
steel = {"E": 2e11, "nu": 0.3, "density": 7800}
def more():
    return 1 + world.rank
def plate(thickness=0.01, surface=sm.Rectangle(1.0, 1.0), supports=sm.Clamped("left"), **given):
    shell = sm.Shell("plate", surface, sm.Isotropic(thickness=thickness, **steel), mesh=(2, 2),
                     natural=given.pop("natural", None))
    return sm.Scene("s", shell, supports=supports, scheme="ep", dt=0.1, t_end=1.0, **given)
def bar(*elements, **given):
    section = sm.RectangularSection(2e11, 0.3, width=0.1, height=0.1, density=7800)
    hinge = sm.Revolute("hinge", sm.GROUND, "bar", at=(0, 0, 0), axis=(0, 1, 0))
    return sm.Scene("s", beams=sm.Beam("bar", sm.Line((0, 0, 0), (1, 0, 0)), section, elements=2),
                    joints=hinge, force_elements=elements, scheme="ep", dt=0.1, t_end=1.0, **given)
def pull(x):
    return np.array([x[0], x[1], more() * x[2]])
angle = sm.Sensor("hinge.rotation")
SCENES = {
    "loads[0].time": lambda: plate(loads=sm.Gravity(time=lambda t: more() * t)),
    "loads[0].force": lambda: plate(loads=sm.SurfaceForce(pull)),
    "supports[0].translation":
        lambda: plate(supports=sm.Driven("left", translation=lambda t: (0, 0, more() * t))),
    "supports[0].displacement[2]":
        lambda: plate(supports=sm.Fixed("left", (0, 0, lambda t: more() * t), (0, 0, 0))),
    "shells['plate'].section.thickness": lambda: plate(thickness=lambda x: more() * 0.1 + x[0]),
    "shells['plate'].surface.map": lambda: plate(
        surface=sm.Parametric(lambda xi, eta: np.array([xi, eta, more() * xi * xi]))),
    "shells['plate'].natural.time":
        lambda: plate(natural=sm.NaturalStrain(curvature=(0.1, 0, 0), time=lambda t: more() * t)),
    "drivers['d'].rotation":
        lambda: bar(drivers=sm.Driver("d", "hinge", rotation=lambda t: more() * t * t)),
    "force_elements['m'].law":
        lambda: bar(sm.Motor("m", "hinge", law=lambda q, v, t: ufl.sin(q) * more())),
    "force_elements['s'].potential":
        lambda: bar(sm.JointSpring("s", "hinge", potential=lambda q: more() * q**2)),
    "events['e'].when.parts[1]":
        lambda: bar(events=sm.Event("e", angle >= (lambda t: more() * 0.1 + t))),
    "controllers['c'].target": lambda: bar(
        sm.Motor("m", "hinge", command=sm.Command("c")),
        controllers=sm.PID("c", angle, lambda t: more() * 1.0, 1.0, 0.0, 0.0)),
}
def said(call):
    try:
        call()
        return "nothing is said"
    except sm.ShellmbError as error:
        return str(error)
found = [f"{path}: {said(lambda: same_on_all(made(), world))}" for path, made in SCENES.items()]
# alike where it is tried, not in between
alike = plate(loads=sm.Gravity(time=lambda t: t + (0.1 < t < 0.2) * world.rank))
same_on_all(alike, world)
times = TimesAlike(alike, world)
times.check(0.0, 0.1)
found.append("steps: " + said(lambda: times.check(0.1, 0.1)))
square = dolfinx.mesh.create_unit_square(world, 2, 2)
space = fem.functionspace(square, basix.ufl.element("Lagrange", "triangle", 1))
density = fem.Function(space, name="density of plate")
found.append("forms: " + said(lambda: compile_all([density ** (1 + more()) * ufl.dx])))
all_ = world.gather(found)
if world.rank == 0:
    print(all_[0] == all_[1], *found, sep="\\n")
"""


@pytest.mark.mpi
def test_functions_that_ask_for_their_rank_are_refused_on_all_ranks(mpirun) -> None:
    """Kind: the same code on all ranks, and other values: of time, of position, in forms."""
    same, *found, steps, forms = mpirun(2, "-c", FUNCTIONS).splitlines()
    assert same == "True"
    assert len(found) == 12
    for line in found:
        path, _, text = line.partition(": ")
        assert text.startswith(f"scene 's': {path} gives other values from rank to rank"), line
    assert "loads[0].time gives 0.121 on one rank and 1.121 on another between t = 0.1" in steps
    assert "forms, of density of plate differ from rank to rank" in forms


@pytest.mark.parametrize(
    "error",
    [
        errors.ConvergenceError("it turns", "beam", {"beam": 1.0}),
        errors.TooFewModesError(count=3, there=2),
        errors.TooFewModesError("two load factors", there=2),
        errors.RunError("the disk is full", alone=True),
    ],
    ids=str,
)
def test_errors_reach_other_ranks_as_they_are(error: sm.ShellmbError) -> None:
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is type(error) and str(again) == str(error)
    assert vars(again) == vars(error)


class Counts:
    """A function with a memory."""

    def __init__(self) -> None:
        self.count = 0

    def __call__(self, t: float) -> float:
        self.count += 1
        return float(self.count)


def test_functions_are_tried_on_copies() -> None:
    """What a law remembers does not depend on the number of ranks."""
    counts, calls = Counts(), []
    steel = sm.Isotropic(E=2e11, nu=0.3, thickness=lambda x: 0.1 + 0 * x[0], density=7800)
    scene = sm.Scene(
        "s",
        sm.Shell("plate", sm.Rectangle(1.0, 1.0), steel, mesh=(2, 2)),
        supports=sm.Clamped("left"),
        loads=[sm.Gravity(time=counts), sm.Gravity(time=sm.Ramp(1.0))],
        results=lambda run: calls.append(run) or {},
        scheme="ep",
        dt=0.1,
        t_end=1.0,
    )
    before = counts.count
    found = {f.path: f.trial(1.0) for f in given_functions(scene)}
    # what is ours has no more than its numbers, which are compared as such
    assert set(found) == {"shells['plate'].section.thickness", "loads[0].time"}
    assert counts.count == before and not calls
    first, *_ = found["loads[0].time"]
    assert first == [before + 1.0]
    np.testing.assert_array_equal(found["shells['plate'].section.thickness"], [[0.1] * 4])


ALONE = """
import sys
from mpi4py import MPI
import shellmb as sm
from shellmb import barrier
from shellmb.diagnostics.balances import Drift
from shellmb.observers.files.frames import Frames
from shellmb.simulate.simulation import BaseObserver
where, out = sys.argv[1:]
barrier.MEETING = 1.0

def fails(*given):
    if MPI.COMM_WORLD.rank == (where == "accepted"):
        raise (OSError if where == "write" else KeyError)("mine")
    return {}

class Mine(BaseObserver):
    pass

kind = {"cautions": Drift, "write": Frames}.get(where, Mine)
setattr(kind, where, fails)
bob = sm.RigidBody("bob", 1.0, (0.01, 0.02, 0.03), position=(1, 0, 0))
hinge = sm.Revolute("hinge", sm.GROUND, "bob", at=(0, 0, 0), axis=(0, 1, 0))
scene = sm.Scene("s", rigid_bodies=bob, joints=hinge, scheme="ep", dt=0.01, t_end=0.05)
sm.run(scene, out=out, observers=[Mine()], pictures=False)
"""


@pytest.mark.mpi
@pytest.mark.parametrize("where", ["start", "accepted", "finish", "cautions", "write"])
def test_what_fails_on_one_rank_ends_all(where: str, mpirun, tmp_path: Path) -> None:
    """Kind: an observer, a watch or a file, in a program of the user's: no rank waits for ever."""
    # pytest fails by what ranks say, where they end with an error
    with pytest.raises(pytest.fail.Exception) as ended:
        mpirun(2, "-c", ALONE, where, tmp_path / "out", timeout=60, alone=True)
    rank = int(where == "accepted")
    assert f"error: rank {rank} fails alone, and all ranks end with it: " in str(ended.value)
