"""Derivatives of static paths: of their points, and of what they report of limits and branches.

The kind: whatever a path reports has the derivative that whole paths beside it give, whose steps
are as long. Where a closed form is known, that is the reference.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import shellmb as sm
from shellmb.demos import lateral_plate
from shellmb.options.run import Options
from shellmb.running.execute import RunResult, execute
from shellmb.simulate.simulation import BaseObserver, Simulation
from tests.sensitivity import scenes
from tests.sensitivity.path_scenes import bent, followed, frame, pressed, roof, truss
from tests.sensitivity.test_exact import NOISE, SHARP, TIGHT, ZERO, largest, stem
from tests.sensitivity.test_resume import stopped_at

EXACT = 1e-6


def load(height: float, rise: float, stiffness: float, span: float, push: float) -> float:
    """Load factor of the truss whose head is at a height in the middle."""
    long, natural = math.hypot(span, height), math.hypot(span, rise)
    return 2 * stiffness * (natural - long) * height / long / push


def slope(function: Callable[..., float], name: str, at: dict[str, float]) -> float:
    """Derivative of a closed form, to 1e-10 of it."""
    h = 1e-5 * at[name]
    return (function(**at | {name: at[name] + h}) - function(**at | {name: at[name] - h})) / (2 * h)


def limit_load(rise: float, stiffness: float, span: float, push: float) -> float:
    """Load factor at which the truss snaps: there `l^3 = l0 b^2`."""
    natural = math.hypot(span, rise)
    height = math.sqrt((natural * span**2) ** (2 / 3) - span**2)
    return load(height, rise, stiffness, span, push)


def critical_load(rise: float, stiffness: float, span: float, push: float) -> float:
    """Load factor at which the truss gives way sideways: there `l^3 = l0 z^2`."""
    natural = math.hypot(span, rise)
    # cubic in the square of the length: l^3 = l0 (l^2 - b^2)
    roots = np.roots([1.0, -natural, 0.0, natural * span**2])
    long = max(float(r.real) for r in roots if abs(r.imag) < 1e-9 and span < r.real < natural)
    return load(math.sqrt(long**2 - span**2), rise, stiffness, span, push)


SHALLOW = {"rise": 0.5, "stiffness": 2.0, "span": 1.0, "push": 2.0}
STEEP = SHALLOW | {"rise": 3.0}


class Steps(BaseObserver):
    """Gives a run the steps of another one; those that end early may be longer.

    Args:
        lengths: Their lengths.
        early: Numbers of the steps that end at load levels.
    """

    def __init__(self, lengths: np.ndarray, early: set[int]) -> None:
        self._lengths, self._early = lengths, early

    def start(self, simulation: Simulation) -> None:
        self.accepted(simulation)

    def accepted(self, simulation: Simulation) -> None:
        k = simulation.step
        if k < len(self._lengths):
            simulation.size.dt = self._lengths[k] * (2.0 if k in self._early else 1.0)


def assert_exact(
    make: Callable[..., sm.Scene],
    names: tuple,
    within: float = EXACT,
    tangents: float = 0.0,
    apart: float = 1e-4,
) -> sm.Sensitivities:
    """Derivatives of all columns are those of whole paths with these steps.

    Args:
        make: Makes the scene.
        names: Parameters.
        within: Largest relative difference.
        tangents: Error of the tangents of the runs compared with, from which their rates follow.
        apart: Relative change of a parameter in the runs compared with.
    """
    found = sm.sensitivities(make, names, fields=False, **TIGHT)
    run, path = found.run.history, make().path
    levels = [*path.load_levels, path.load_end]
    factors, lengths = run["load_factor"].to_numpy(), np.diff(run["t"])
    early = {k for k, f in enumerate(factors[1:]) if any(abs(f - e) < 1e-9 for e in levels if e)}

    def beside(**value: float) -> RunResult:
        scene = make(**value)
        scene = replace(scene, solver=replace(scene.solver, **SHARP))
        return execute(scene, observers=[Steps(lengths, early)])

    for p in found.parameters:
        above, below = p.value * (1 + apart), p.value * (1 - apart)
        a, b = (beside(**{p.name: v}).history for v in (above, below))
        exact = {c: ((a[c] - b[c]) / (above - below)).to_numpy() for c in a}
        compared = 0
        for column in found.history[p.name].columns:
            # what a path that ignores branches does not count has no number
            if column in NOISE or run[column].isna().all():
                continue
            wrong, size = (
                largest(found.history[p.name][column] - exact[column]),
                largest(exact[column]),
            )
            same = [c for c in exact if stem(c) == stem(column)]
            alike, size_of = (max(largest(of[c]) for c in same) for of in (exact, run))
            round_off = ZERO * max(alike, size_of / abs(p.value))
            if column == "load_rate":
                round_off += tangents * size_of / (apart * abs(p.value))
            assert wrong <= within * size + round_off + 1e-9, (p.name, column, wrong / size)
            compared += size > round_off
        assert compared > 3
    return found


def test_points_of_a_path_have_exact_derivatives() -> None:
    """Through a limit point, and on a load level, which the path passes twice, and another one."""
    found = assert_exact(
        lambda rise=0.5: truss(rise, load_levels=(0.03,), load_end=-0.02),
        ("rise",),
    )
    assert found.path.kind.tolist() == ["limit point"]


def test_limit_loads_have_the_derivatives_of_their_closed_form() -> None:
    found = sm.sensitivities(truss, tuple(SHALLOW), columns="probes", **TIGHT)
    assert found.path.kind.tolist() == ["limit point"] * 2
    for name in SHALLOW:
        exact = slope(limit_load, name, SHALLOW)
        # the second one is the first one upside down; differences of scenes leave 1e-8
        np.testing.assert_allclose(found.path[name], [exact, -exact], rtol=1e-7)
    # with the stiffness all loads grow in proportion, exactly
    assert found.path.stiffness[0] * 2.0 == pytest.approx(limit_load(**SHALLOW), rel=1e-8)
    rows = {row.name: row.derivative for row in found.rows("rise")}
    assert rows["limit point 1, load factor"] == found.path.rise[0]


def test_at_a_load_the_curve_has_the_derivatives_of_its_closed_form() -> None:
    """`dw/dp = -(df/dp) / (df/dw)`, which grows without bound at limit points."""
    names = ("rise", "stiffness", "span")
    found = sm.sensitivities(truss, names, columns="probes", at="load", **TIGHT)
    run = found.run.history
    assert (found.history.xs("load_factor", axis=1, level=1) == 0).all(axis=None)
    for name in names:
        for w, rate, mine in zip(run["w"], run["load_rate"], found.history[name]["w"], strict=True):
            at = SHALLOW | {"height": SHALLOW["rise"] + w}
            steep = slope(load, "height", at) if at["height"] else math.nan
            by = slope(load, name, at) + (steep if name == "rise" else 0.0)
            if abs(rate) > 0.05:
                # near limit points the second derivative of the sides is in it, too
                assert mine == pytest.approx(-by / steep, rel=1e-5, abs=1e-9), (name, w)
    # both kinds of derivatives are of one curve
    assert found.path["rise"][0] == pytest.approx(slope(limit_load, "rise", SHALLOW), rel=1e-7)


def test_derivatives_at_a_load_next_to_the_limit_are_named() -> None:
    near = limit_load(**SHALLOW) * (1 - 1e-6)
    found = sm.sensitivities(truss, ("rise",), values={"load_end": near}, columns="probes", **TIGHT)
    (said,) = found.warnings
    assert "0.0429143 is next to a limit point: derivatives by 'rise' at that load" in said


def test_taylor_remainder_is_of_second_order() -> None:
    def head(rise: float) -> float:
        scene = truss(rise, load_end=0.03)
        run = execute(replace(scene, solver=replace(scene.solver, **SHARP)))
        return float(run.column("w")[-1])

    found = sm.sensitivities(truss, ("rise",), values={"load_end": 0.03}, **TIGHT)
    by, start = found.history["rise"]["w"].iloc[-1], head(0.5)
    rest = [abs(head(0.5 * (1 + h)) - start - 0.5 * h * by) for h in (1e-2, 5e-3)]
    # 0.05: terms of third order
    assert abs(math.log2(rest[0] / rest[1]) - 2) < 0.05


@pytest.mark.parametrize("branches", ["detect", pytest.param("switch", marks=pytest.mark.slow)])
def test_bifurcations_have_the_derivatives_of_their_closed_form(branches: str) -> None:
    given = {"rise": 3.0, "sideways": True, "branches": branches, "t_end": 1.6}
    found = sm.sensitivities(truss, ("rise", "stiffness", "span"), values=given, **TIGHT)
    assert found.path.kind.tolist() == ["bifurcation"]
    for name in ("rise", "stiffness", "span"):
        # where the eigenvalue is looked for: 1e-4 of its first value, and its square in the load
        assert found.path[name][0] == pytest.approx(slope(critical_load, name, STEEP), rel=1e-6)
    if branches == "detect":
        return
    # on the branch both bars push the head to where it stands: forces are in balance
    last, by = found.run.history.iloc[-1], found.history["stiffness"].iloc[-1]

    def rest(p: np.ndarray) -> np.ndarray:
        u, w, factor, stiffness = p
        force = np.zeros(2)
        for x in (-1.0, 1.0):
            bar = np.array([u - x, 3.0 + w])
            long = np.linalg.norm(bar)
            force += stiffness * (math.hypot(1.0, 3.0) - long) * bar / long
        return force - [0.0, 2.0 * factor]

    point = np.array([last["u"], last["w"], last["load_factor"], 2.0])
    along = np.array([by["u"], by["w"], by["load_factor"], 1.0])
    off = (rest(point + 1e-5 * along) - rest(point - 1e-5 * along)) / 2e-5
    assert np.abs(rest(point)).max() < 1e-8
    # relative to what each bar changes by, of 1
    assert np.abs(off).max() < 1e-7


def test_an_imperfection_has_no_derivative_at_a_bifurcation() -> None:
    given = {"rise": 3.0, "sideways": True, "t_end": 1.0}
    found = sm.sensitivities(
        truss, ("rise", "across"), values=given, scales={"across": 1.0}, columns="probes"
    )
    (said,) = found.warnings
    assert "bifurcation at the load factor 0.783" in said and "by 'across', which is an" in said
    assert np.isnan(found.path["across"][0]) and np.isfinite(found.path["rise"][0])


def test_run_is_bit_for_bit_that_without_derivatives() -> None:
    alone = execute(truss(t_end=0.1))
    beside = sm.sensitivities(truss, ("rise",), values={"t_end": 0.1}, fields=False)
    for name in set(alone.rows[0]) - {"wall_s"}:
        np.testing.assert_array_equal(alone.column(name), beside.run.history[name], name)
    assert alone.summary["path"] == beside.run.summary["path"]


def test_a_stiffer_roof_carries_in_proportion() -> None:
    """`dlog(limit load)/dlog(E) = 1`, for shells with directors that depend on nothing here."""
    found = sm.sensitivities(roof, ("E",), columns="probes", values={"t_end": 2.0}, **TIGHT)
    (point,) = found.path.to_dict("records")
    # the load itself is interpolated between points: 2e-5 of it
    assert point["E"] * 3102.75 == pytest.approx(point["load_factor"], rel=2e-4)


@pytest.mark.slow
def test_paths_of_roofs_have_exact_derivatives() -> None:
    def make(radius: float = 2540.0, thickness: float = 12.7, E: float = 3102.75) -> sm.Scene:
        return roof(radius, E, thickness, load_levels=(0.5,), load_end=1.0)

    found = assert_exact(make, ("radius", "thickness", "E"))
    # limit loads against those of paths with short steps, whose error is of fourth order
    fine = sm.StepControl(max_dt=0.02)
    h = 1e-3
    above, below = (
        execute(replace(roof(thickness=12.7 * (1 + s * h), load_end=1.0), step_control=fine))
        for s in (1, -1)
    )
    for k, mine in enumerate(found.path.thickness):
        loads = [run.summary["path"][k]["load_factor"] for run in (above, below)]
        assert mine == pytest.approx((loads[0] - loads[1]) / (2 * h * 12.7), rel=1e-5)


@pytest.mark.slow
def test_roofs_in_other_units_have_the_same_derivatives() -> None:
    """Relative derivatives are numbers without a unit; the unit of length is none of the scene."""
    one, other = (
        sm.sensitivities(roof, ("thickness", "radius"), values=given, columns="probes", **TIGHT)
        for given in ({"load_end": 1.0}, {"load_end": 1.0, "unit": 1e-3})
    )
    for name in ("thickness", "radius"):
        np.testing.assert_allclose(one.path[name], other.path[name], rtol=1e-6)
        same = one.logarithmic[name]["w"].to_numpy(), other.logarithmic[name]["w"].to_numpy()
        np.testing.assert_allclose(*same, rtol=1e-6, atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("make", "names", "within", "apart"),
    [
        # the reference: runs know these paths to 1e-9, over differences of 2e-4
        (bent, ("thickness", "angle", "length"), 1e-5, 1e-4),
        # contact begins on the way
        (pressed, ("thickness", "stiffness", "gap", "force"), 1e-5, 1e-4),
        # steep at its end: differences are off by the square of `apart`, 1.7e-4 at 1e-4
        (frame, ("E", "width", "length"), 1e-4, 1e-5),
    ],
)
def test_other_paths_have_exact_derivatives(
    make: Callable[..., sm.Scene], names: tuple, within: float, apart: float
) -> None:
    assert_exact(make, names, within, apart=apart)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::shellmb.errors.ShellmbWarning")
def test_follower_loads_have_exact_derivatives() -> None:
    # without a count of unstable directions tangents are those of the reduced system
    assert_exact(followed, ("thickness", "length"), within=1e-5, tangents=1e-6)


@pytest.mark.slow
def test_frames_of_lee_obey_their_laws_of_scale() -> None:
    """`dlog(limit load)` is 1 by `E`, and 2 by all lengths: -2 by length, 4 by the section."""
    found = sm.sensitivities(frame, ("E", "length", "width"), columns="probes", **TIGHT)
    values = {"E": 720.0, "length": 120.0, "width": 3.0}
    assert len(found.path)
    for _, point in found.path.iterrows():
        logs = {n: point[n] * values[n] / point["load_factor"] for n in values}
        # interpolated loads
        assert logs["E"] == pytest.approx(1.0, rel=1e-3)
        assert logs["length"] + logs["width"] == pytest.approx(2.0, rel=1e-3)


@pytest.mark.slow
def test_beams_that_buckle_sideways_obey_their_laws_of_scale() -> None:
    """`P ~ sqrt(EI GJ) / L^2`, of a deep beam that bends in its plane before."""

    def beam(E: float = 1.0, length: float = 1.0) -> sm.Scene:
        made = lateral_plate.scene(model="beam")
        (body,) = made.beams
        section = replace(body.section, E=E * body.section.E)
        ends = [tuple(length * x for x in end) for end in (body.curve.start, body.curve.end)]
        return replace(
            made,
            beams=replace(body, section=section, curve=sm.Line(*ends)),
            path=sm.PathFollowing(load_end=1.1, branches="detect"),
        )

    found = sm.sensitivities(beam, ("E", "length"), columns="probes", **TIGHT)
    first = found.path.iloc[0]
    assert first.kind == "bifurcation"
    assert first.E / first.load_factor == pytest.approx(1.0, rel=1e-4)
    # bending in the plane and shear: as the beam's own critical loads have them
    assert first.length / first.load_factor == pytest.approx(-2.0, rel=2e-2)


@pytest.mark.slow
def test_bodies_of_small_strains_have_exact_derivatives() -> None:
    def make(thickness: float = 4e-3, length: float = 1.0) -> sm.Scene:
        made = scenes.plate("static", thickness=thickness, length=length, frequency=0.0)
        push = sm.EdgeForce("right", (0, 0, 40.0))
        made = replace(made, loads=push, path=sm.PathFollowing(load_end=1.0), dt=0.3, t_end=5.0)
        return Options(model="floating-frame").apply(made)

    assert_exact(make, ("thickness", "length"), within=1e-5, tangents=1e-8)


@pytest.mark.slow
def test_a_stopped_path_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    by, given = ("rise", "span"), {}
    whole = sm.sensitivities(truss, by, tmp_path / "whole", values=given)
    out = tmp_path / "stopped"
    stopped_at(7, out, monkeypatch, "all", truss, by, given)
    found = sm.sensitivities(truss, by, out, values=given, resume=True)
    pd.testing.assert_frame_equal(found.path, whole.path, rtol=1e-9)
    for name in by:
        for column in ("w", "load_factor", "load_rate"):
            one, other = (s.history[name][column] for s in (found, whole))
            np.testing.assert_allclose(one, other, rtol=1e-7, atol=1e-9)


@pytest.mark.slow
def test_two_ranks_find_the_same(mpirun: Callable[..., str]) -> None:
    source = """
import sys
sys.path.append(ROOT)
import shellmb as sm
from mpi4py import MPI
from tests.sensitivity.test_paths import TIGHT, roof

found = sm.sensitivities(
    roof, ("thickness",), columns="probes", values={"t_end": 2.0}, **TIGHT
)
if MPI.COMM_WORLD.rank == 0:
    print(*found.path["thickness"], found.history["thickness"]["w"].iloc[-1])
""".replace("ROOT", repr(str(Path(__file__).parents[2])))
    one, two = ([float(x) for x in mpirun(n, "-c", source).split()[-2:]] for n in (1, 2))
    # round-off over the distance of both sides
    np.testing.assert_allclose(one, two, rtol=1e-6)


@pytest.mark.parametrize(
    ("make", "given", "said"),
    [
        (truss, {"at": "time"}, "at is 'time'; it must be 'length' or 'load'"),
        (scenes.plate, {"at": "load"}, "at is 'load', and scene 'plate' follows no static path"),
    ],
)
def test_bad_choices(make: Callable[..., sm.Scene], given: dict, said: str) -> None:
    with pytest.raises(sm.SceneError, match=said):
        sm.sensitivities(make, ("rise" if make is truss else "E",), **given)


def test_a_path_keeps_its_levels() -> None:
    def make(end: float = 0.5) -> sm.Scene:
        return truss(load_end=end)

    says = r"parameter 'end' changes load_end of path from 0\.5 to"
    with pytest.raises(sm.SceneError, match=says):
        sm.sensitivities(make, ("end",))


def test_measurements_along_a_path_have_no_times() -> None:
    data = pd.DataFrame({"w": [0.0, -0.1]}, index=[0.0, 0.1])
    with pytest.raises(sm.SceneError, match="'truss' follows a static path, whose points have no"):
        sm.fit(truss, data, ("rise",))
