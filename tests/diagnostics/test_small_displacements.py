"""What is said of linear bodies is so of the exact ones: alarms that are false, and missed ones."""

import re
from functools import partial
from pathlib import Path

import pytest

import shellmb as sm
from tests import scenes

ROOT = Path(__file__).parents[2]
L, B, H = 1.0, 0.1, 0.01
SECTION = sm.Isotropic(E=1e9, nu=0.0, thickness=H, density=1000.0)


strip = partial(scenes.plate, SECTION, (L, B), "strip", mesh=(6, 1))


def of_bed(model, stiffness, supports, load):
    """Deflection of the middle of a strip on springs, and the warnings."""
    sides = [(x * L / 6, y) for x in range(1, 6) for y in (0.0, B)]
    springs = [
        sm.Spring(
            f"spring {k}",
            sm.GROUND,
            "strip",
            at=(x, y, -1.0),
            second_at=(x, y, 0.0),
            stiffness=stiffness,
        )
        for k, (x, y) in enumerate(sides)
    ]
    scene = sm.Scene(
        "bed",
        strip(model=model),
        supports=supports,
        force_elements=springs,
        loads=sm.SurfaceForce((0, 0, -load)),
        probes=sm.Probe("w", (0.5, 0, 0), component=2),
        scheme="static",
        dt=0.25,
    )
    run = sm.run(scene)
    return run.history["w"].iloc[-1], [w for w in run.warnings if "make it stiffer" in w]


def test_a_strip_on_springs_is_judged_with_them():
    """Kind: springs share the load, and it is their deflection that stretches the strip."""
    hinged = [sm.Hinged("left"), sm.Hinged("right")]
    linear, said = of_bed("floating-frame", 1e3, hinged, 1000.0)
    exact, _ = of_bed("exact", 1e3, hinged, 1000.0)
    (share,) = (float(re.search(r"by about ([\d.]+)%", s)[1]) / 100 for s in said)
    # an estimate by energies: a third of itself off at most
    assert share == pytest.approx(linear / exact - 1, rel=0.33)
    # its edges follow: nothing stretches it, on the same springs, however far it bends
    follows = [sm.Fixed("left", displacement=(0, 0, 0)), sm.SoftSupport("right")]
    linear, said = of_bed("floating-frame", 1e3, follows, 1000.0)
    exact, _ = of_bed("exact", 1e3, follows, 1000.0)
    assert linear == pytest.approx(exact, rel=1e-2)
    assert not said


@pytest.mark.parametrize("spins", [False, True])
def test_what_vibrates_does_not_spin(spins):
    """Kind: a fast small rotation, taken for a spin; one that goes on is one."""
    twist = [sm.PointForce((L, y, 0), (0, 0, f)) for y, f in ((0, 3.0), (B, -3.0))]
    scene = sm.Scene(
        "strip",
        strip(model="floating-frame", mesh=(4, 2)),
        supports=() if spins else sm.Clamped("left"),
        loads=() if spins else twist,
        initial=sm.InitialVelocity(spin=(0, 0, 12.0)) if spins else (),
        scheme="ep",
        dt=2e-3,
        t_end=0.05,
    )
    assert any("spins at" in w for w in sm.run(scene).warnings) == spins


@pytest.mark.slow
def test_ranks_say_the_same_of_linear_bodies(mpirun):
    """The kind: each rank has the whole frame of a body, and their sum is no frame."""
    source = f"""
import sys
sys.path.append({str(ROOT)!r})
import warnings
from mpi4py import MPI
import shellmb as sm
from tests.diagnostics.test_small_displacements import strip

warnings.simplefilter("ignore")
scene = sm.Scene(
    "strip",
    strip(model="floating-frame", mesh=(4, 2)),
    loads=sm.PointForce(({L}, 0, 0), (0, 0, 0.3)),
    initial=sm.InitialVelocity(spin=(0, 0, 12.0)),
    scheme="ep",
    dt=2e-3,
    t_end=0.05,
)
run = sm.run(scene, pictures=False)
if MPI.COMM_WORLD.rank == 0:
    print(*run.warnings, sep="\\n")
"""
    one, two = (mpirun(n, "-c", source).strip().splitlines() for n in (1, 2))
    assert any("forces along it would do" in said for said in one)
    assert two == one


@pytest.mark.slow
def test_ranks_say_the_same_of_bodies_in_modes(mpirun):
    """The kind: matrices have columns of other ranks' nodes, more than those a body has here."""
    source = f"""
import sys
sys.path.append({str(ROOT)!r})
import warnings
from mpi4py import MPI
import shellmb as sm
from shellmb.options.run import Options
from tests.sensitivity.test_events import latching

warnings.simplefilter("ignore")
run = sm.run(Options(model="modal:4").apply(latching()), pictures=False)
if MPI.COMM_WORLD.rank == 0:
    print(*run.warnings, sep="\\n")
"""
    one, two = (mpirun(n, "-c", source).strip().splitlines() for n in (1, 2))
    assert any("is reduced to modes and squares of its displacements" in said for said in one)
    assert two == one
