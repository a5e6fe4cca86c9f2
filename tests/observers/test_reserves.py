"""Reserve factors of runs: what a motion's stresses say after it, other axes, units and ranks."""

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import shellmb as sm
from shellmb.running.execute import execute
from shellmb.running.resume import resume
from shellmb.scene.shells.strength import CRITERIA
from shellmb.simulate.simulation import BaseObserver

STRENGTH = sm.Strength(Xt=2e9, Xc=1.1e9, Yt=60e6, Yc=200e6, S12=80e6, S13=80e6, S23=50e6)
CARBON = sm.PlyMaterial(
    138e9, 9e9, nu12=0.3, G12=7e9, G13=7e9, G23=3.5e9, density=1600, strength=STRENGTH
)
NAMED = ("tsai-wu", "hashin", "interlaminar")
TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])


def blade(scheme="ep", turn=None, units=(1.0, 1.0), reserves=None, **changes):
    """A cantilever of few elements that is hit at its end; turned, and in other units."""
    Q, (mm, ton) = np.eye(3) if turn is None else turn, units
    pressure = ton / mm
    strength = {k: getattr(STRENGTH, k) for k in ("Xt", "Xc", "Yt", "Yc", "S12", "S13", "S23")}
    material = sm.PlyMaterial(
        138e9 * pressure,
        9e9 * pressure,
        nu12=0.3,
        G12=7e9 * pressure,
        G13=7e9 * pressure,
        G23=3.5e9 * pressure,
        density=1600 * ton / mm**3,
        strength=sm.Strength(**{k: v * pressure for k, v in strength.items()}),
    )
    skin = sm.Laminate.from_stacking(material, 0.5e-3 * mm, "[30/-45/90]s")
    L, B = 0.3 * mm, 0.1 * mm

    def place(s, t):
        x = np.stack([L * s, B * t, 0 * s])
        return tuple(np.tensordot(Q, x, axes=1))

    force = Q @ np.array([200.0, 0, 900.0]) * ton
    shell = sm.Shell(
        "blade", sm.Parametric(place), skin, mesh=(4, 2), direction=tuple(Q[:, 0].tolist())
    )
    time = sm.Sine(100.0) if scheme not in ("static", "linear-statics") else None
    scene = sm.Scene(
        "blade",
        shell,
        supports=sm.Clamped("left"),
        loads=sm.EdgeForce("right", tuple((force).tolist()), time=time),
        scheme=scheme,
        dt=None if time is None else 2e-4,
        t_end=None if time is None else 4e-3,
        reserves=reserves or [sm.Reserve(name, name) for name in NAMED],
    )
    return replace(scene, **changes)


def test_the_least_of_a_motion_is_that_of_its_stresses() -> None:
    """History, fields and stresses of plies say the same, and the least factor is the last word."""
    output = sm.Output(frames=21, fields=("N", "M", "interlaminar", "utilisation", "reserve"))
    run = sm.run(blade(output=replace(output, fields=(*output.fields, "critical_ply"))))
    assert run.fields["blade"].sizes["t"] == 21
    assert list(run.reserves.index) == list(NAMED)
    for name, row in run.reserves.iterrows():
        column = run.history[name].to_numpy()
        assert row["factor"] == pytest.approx(1 / column.max(), rel=1e-14)
        assert row["step"] == column.argmax() and column[0] == 0.0
        field = run.fields["blade"].isel(t=int(row["step"]))
        assert field[f"utilisation_{name}"].values.max() == pytest.approx(column.max(), rel=1e-12)
        assert field[f"reserve_{name}"].values.min() == pytest.approx(row["factor"], rel=1e-12)
        assert field[f"reserve_{name}"].values.max() <= 1000.0
        node = int(field[f"utilisation_{name}"].values.argmax())
        assert field[f"critical_ply_{name}"].values[node] == row["ply"]
        np.testing.assert_allclose(field["reference"].values[node], row[["x", "y", "z"]].to_list())
        # of the whole motion at that place, from fields that were written
        place = tuple(row[["x", "y", "z"]])
        rule, series = CRITERIA[row["criterion"]], []
        for t in run.history["t"]:
            table = run.plies(at=place, t=t).filter(like="stress").to_numpy()
            series.append(rule.utilisations(table, table, STRENGTH).max())
        assert (np.array(series) <= column * (1 + 1e-9)).all()
        assert np.argmax(series) == row["step"]
        assert max(series) == pytest.approx(column.max(), rel=1e-9)
        worst = run.plies(at=place, t=row["t"]).loc[(row["ply"], row["side"])]
        by_mode = rule.utilisations(
            worst.iloc[1:6].to_numpy(), worst.iloc[1:6].to_numpy(), STRENGTH
        )
        assert rule.modes[by_mode.argmax()] == row["mode"]
        assert by_mode.max() == pytest.approx(column.max(), rel=1e-9)
    assert run.picture(field="utilisation_hashin").size[0] > 100


@pytest.mark.parametrize("scheme", ["static", "linear-statics", "ed", "ep4", "ed3"])
def test_factors_know_no_axes_and_no_units(scheme: str) -> None:
    plain = sm.run(blade(scheme)).reserves
    turned = sm.run(blade(scheme, TURN)).reserves
    other = sm.run(blade(scheme, units=(1e3, 1.0))).reserves
    for found, scale in ((turned, 1.0), (other, 1e3)):
        # Newton's tolerance
        np.testing.assert_allclose(found["factor"], plain["factor"], rtol=1e-6)
        for name in ("step", "ply", "side", "mode"):
            assert (found[name] == plain[name]).all(), name
        size = [np.linalg.norm(table[["x", "y", "z"]], axis=1) for table in (found, plain)]
        np.testing.assert_allclose(size[0], scale * size[1], atol=1e-9 * scale)
    if scheme == "linear-statics":
        # linear in the load
        half = blade(scheme)
        load = replace(half.loads[0], force=tuple(0.5 * f for f in half.loads[0].force))
        halved = sm.run(replace(half, loads=load)).reserves
        np.testing.assert_allclose(halved["factor"], 2 * plain["factor"], rtol=1e-9)


def test_a_run_ends_at_failure() -> None:
    """An event reads utilisations; a mean over a short step is near the value at its end."""
    fails = sm.Event("fails", sm.Sensor("hashin") >= 0.1, ends=True)
    run = sm.run(blade(events=fails))
    assert run.summary["ended_by"] == "fails"
    before, last = run.history["hashin"].iloc[-2:]
    assert before < 0.1 < last < 0.105


def test_a_body_in_modes_and_one_about_a_frame_have_factors() -> None:
    """Beside the exact one, whose deflections are small."""
    gentle = replace(blade().loads[0], force=(0, 0, 20.0))
    exact = sm.run(blade(loads=gentle)).reserves
    for model, bound in ((sm.Modal(modes=20), 0.1), ("floating-frame", 1e-2)):
        shell = replace(blade().shells[0], model=model)
        fields = sm.Output(fields=("utilisation", "interlaminar"))
        run = sm.run(blade(loads=gentle, shells=shell, output=fields))
        found = run.reserves
        at = run.fields["blade"].isel(t=-1)["utilisation_hashin"].values.max()
        assert at == pytest.approx(run.history["hashin"].iloc[-1], rel=1e-9)
        np.testing.assert_allclose(found["factor"], exact["factor"], rtol=bound)


def test_places_and_plies_can_be_left_out() -> None:
    far = sm.Reserve("far", "hashin", where=lambda x: x[0] > 0.14)
    middle = sm.Reserve("middle", "hashin", plies=(3, 4))
    found = sm.run(blade("static", reserves=[sm.Reserve("all", "hashin"), far, middle])).reserves
    assert found.loc["far", "x"] > 0.14 > found.loc["all", "x"]
    assert found.loc["middle", "ply"] in (3, 4)
    assert found["factor"].min() == found.loc["all", "factor"] < found.loc["far", "factor"]
    nowhere = sm.Reserve("none", "hashin", where=lambda x: x[0] > 1.0)
    with pytest.raises(sm.SceneError, match="reserve 'none': where is true at no node of shell"):
        sm.run(blade("static", reserves=nowhere))


@pytest.mark.parametrize("at", ["right-top", (0.15, 0.05, 0.0)])
def test_a_factor_under_a_point_force_is_no_number(at) -> None:
    """At a named point and at a node; elsewhere nothing is said."""
    force = sm.PointForce(at, (0, 0, 100.0))
    held = (sm.Clamped("left"), sm.Fixed("right", (None, None, 0)))
    supports = held[:1] if at == "right-top" else held
    near = (lambda x: x[0] > 0.2) if at == "right-top" else (lambda x: abs(x[0] - 0.15) < 0.08)
    under = sm.Reserve("under", "tsai-wu", where=near)
    away = sm.Reserve("away", "interlaminar", where=lambda x: x[0] < 0.06)
    scene = blade("linear-statics", loads=force, supports=supports, reserves=[under, away])
    found = execute(scene).summary["warnings"]
    (caution,) = (each for each in found if each["watch"] == "singular stress")
    assert "reserve 'under' is least where a point force acts on shell 'blade'" in caution["says"]
    assert caution["body"] == "blade"


class Stops(BaseObserver):
    """Ends a run in the step of its largest stress: states have others than means over steps."""

    def accepted(self, simulation) -> None:
        if simulation.step == 26:
            raise KeyboardInterrupt


def test_a_resumed_run_remembers_the_least(tmp_path) -> None:
    # what follows the impact is damped
    impact = replace(blade().loads[0], time=sm.Table([0, 1e-3, 2e-3, 3e-3], [0, 1, 0, 0]))
    scene = blade("ed", alpha=1.0, t_end=6e-3, loads=impact)
    straight = execute(scene, tmp_path / "straight", pictures=False)
    with pytest.raises(KeyboardInterrupt):
        execute(scene, tmp_path / "parts", [Stops()], pictures=False)
    resumed = resume(tmp_path / "parts", scene=scene, pictures=False)
    for name, found in straight.summary["reserves"].items():
        other = resumed.summary["reserves"][name]
        assert other.pop("utilisation") == pytest.approx(found.pop("utilisation"), rel=1e-9)
        assert found == other
    assert min(found["step"] for found in straight.summary["reserves"].values()) == 26


def assert_same_on_two_ranks(blade: Callable[..., sm.Scene], mpirun: Callable[..., str]) -> None:
    """Least factors of a blade, which is of a module of tests."""
    code = (
        f"import sys; sys.path.insert(0, {str(Path(__file__).parents[2])!r})\n"
        f"from mpi4py import MPI\nimport shellmb as sm\nfrom {blade.__module__} import blade\n"
        "table = sm.run(blade('linear-statics'), pictures=False).reserves\n"
        "MPI.COMM_WORLD.rank or print(table.to_json())"
    )
    one = sm.run(blade("linear-statics")).reserves
    two = pd.DataFrame(json.loads(mpirun(2, "-c", code)))
    np.testing.assert_allclose(two["factor"].astype(float), one["factor"], rtol=1e-8)
    assert (two[["ply", "mode"]] == one[["ply", "mode"]]).all(axis=None)


@pytest.mark.mpi
def test_two_ranks_find_the_same(mpirun: Callable[..., str]) -> None:
    """Derivatives along the surface need nodes of the other rank."""
    assert_same_on_two_ranks(blade, mpirun)


def test_errors_of_factors_cover_the_difference_from_a_finer_mesh() -> None:
    """Of statics and of a motion, inside, where stresses have no singularity."""
    inside = sm.Reserve("r", "tsai-wu", where=lambda x: np.abs(x[0] - 0.15) < 1e-6)
    for scheme in ("linear-statics", "ep4"):
        coarse = sm.run(blade(scheme, reserves=inside, errors=True)).reserves.loc["r"]
        finer = blade(scheme, reserves=inside).with_options(
            mesh=(16, 8), dt=None if scheme == "linear-statics" else 5e-5
        )
        exact = sm.run(finer).reserves.loc["r"]
        assert 0 < coarse["error"] < 0.3 * coarse["factor"]
        assert abs(coarse["factor"] - exact["factor"]) < coarse["error"]


def test_derivatives_of_the_least_factor() -> None:
    """Beside differences of whole runs."""

    def make(thickness: float = 0.5e-3) -> sm.Scene:
        scene = blade(reserves=[sm.Reserve("r", "hashin"), sm.Reserve("s", "interlaminar")])
        skin = sm.Laminate.from_stacking(CARBON, thickness, "[30/-45/90]s")
        return replace(scene, shells=replace(scene.shells[0], section=skin))

    found = sm.sensitivities(make, ["thickness"]).reserves
    step = 1e-8
    above, below = (sm.run(make(0.5e-3 + d)).reserves for d in (step, -step))
    difference = (above["factor"] - below["factor"]) / (2 * step)
    assert (above["step"] == below["step"]).all()
    # Newton's tolerance over the step
    np.testing.assert_allclose(found["thickness"], difference, rtol=1e-3)
    np.testing.assert_allclose(found["factor"], (above["factor"] + below["factor"]) / 2, rtol=1e-6)
    few = sm.sensitivities(make, ["thickness"], columns="probes").reserves
    np.testing.assert_allclose(few["thickness"], found["thickness"], rtol=1e-6)


def test_what_is_missing_is_said() -> None:
    plain = sm.Laminate.from_stacking(replace(CARBON, strength=None), 1e-3, "[0/90]")
    some = sm.Laminate.from_stacking(
        replace(CARBON, strength=sm.Strength(Xt=1.0, Xc=1.0, Yt=1.0)), 1e-3, "[0/90]"
    )
    across = replace(STRENGTH, Yc=3e9)
    odd = sm.Laminate.from_stacking(replace(CARBON, strength=across), 1e-3, "[0/90]")
    puck = replace(STRENGTH, Yt=300e6)
    steep = sm.Laminate.from_stacking(replace(CARBON, strength=puck), 1e-3, "[0/90]")
    shell = blade().shells[0]
    for change, criterion, says in (
        ({"section": plain}, "tsai-wu", "material of ply 1 has no 'Xt', 'Xc', 'Yt', 'Yc', 'S12'"),
        ({"section": some}, "hashin", "ply 1 has no 'Yc', 'S12', 'S23'; 'hashin' needs Strength"),
        ({"section": odd}, "tsai-hill", r"ply 1 has a strength 3e\+09 across and 1.1e\+09 along"),
        ({"section": steep}, "puck", r"has p12t Yt = 9e\+07, and S12 = 8e\+07"),
        ({"model": "rigid"}, "tsai-wu", "shell 'blade' has no stresses of plies; it must be a"),
    ):
        with pytest.raises(sm.SceneError, match=f"reserve 'r': .*{says}"):
            blade(shells=replace(shell, **change), reserves=sm.Reserve("r", criterion))
    with pytest.raises(sm.SceneError, match="has 6 plies, and plies has 7; numbers must be from 1"):
        blade(reserves=sm.Reserve("r", "hashin", plies=(7,)))
    with pytest.raises(sm.SceneError, match="fields has 'utilisation'; the scene must have a Rese"):
        replace(blade(), reserves=(), output=sm.Output(fields="utilisation"))
    with pytest.raises(sm.SceneError, match="2 reserves are named 'r'"):
        blade(reserves=[sm.Reserve("r", "hashin"), sm.Reserve("r", "puck")])
    with pytest.raises(sm.SceneError, match="every history has a column 't'"):
        blade(reserves=sm.Reserve("t", "hashin"))
    assert math.isfinite(sm.run(blade("linear-statics")).reserves["factor"].max())
