"""Kind: impacts that a body in modes takes as a whole, and an exact one hardly.

A panel on a hub spins until a lock stops the hub: what stops at once is the hub, `J w`, and of the
panel what its elements or modes hold to it. So the part of the panel is `1 - J w/impulse`.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import shellmb as sm

SPIN = 0.1


def panel(model: Any, hub: float = 2e-3, **more: Any) -> sm.Scene:
    """A panel on a hub of an inertia that is locked."""
    skin = sm.Isotropic(E=70e9, nu=0.3, thickness=4e-3, density=2700)
    surface = sm.Rectangle(1.5, 0.5, (0.1, -0.25, 0.0))
    return sm.Scene(
        "panel",
        sm.Shell("panel", surface, skin, mesh=(6, 1), model=model),
        rigid_bodies=sm.RigidBody("hub", 1.0, (hub, hub, hub)),
        joints=[
            sm.Revolute("shaft", sm.GROUND, "hub", at=(0, 0, 0), axis=(0, 1, 0)),
            sm.Weld("bolts", "hub", "panel", second_at="left"),
        ],
        **{
            "initial": sm.InitialVelocity(spin=(0, SPIN, 0)),
            "locks": sm.Lock("shaft", active=(0.01, 1.0)),
            "scheme": "ep",
            "dt": 5e-3,
            "t_end": 0.02,
            **more,
        },
    )


def impacts(run: sm.Run) -> list[Any]:
    """Warnings of impacts."""
    return [w for w in run.summary["warnings"] if w["watch"] == "impacts on modes"]


@pytest.mark.parametrize("scheme", ["ep", "ed3"])
def test_its_part_is_what_the_hub_does_not_take(scheme: str) -> None:
    """Beside it torques and impulses add up to the same as those of an exact panel."""
    modal, exact = (
        sm.run(panel(model, scheme=scheme, t_end=0.1), pictures=False)
        for model in (sm.Modal(4), "exact")
    )
    impulses = [run.history["shaft.lock_torque_impulse"].to_numpy() for run in (modal, exact)]
    largest, right = (np.abs(each).max() for each in impulses)
    (warning,) = impacts(modal)
    # positions at the lock are those of a panel that spins rigidly
    assert warning["value"] == pytest.approx(1 - 2e-3 * SPIN / largest, rel=1e-4)
    assert largest * (1 - warning["value"]) < right < largest / 5
    for what in ("shell 'panel'", "95%", "t = 0.01", "shaft.rotation lock"):
        assert what in warning["says"]
    assert not impacts(exact)
    sums = [
        (run.history["shaft.lock_torque"] * run.history["dt"]).sum() + impulse.sum()
        for run, impulse in zip((modal, exact), impulses, strict=True)
    ]
    # over a sixth of the period of the clamped panel; from 0.03 s on 1 %, waves being left out
    assert sums[0] == pytest.approx(sums[1], rel=0.02)


def test_what_takes_little_says_nothing() -> None:
    """A heavy hub; a lock that acts at rest, and one from the start on by its condition."""
    assert not impacts(sm.run(panel(sm.Modal(4), hub=1.0), pictures=False))
    still = panel(sm.Modal(4), initial=())
    assert not impacts(sm.run(still, pictures=False))
    start = sm.Lock("shaft", when=sm.Sensor("shaft.rotation") >= -1.0)
    assert not impacts(sm.run(panel(sm.Modal(4), locks=start, initial=()), pictures=False))


RANKED = """
import sys
import warnings
sys.path.insert(0, {folder!r})
warnings.simplefilter("ignore")
from mpi4py import MPI
import shellmb as sm
from tests.reduced.test_impacts import panel
from tests.reduced.test_terms import cubic_spring
skin = sm.Isotropic(E=70e9, nu=0.3, thickness=5e-3, density=2700.0)
shape = sm.Rectangle(1.0, 0.4)
plate = sm.Shell("plate", shape, skin, (8, 4), model=sm.Modal(1), terms=(cubic_spring,))
more = dict(supports=sm.Clamped("left"), loads=sm.SurfaceForce((0, 0, 300.0)))
sprung = sm.Scene("sprung", plate, **more, scheme="ep", dt=2e-3, t_end=0.04)
for scene in (panel(sm.Modal(4)), sprung):
    (found,) = sm.run(scene, pictures=False).summary["warnings"]
    if MPI.COMM_WORLD.rank == 0:
        print(found["watch"], format(found["value"], ".6f"))
"""


@pytest.mark.mpi
def test_two_ranks_say_what_one_does(mpirun: Callable[..., str]) -> None:
    """Of impacts, and of terms that do nothing at rest."""
    source = RANKED.format(folder=str(Path(__file__).parents[2]))
    one, two = (mpirun(ranks, "-c", source) for ranks in (1, 2))
    assert one == two and one.count("\n") == 2
    assert one.startswith("impacts on modes 0.950") and "terms on modes" in one
