"""Path following: limit points, bifurcations and branches with closed forms, and its failures."""

import io
import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from shellmb.demos import hinged_roof, lateral_plate
from shellmb.errors import ConvergenceError
from shellmb.observers.progress import ProgressReport
from shellmb.running.execute import execute
from shellmb.scene import (
    GROUND,
    Clamped,
    FollowerEdgeForce,
    Isotropic,
    PathFollowing,
    PointForce,
    Prismatic,
    Probe,
    Rectangle,
    RigidBody,
    Scene,
    Shell,
    Solver,
    Spring,
    StepControl,
)
from shellmb.simulate.paths import levels
from shellmb.simulate.paths.arclength import PathSteps

STIFFNESS, HALF_SPAN = 2.0, 1.0


def truss(rise: float, sideways: bool = False, **path: Any) -> Scene:
    """Two springs that meet at the height `rise`, pushed down there; free to go sideways or not."""
    top = (0.0, 0.0, rise)
    # of no interest, but a rigid body has them
    inertia = {"mass": 1.0, "inertia": (1.0, 1.0, 1.0), "position": top}
    bodies = [RigidBody("post", **inertia)]
    joints: list[Any] = [Prismatic("guide", GROUND, "post", at=top, axis=(0, 0, 1))]
    if sideways:
        bodies.append(RigidBody("slide", **inertia))
        joints.append(Prismatic("rail", "post", "slide", at=top, axis=(1, 0, 0)))
    head = bodies[-1].name
    springs = [
        Spring(f"bar {k}", GROUND, head, at=(x, 0, 0), second_at=top, stiffness=STIFFNESS)
        for k, x in enumerate((-HALF_SPAN, HALF_SPAN))
    ]
    probes = [Probe(name, top, component=k, body=head) for name, k in (("w", 2), ("u", 0))]
    return Scene(
        "truss",
        rigid_bodies=bodies,
        joints=joints,
        force_elements=springs,
        loads=PointForce(top, (0.0, 0.0, -STIFFNESS), body=head),
        probes=probes,
        scheme="static",
        dt=0.02,
        t_end=10.0,
        path=PathFollowing(**path),
    )


def truss_load(height: float, rise: float) -> float:
    """Load factor at which the head of the truss, in the middle, stands at a height."""
    length, natural = math.hypot(HALF_SPAN, height), math.hypot(HALF_SPAN, rise)
    return 2 * (natural - length) * height / length


def limit_height(rise: float) -> float:
    """Height at the limit point, where `l^3 = l0 b^2`: the vertical stiffness vanishes."""
    natural = math.hypot(HALF_SPAN, rise)
    return math.sqrt((natural * HALF_SPAN**2) ** (2 / 3) - HALF_SPAN**2)


def tip(load_end: float = 1.3, **more: Any) -> Scene:
    """The lateral plate as a beam of few elements."""
    scene = lateral_plate.scene("beam", load_end=load_end, **more)
    return scene.with_options(mesh=(4, 1))


def test_a_truss_goes_through_both_limit_points() -> None:
    """On the exact curve at every step, and extremes that Newton's method locates."""
    rise = 0.5
    run = execute(truss(rise, load_end=0.2))
    history = run.history
    exact = [truss_load(rise + w, rise) for w in history["w"]]
    # to the tolerance of Newton's method
    np.testing.assert_allclose(history["load_factor"], exact, atol=1e-8)
    first, second = run.simulation.path.points
    largest = truss_load(limit_height(rise), rise)
    assert (first.kind, second.kind) == ("limit point", "limit point")
    # to the square of the rate at which the load stands still; 1e-15 was seen
    assert first.load_factor == pytest.approx(largest, rel=1e-12)
    assert second.load_factor == pytest.approx(-largest, rel=1e-12)
    assert first.after - first.before == 1
    assert second.after == first.before
    assert run.summary["path"][0]["load_factor"] == first.load_factor


def test_a_limit_point_that_is_not_located_is_named(monkeypatch) -> None:
    rise = 0.5
    largest = truss_load(limit_height(rise), rise)
    monkeypatch.setattr(levels, "MOST", 1)
    run = execute(truss(rise, load_end=0.2))
    (caution,) = run.warnings
    assert "near the load factor 0.0429" in caution.says and "(2 in all)" in caution.says
    # the cubic's: the step is a tenth of the path between the limit points
    first, _ = run.simulation.path.points
    assert 1e-7 < abs(first.load_factor / largest - 1) < 1e-3


def test_looking_for_limit_points_moves_no_other_point(monkeypatch) -> None:
    exact = execute(truss(0.5, load_end=0.2)).history
    nowhere = levels.Limit(np.zeros(0), 1.0, np.zeros(0))
    monkeypatch.setattr(PathSteps, "_locate_limit", lambda path: nowhere)
    other = execute(truss(0.5, load_end=0.2)).history
    for column in exact.columns.difference(["wall_s"]):
        np.testing.assert_array_equal(exact[column], other[column])


def test_rates_and_stability_are_columns_of_the_history() -> None:
    """The rate is that of the closed form, over that at the start: the unit of arc length."""
    rise = 0.5
    history = execute(truss(rise, load_end=0.2)).history
    natural, length = math.hypot(HALF_SPAN, rise), np.hypot(HALF_SPAN, rise + history["w"])
    exact = (natural * HALF_SPAN**2 / length**3 - 1) / (HALF_SPAN**2 / natural**2 - 1)
    # to the tolerance of Newton's method
    np.testing.assert_allclose(history["load_rate"], exact, atol=1e-7)
    np.testing.assert_array_equal(history["unstable"], np.where(exact < 0, 1, 0))


def test_steps_end_on_load_levels_and_on_the_last_load() -> None:
    """Every time the path passes them, on both sides of a limit point; and nowhere is it changed.

    The last level is beyond the largest load and is never met.
    """
    rise, end = 0.5, -0.04
    largest = truss_load(limit_height(rise), rise)
    levels = (0.5 * largest, 0.99999 * largest, -0.02, 1.00001 * largest)
    run = execute(truss(rise, load_end=end, load_levels=levels))
    history = run.history
    factors = history["load_factor"].to_numpy()
    met = [
        k for level in levels for k in np.flatnonzero(np.abs(factors - level) < 1e-9 * abs(level))
    ]
    assert len(met) == 2 + 2 + 1 + 0
    assert factors[-1] == pytest.approx(end, abs=1e-9)
    exact = [truss_load(rise + w, rise) for w in history["w"]]
    # to the tolerance of Newton's method
    np.testing.assert_allclose(factors, exact, atol=1e-8)
    assert run.simulation.size.rejected == 0
    (point,) = run.simulation.path.points
    # steps that end there make the cubic better than that of `test_a_truss_goes_through_both...`
    assert point.load_factor == pytest.approx(largest, rel=1e-6)
    # a step that was cut does not change the length of those after it
    plain = execute(truss(rise, load_end=end)).simulation
    assert run.simulation.step <= plain.step + len(met)


def test_small_levels_are_met_as_exactly_as_large_ones() -> None:
    """Relative to the level, whatever the loads around are."""
    run = execute(replace(truss(0.5, load_levels=(1e-6, 50.0)), t_end=20.0, dt=0.2))
    factors = run.history["load_factor"].to_numpy()
    for level in (1e-6, 50.0):
        # to the tolerance of Newton's method
        assert np.abs(factors - level).min() < 5e-9 * level


def test_a_level_next_to_a_bifurcation_and_one_on_a_branch() -> None:
    """Levels and bifurcations shorten steps in either order; the path itself stays what it was."""
    rise = 3.0
    plain = execute(truss(rise, sideways=True, load_end=-0.1, branches="switch"))
    first = plain.simulation.path.points[0].load_factor
    levels = (first - 1e-4, 0.5)
    run = execute(truss(rise, sideways=True, load_end=-0.1, load_levels=levels, branches="switch"))
    found = [p.load_factor for p in run.simulation.path.points]
    np.testing.assert_allclose(
        found, [p.load_factor for p in plain.simulation.path.points], rtol=1e-5
    )
    factors = run.history["load_factor"].to_numpy()
    for level in levels:
        assert np.abs(factors - level).min() < 1e-9
    assert run.simulation.path.factor == pytest.approx(-0.1, abs=1e-9)


def test_progress_shows_the_load() -> None:
    """A line for every tenth of the load, though the arc length is far from its longest."""
    console = Console(file=io.StringIO(), width=200)
    execute(truss(0.5, load_end=0.1), observers=[ProgressReport(console)])
    said = console.file.getvalue().splitlines()
    assert "path from load factor 0 to 0.1, arc length t = 0 to 10" in said[0]
    assert any(re.search(r"step \d+, load factor 0\.0[3-9]\d*, t = ", line) for line in said[1:])
    assert "load factor 0.1, " in said[-1]


def test_a_steep_truss_bifurcates_where_its_lateral_stiffness_vanishes() -> None:
    """`l^3 = l0 z^2`, before its limit point; behind it two directions are unstable."""
    rise = 3.0
    natural = math.hypot(HALF_SPAN, rise)
    run = execute(truss(rise, sideways=True, load_end=-0.1))
    points = [p for p in run.simulation.path.points if p.kind == "bifurcation"]
    heights = np.linspace(2.0, rise, 200_001)
    length = np.hypot(HALF_SPAN, heights)
    critical = heights[np.argmin(np.abs(length**3 - natural * heights**2))]
    assert points[0].load_factor == pytest.approx(truss_load(critical, rise), rel=1e-5)
    assert run.history["unstable"].max() == 2
    # at the bifurcation, which is found to 1e-10, nothing holds it: round-off of 1e-16 over that
    sideways = run.history["u"].abs()
    at = (run.history["load_factor"] - points[0].load_factor).abs() < 1e-6
    assert at.sum() == 1
    assert sideways[at].max() < 1e-5
    assert sideways[~at].max() < 1e-9


@pytest.mark.parametrize("side", [1, -1])
def test_the_branch_of_the_truss(side: int) -> None:
    """Behind the bifurcation the head moves sideways; springs and load stay in balance."""
    rise = 3.0
    scene = replace(truss(rise, True, branches="switch", side=side), t_end=1.2)
    run = execute(scene)
    (point, *_) = run.simulation.path.points
    assert point.switched
    last = run.history.iloc[-1]
    assert last["u"] * side > 0.3
    natural = math.hypot(HALF_SPAN, rise)
    force = np.zeros(2)
    for x in (-HALF_SPAN, HALF_SPAN):
        bar = np.array([last["u"] - x, rise + last["w"]])
        length = np.linalg.norm(bar)
        force += STIFFNESS * (natural - length) * bar / length
    np.testing.assert_allclose(force, [0.0, STIFFNESS * last["load_factor"]], atol=1e-7)


def test_a_branch_is_where_imperfect_plates_go() -> None:
    """The branch against plain load steps with a small force sideways, of another code path."""
    ratio, load = 1.3, lateral_plate.unit_load(lateral_plate.THICKNESS)
    branch = execute(tip(ratio)).history
    disturbed = replace(
        tip(),
        loads=PointForce("end", (0.0, 1e-3 * load, -ratio * load)),
        path=None,
        step_control=StepControl(),
        dt=0.02,
        t_end=1.0,
    )
    wanted = execute(disturbed).history.iloc[-1]
    sideways = np.interp(wanted["down"], branch["down"][::-1], branch["sideways"].abs()[::-1])
    at = np.interp(wanted["down"], branch["down"][::-1], branch["load_factor"][::-1])
    # the force of 1e-3 of the load, and lines between the steps of the path
    assert at == pytest.approx(ratio, rel=5e-3)
    assert sideways == pytest.approx(abs(wanted["sideways"]), rel=1e-2)


def test_both_sides_mirror_one_another() -> None:
    ends = [execute(tip(side=side)).history.iloc[-1] for side in (1, -1)]
    assert ends[0]["sideways"] == pytest.approx(-ends[1]["sideways"], rel=1e-6)
    assert ends[0]["down"] == pytest.approx(ends[1]["down"], rel=1e-6)
    assert abs(ends[0]["sideways"]) > 0.3


def test_a_coarse_roof_snaps_through() -> None:
    """Two elements per side: limit loads within 2 % of the table's."""
    run = execute(hinged_roof.scene().with_options(mesh=(2, 2)), results=hinged_roof.results)
    assert run.results["curve_error"] < hinged_roof.CURVE_TOLERANCE
    assert run.results["first_limit_load_error"] < hinged_roof.LIMIT_TOLERANCE
    assert run.results["limit_points_expected"] == len(run.simulation.path.points) == 2
    assert run.results["unstable_at_end"] == 0
    assert run.simulation.size.rejected == 0
    # the step grows: with its first length it would take sixty
    assert run.simulation.step < 25


def test_a_branch_comes_back_and_is_left_again() -> None:
    """The whole roof tilts and rights itself: where its own path regains that stability.

    Along the branch no eigenvalue changes sign there; the load turns round.
    """
    roof = hinged_roof.scene(whole=True).with_options(mesh=(6, 3))
    symmetric = execute(replace(roof, path=PathFollowing(load_end=0.8))).simulation.path
    path = PathFollowing(load_end=0.8, branches="switch", switches=2, side=-1)
    tilting = execute(replace(roof, path=path)).simulation.path
    assert symmetric is not None
    assert tilting is not None
    first, last = (
        [p for p in followed.points if p.kind == "bifurcation"] for followed in (symmetric, tilting)
    )
    assert len(first) == len(last) == 2
    assert [p.switched for p in last] == [True, True]
    loads = [[p.load_factor for p in points] for points in (first, last)]
    # the same point from two paths, each by interpolation
    np.testing.assert_allclose(loads[0], loads[1], rtol=1e-5)
    assert (symmetric.unstable, tilting.unstable) == (0, 0)
    assert tilting.factor == pytest.approx(0.8, abs=1e-9)


def test_two_ranks_follow_the_same_path(mpirun: Any) -> None:
    source = (
        "from shellmb.demos.hinged_roof import scene\n"
        "from shellmb.running.execute import execute\n"
        "run = execute(scene(load_end=0.7).with_options(mesh=(2, 2)))\n"
        "path = run.simulation.path\n"
        "if run.simulation.model.comm.rank == 0:\n"
        "    print(repr(path.factor), path.unstable, len(path.points))\n"
    )
    alone = execute(hinged_roof.scene(load_end=0.7).with_options(mesh=(2, 2))).simulation.path
    factor, unstable, points = mpirun(2, "-c", source).split()
    assert alone is not None
    assert (int(unstable), int(points)) == (alone.unstable, len(alone.points))
    # the tolerance of Newton's method, over some ten steps
    assert float(factor) == pytest.approx(alone.factor, rel=1e-7)


def test_a_follower_load_has_no_inertia_and_a_path() -> None:
    """Its stiffness is not symmetric: the path goes on, its stability is not known."""
    shell = Shell("strip", Rectangle(1.0, 0.2), Isotropic(1.0, 0.0, thickness=0.01), mesh=(4, 1))
    scene = Scene(
        "follower",
        shell,
        supports=Clamped("left"),
        loads=FollowerEdgeForce("right", (0.0, 0.0, 1e-6)),
        probes=Probe("w", (1.0, 0.0, 0.0), component=2),
        dt=0.1,
        t_end=0.5,
        path=PathFollowing(),
    )
    history = execute(scene).history
    assert history["unstable"].isna().to_numpy()[1:].all()
    assert history["load_factor"].iloc[-1] > 0.4


def test_a_sharp_turn_at_the_smallest_step_is_an_error() -> None:
    roof = hinged_roof.scene().with_options(mesh=(2, 2))
    scene = replace(
        roof, path=PathFollowing(turn_deg=0.1), dt=0.3, step_control=StepControl(min_dt=0.2)
    )
    with pytest.raises(ConvergenceError, match=r"t = 0, step 1, .*turns by \d+ degrees"):
        execute(scene)


def test_too_few_iterations_are_an_error() -> None:
    scene = replace(
        hinged_roof.scene().with_options(mesh=(2, 2)),
        solver=Solver(max_iterations=1),
        step_control=StepControl(min_dt=0.02),
    )
    with pytest.raises(ConvergenceError, match="too many iterations"):
        execute(scene)


@pytest.mark.slow
@pytest.mark.parametrize("thickness", [12.7, 6.35])
@pytest.mark.parametrize("plies", ["isotropic", "0/90/0", "90/0/90"])
def test_all_roofs(thickness: float, plies: Any) -> None:
    """8x8 elements on the quarter, every tabulated point, limit loads within 2 %."""
    run = execute(hinged_roof.scene(thickness, plies), results=hinged_roof.results)
    hinged_roof.check(run.results)
