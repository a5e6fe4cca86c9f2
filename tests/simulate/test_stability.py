"""Unstable equilibria of static runs and paths are counted and said, whatever resultants there are.

The kinds: critical loads by closed forms, in twins of units, thickness, cell types and axes; loads
that follow the bodies, where a count means less; branches that are left, and followed in few steps.
"""

import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from scipy.optimize import brentq
from scipy.special import ellipk

import shellmb as sm
from shellmb.scene import (
    Beam,
    Clamped,
    EdgeForce,
    FollowerForce,
    GeneralSection,
    Isotropic,
    JointSpring,
    Line,
    PathFollowing,
    PointForce,
    Probe,
    Rectangle,
    Revolute,
    RigidBody,
    Scene,
    Shell,
)

WIDTH = 0.25


def strip(
    thin: float, load: float, length: float = 1.0, E: float = 200e9, cell: Any = "quad", **more: Any
) -> Scene:
    """A clamped strip under so many of Euler's loads; `nu = 0` makes it a beam."""
    width = WIDTH * length
    euler = math.pi**2 * E * width * (thin * length) ** 3 / 12 / (4 * length**2)
    section = Isotropic(E=E, nu=0.0, thickness=thin * length, density=7850.0)
    mesh = (8, 1) if cell == "quad" else (8, 2)
    return Scene(
        "strip",
        Shell("strip", Rectangle(length, width), section, mesh=mesh, cell=cell),
        supports=Clamped("left"),
        loads=EdgeForce("right", (-load * euler / width, 0, 0)),
        probes=Probe("tip", (length, 0, 0), component=2),
        **{"scheme": "static", "dt": 0.25, "t_end": 1.0, **more},
    )


def said(run: Any) -> list[str]:
    """What a run says of stability."""
    return [each for each in run.warnings if "unstable" in each]


@pytest.mark.parametrize("cell", ["quad", "tri"])
@pytest.mark.parametrize(("thin", "length", "E"), [(1e-2, 1.0, 200e9), (2e-4, 1000.0, 200e3)])
def test_a_strip_says_how_many_of_its_critical_loads_are_passed(
    thin: float, length: float, E: float, cell: str
) -> None:
    """They are 1, 9, 25 times Euler's: none, one, two directions."""
    for load, count in ((0.9, 0), (2.0, 1), (15.0, 2)):
        run = sm.run(strip(thin, load, length, E, cell))
        if count == 0:
            assert not said(run)
            continue
        (sentence,) = said(run)
        assert f"unstable in {count} direction" in sentence and "load factor 1" in sentence
    # it begins at a fifteenth of the load, before the first of four steps
    assert "as those from t = 0.25 on" in sentence


def test_large_systems_are_looked_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of states that nobody counted nothing is said; "as those from t = 1 on" was."""
    monkeypatch.setattr("shellmb.diagnostics.statics.CHEAP", 0)
    (sentence,) = said(sm.run(strip(1e-2, 2.0)))
    assert "unstable in 1 direction: the structure" in sentence


def test_what_is_passed_on_the_way_is_said() -> None:
    """Straight all the time, far beyond its load in the middle and unloaded at the end."""
    scene = strip(1e-2, 1.8)
    load = scene.loads[0]
    there = sm.EdgeForce(load.at, load.force, time=lambda t: min(t, 1.0 - t) * 2)
    run = sm.run(replace(scene, loads=there))
    (sentence,) = said(run)
    assert "intermediate equilibria were unstable in up to 1 direction" in sentence
    assert "first at t = 0.5" in sentence


def column(load: Any, axis: int = 2) -> Scene:
    """A clamped column of the kind of a beam, `EI = L = 1`."""
    section = GeneralSection([1e5, 5e4, 5e4, 1, 1, 1], mass_per_length=1.0)
    end, up = [tuple(float(k == j) for k in range(3)) for j in (axis, (axis + 1) % 3)]
    beam = Beam("column", Line((0, 0, 0), end), section, elements=6, up=up)
    loads = load(end)
    options: dict[str, Any] = {"scheme": "static", "dt": 0.5, "t_end": 1.0}
    return Scene("column", beams=beam, supports=Clamped("start"), loads=loads, **options)


@pytest.mark.parametrize("axis", [0, 2])
def test_a_column_of_beams_buckles_in_both_planes(axis: int) -> None:
    """Two directions for each critical load; of a column that is pulled none."""

    def pushed(force: float) -> Any:
        return lambda end: PointForce("end", tuple(-force * e for e in end))

    assert "unstable in 2 directions" in said(sm.run(column(pushed(4.0), axis)))[0]
    assert "unstable in 4 directions" in said(sm.run(column(pushed(30.0), axis)))[0]
    assert not said(sm.run(column(pushed(-30.0), axis)))


def test_loads_that_follow_a_column_have_no_count() -> None:
    """Beck's column has no other equilibrium at any load: statics has nothing to say of it."""
    run = sm.run(column(lambda end: FollowerForce("end", (-30.0, 0, 0))))
    assert not said(run)


def test_an_inverted_pendulum_on_a_spring() -> None:
    """A mechanism of a rigid body: it falls from `k = m g l` on, the force above the hinge."""

    def scene(stiffness: float) -> Scene:
        return Scene(
            "pendulum",
            rigid_bodies=RigidBody("bar", mass=1.0, inertia=(1.0, 1.0, 1.0), position=(0, 0, 2.0)),
            joints=Revolute("hinge", "ground", "bar", at=(0, 0, 0), axis=(0, 1, 0)),
            force_elements=JointSpring("spring", "hinge", stiffness=stiffness),
            loads=sm.Gravity((0, 0, -10.0)),
            scheme="static",
            dt=0.5,
            t_end=1.0,
        )

    assert "unstable in 1 direction:" in said(sm.run(scene(19.0)))[0]
    assert not said(sm.run(scene(21.0)))


@pytest.mark.parametrize(("thin", "length", "E"), [(2e-4, 1.0, 200e9), (1.5e-4, 1000.0, 200e3)])
def test_thin_strips_bifurcate_at_eulers_load(thin: float, length: float, E: float) -> None:
    """Between 1e-4 and 5e-4 of the length eliminated resultants leave few digits to a count."""
    path = PathFollowing(load_end=1.5, branches="detect")
    run = sm.run(strip(thin, 1.0, length, E, dt=0.2, t_end=5.0, path=path))
    (point,) = run.summary["path"]
    assert (point["kind"], point["before"], point["after"]) == ("bifurcation", 0, 1)
    # eight elements: 1e-3
    assert point["load_factor"] == pytest.approx(1.0, abs=3e-3)
    assert not run.history["unstable"].isna().any()
    assert run.history["unstable"].iloc[-1] == 1


def test_a_path_of_following_loads_says_what_it_does_not_know() -> None:
    """Counts of a matrix that is not symmetric are left out, and that is said."""
    scene = column(lambda end: FollowerForce("end", (-5.0, 0, 0)))
    path = PathFollowing(load_end=1.0)
    run = sm.run(replace(scene, path=path, t_end=3.0))
    (sentence,) = [each for each in run.warnings if "not known" in each]
    assert "not symmetric" in sentence


@pytest.mark.parametrize("thin", [1e-2, 1e-3])
def test_the_branch_of_a_buckled_strip_takes_few_steps(thin: float) -> None:
    """Up to 1.5 of Euler's load by the default steps; the end as the elastica has it.

    `P/P_E = (2 K(k)/pi)^2` with `k = sin(alpha/2)`, and the end is aside by `2 k/sqrt(P/EI)`.
    Nothing on the branch, where the load hardly changes to begin with, is a bifurcation.
    """
    path = PathFollowing(load_end=1.5, branches="switch")
    run = sm.run(strip(thin, 1.0, dt=0.2, t_end=1e9, path=path))
    assert [point["kind"] for point in run.summary["path"]] == ["bifurcation"]
    assert run.history["load_factor"].iloc[-1] == pytest.approx(1.5, rel=1e-8)
    # 19 and 20 were seen
    assert len(run.history) < 40
    k = brentq(lambda k: (2 * ellipk(k**2) / math.pi) ** 2 - 1.5, 0.1, 0.99)
    exact = 2 * k / (math.pi / 2 * math.sqrt(1.5))
    # eight elements, and shear of the thicker one
    assert abs(run.history["tip"].iloc[-1]) == pytest.approx(exact, rel=5e-3)


def test_a_path_that_ends_before_its_load_says_so_and_how_long_it_has_to_be() -> None:
    """Arc length grows like the load at the start: behind the bifurcation 50 of it are nothing."""
    path = PathFollowing(load_end=1.5, branches="switch")
    run = sm.run(strip(1e-2, 1.0, dt=0.2, t_end=50.0, path=path))
    (sentence,) = run.warnings
    assert "load_end = 1.5 is not reached" in sentence
    # one figure of the length is told, of which half a path of the branch takes
    enough = float(re.search(r"of the order of (\S+),", sentence)[1])
    assert enough == pytest.approx(run.computed.simulation.size.farthest / 0.05, rel=0.5)
    run = sm.run(strip(1e-2, 1.0, dt=0.2, t_end=2 * enough, path=path))
    assert run.history["load_factor"].iloc[-1] == pytest.approx(1.5, rel=1e-8) and not run.warnings


# below and beyond critical loads; loads that follow; a path
RANKED = """
import sys
sys.path.insert(0, {folder!r})
from test_stability import *
from mpi4py import MPI

def say(*what):
    if MPI.COMM_WORLD.rank == 0:
        print(*what, flush=True)

for name, scene in {{
    "below": strip(1e-2, 0.9), "quad": strip(2e-4, 2.0), "tri": strip(1e-2, 15.0, cell="tri"),
    "beam": column(lambda end: PointForce("end", (0, 0, -4.0))),
    "follower": column(lambda end: FollowerForce("end", (-30.0, 0, 0))),
}}.items():
    say(name, *(s.split(" unstable in ")[1].split(" ")[0] for s in said(sm.run(scene))))
path = PathFollowing(load_end=1.5, branches="detect")
run = sm.run(strip(1e-2, 1.0, dt=0.2, t_end=5.0, path=path))
say("path", *(f"{{p['load_factor']:.6f}}" for p in run.summary["path"]))
"""


@pytest.mark.mpi
def test_several_ranks_count_and_say_what_one_does(
    mpirun: Callable[..., str], tmp_path: Path
) -> None:
    """The matrix, its symmetry and its pivots are shared between them."""
    source = RANKED.format(folder=str(Path(__file__).parent))
    one, two = (mpirun(ranks, "-c", source).split("\n") for ranks in (1, 2))
    assert one == two
    assert one[:5] == ["below", "quad 1", "tri 2", "beam 2", "follower"]
    assert one[5].startswith("path ")
