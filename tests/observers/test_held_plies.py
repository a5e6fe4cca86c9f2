"""Plies that hold each other from their natural strains: lamination theory, and what loads add.

Kind: stresses without resultants, which stay where the load grows.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
import scipy.optimize

import shellmb as sm
from shellmb.scene.shells.strength import CRITERIA, MOST
from tests.observers import test_reserves
from tests.observers.test_reserves import TURN, assert_same_on_two_ranks

E1, E2, NU, G, H = 140e9, 10e9, 0.3, 5e9, 0.25e-3
ALPHA, COOLED = np.array([-0.2e-6, 25e-6]), -100.0
KNOWN = {"Xt": 2e9, "Xc": 1.1e9, "Yt": 60e6, "Yc": 200e6, "S12": 80e6, "S13": 80e6, "S23": 50e6}
STRAINS = {"e1t": 0.014, "e1c": 8e-3, "e2t": 6e-3, "e2c": 0.02, "g12": 0.016}
STRENGTH = sm.Strength(**KNOWN, **STRAINS)
IN_PLANE = ("max-stress", "max-strain", "tsai-hill", "tsai-wu", "hashin", "puck")
QUIET = [pytest.param(s, marks=pytest.mark.slow) for s in ("ep", "ed", "ep4")]
FIELDS = ("N", "M", "Q", "interlaminar", "ply_stress", "surface_stress")


def laminate(angles=(0, 90, 90, 0), nu=NU, mm=1.0, ton=1.0, **changes: Any) -> sm.Laminate:
    """Plies of carbon, in other units: `mm` in the unit of length, `ton` in that of mass."""
    pressure = ton / mm
    strength = sm.Strength(**{k: v * pressure for k, v in KNOWN.items()}, **STRAINS)
    moduli = {"G12": G * pressure, "G13": G * pressure, "G23": 0.6 * G * pressure}
    material = sm.PlyMaterial(
        E1 * pressure,
        E2 * pressure,
        nu12=nu,
        density=1600 * ton / mm**3,
        strength=strength,
        **moduli,
        **changes,
    )
    return sm.Laminate([sm.Ply(material, H * mm, angle) for angle in angles])


def cooled(section: sm.Laminate, gradient=0.0, time=None, by=COOLED) -> sm.NaturalStrain:
    return sm.thermal_strain(section, [tuple(ALPHA)] * len(section.plies), by, gradient, time)


HELD = (
    sm.Fixed("left-bottom", displacement=(0, 0, 0)),
    sm.Fixed("right-bottom", displacement=(None, 0, 0)),
    sm.Fixed("left-top", displacement=(None, None, 0)),
)


def sheet(section, natural, pull=0.0, **changes: Any) -> sm.Scene:
    """A free sheet, pulled at two sides."""
    shell = sm.Shell("sheet", sm.Rectangle(0.2, 0.1), section, mesh=(2, 2), natural=natural)
    loads = [sm.EdgeForce("right", (pull, 0, 0)), sm.EdgeForce("left", (-pull, 0, 0))]
    given = {"supports": HELD, "loads": loads, "scheme": "linear-statics"}
    return sm.Scene("sheet", shell, **{**given, "output": sm.Output(fields=FIELDS), **changes})


def by_hand(angles, pull=0.0, gradient=0.0) -> Any:
    """Jones, Mechanics of Composite Materials, ch. 4: stresses of plies at bottom, middle, top."""
    d = 1 - NU**2 * E2 / E1
    Q = np.array([[E1, NU * E2, 0], [NU * E2, E2, 0], [0, 0, G * d]]) / d
    t = H * len(angles)
    faces = -t / 2 + H * np.arange(len(angles) + 1)
    ABD, R, turns = np.zeros((6, 6)), np.array([pull, 0, 0, 0, 0, 0]), []
    for k, angle in enumerate(angles):
        c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
        # engineering strains of the axes of the ply from those of the laminate
        T = np.array(
            [[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2 * c * s, 2 * c * s, c * c - s * s]]
        )
        turns.append(T)
        Qbar, free = T.T @ Q @ T, np.linalg.solve(T, [*ALPHA, 0.0])
        powers = [(faces[k + 1] ** n - faces[k] ** n) / n for n in (1, 2, 3)]
        ABD += np.kron([powers[:2], powers[1:]], Qbar)
        heat = COOLED * np.array(powers[:2]) + gradient * np.array(powers[1:])
        R = R + np.concatenate([Qbar @ free * heat[0], Qbar @ free * heat[1]])
    e = np.linalg.solve(ABD, R)
    found = []
    for k, T in enumerate(turns):
        for z in (faces[k], (faces[k] + faces[k + 1]) / 2, faces[k + 1]):
            hot = (COOLED + gradient * z) * np.array([*ALPHA, 0.0])
            found.append(Q @ (T @ (e[:3] + z * e[3:]) - hot))
    return e, np.array(found)


def stresses(table: pd.DataFrame, *parts: str) -> Any:
    return table[[f"stress {part}" for part in parts or ("11", "22", "12")]].to_numpy()


def test_a_cured_cross_ply_has_the_stresses_of_a_sum_of_springs() -> None:
    """Without lateral contraction plies are springs side by side: in a line."""
    section = laminate(nu=0.0)
    run = sm.run(sheet(section, cooled(section)))
    table = run.plies(at=(0.1, 0.05, 0))
    with pytest.raises(sm.SceneError, match="t is 3; it must be from 0 to 1, as the states in"):
        run.plies(at=(0.1, 0.05, 0), t=3)
    common = COOLED * (E1 * ALPHA[0] + E2 * ALPHA[1]) / (E1 + E2)
    wanted = [E1 * (common - COOLED * ALPHA[0]), E2 * (common - COOLED * ALPHA[1]), 0.0]
    assert wanted[0] < 0 < wanted[1] and wanted[0] == pytest.approx(-wanted[1])
    np.testing.assert_allclose(stresses(table), [wanted] * 12, atol=1e-9 * wanted[1])
    strain = table[["strain 11", "strain 22"]].to_numpy()
    np.testing.assert_allclose(strain, [np.array(wanted[:2]) / (E1, E2)] * 12, rtol=1e-9)


@pytest.mark.parametrize("angles", [(0, 90, 90, 0), (0, 90), (30, -45, 0)])
@pytest.mark.parametrize("gradient", [0.0, 2e4])
def test_any_lay_up_has_the_stresses_of_lamination_theory(angles, gradient) -> None:
    section = laminate(angles)
    for pull in (0.0, 2e4):
        run = sm.run(sheet(section, cooled(section, gradient), pull))
        e, wanted = by_hand(angles, pull, gradient)
        size = np.abs(wanted).max()
        table = run.plies(at=(0.1, 0.05, 0))
        np.testing.assert_allclose(stresses(table), wanted, atol=1e-9 * size)
        fields = run.fields["sheet"].isel(t=-1)
        for k in range(len(angles)):
            lower = fields[f"ply_stress_{k + 1}"].values[:, :3]
            np.testing.assert_allclose(lower - wanted[3 * k], 0 * lower, atol=1e-8 * size)
        if not pull:
            # it bows freely: no resultants, and these curvatures
            assert np.abs(fields["N"].values).max() < 1e-9 * size * H
            np.testing.assert_allclose(cooled(section, gradient).curvature, e[3:], atol=1e-12 / H)


def test_an_unsymmetric_strip_bows_by_the_curvature_of_lamination_theory() -> None:
    section, angles, L = laminate((0, 90)), (0, 90), 0.2
    shell = sm.Shell("s", sm.Rectangle(L, 0.02), section, mesh=(8, 1), natural=cooled(section))
    held = (
        sm.Fixed("left", displacement=(0, None, None), director=(0, None, None)),
        sm.Fixed("left-bottom", displacement=(0, 0, 0)),
        sm.Fixed("left-top", displacement=(0, None, 0)),
    )
    probe = sm.Probe("tip", (L, 0, 0))
    kappa = by_hand(angles)[0][3]
    tip = sm.run(sm.Scene("s", shell, supports=held, probes=probe, scheme="linear-statics"))
    assert abs(tip.history["tip"].iloc[-1]) == pytest.approx(abs(kappa) * L**2 / 2, rel=2e-2)


def test_a_factor_is_what_the_load_may_be_multiplied_by() -> None:
    """Of all criteria: there, utilisations are one; the stresses of curing stay. And by hand."""
    section, pull = laminate(), 2e4
    names = [sm.Reserve(name, name) for name in IN_PLANE]

    def found(pull: float, natural: Any) -> Any:
        return sm.run(sheet(section, natural, pull, reserves=names)).reserves

    natural = cooled(section)
    once, free = found(pull, natural), found(pull, None)
    half = found(pull / 2, natural)
    np.testing.assert_allclose(half["factor"].astype(float), 2 * once["factor"], rtol=1e-9)
    assert (once["factor"] < 0.9 * free["factor"]).all()
    for name, factor in once["factor"].items():
        assert found(factor * pull, natural).loc[name, "factor"] == pytest.approx(1, rel=1e-9)
    # the cross plies crack: strength, less what curing has taken of it
    _, cured = by_hand((0, 90, 90, 0))
    _, both = by_hand((0, 90, 90, 0), pull)
    wanted = (KNOWN["Yt"] - cured[4, 1]) / (both[4, 1] - cured[4, 1])
    assert once.loc["max-stress", "factor"] == pytest.approx(wanted, rel=1e-9)
    assert once.loc["max-stress", ["ply", "mode"]].to_list() == [2, "matrix tension"]


def test_what_fails_by_curing_alone_has_no_reserve() -> None:
    section = laminate()
    worn = sheet(section, cooled(section, by=-300.0), 10.0, reserves=sm.Reserve("r", "hashin"))
    assert sm.run(worn).reserves.loc["r", "factor"] == pytest.approx(1 / MOST)


def blade(scheme="ep", turn=None, units=(1.0, 1.0), temperature=COOLED, **changes: Any) -> sm.Scene:
    """A cantilever that is hit at its end, after curing; turned, and in other units."""
    (mm, ton), names = units, ("tsai-wu", "hashin", "interlaminar")
    plain = test_reserves.blade(scheme, turn, units, [sm.Reserve(name, name) for name in names])
    section = laminate((30, -45, 90, 90, -45, 30), mm=mm, ton=ton)
    natural = cooled(section, by=temperature)
    force = (np.eye(3) if turn is None else turn) @ np.array([200.0, 0, 150.0]) * ton
    still = scheme in ("static", "linear-statics")
    cured: dict[str, Any] = {} if still else {"t_end": 2e-3, "start": "equilibrium"}
    cured["shells"] = replace(plain.shells[0], section=section, natural=natural)
    cured["loads"] = replace(plain.loads[0], force=tuple(force.tolist()))
    cured["alpha"] = 1.0 if scheme in ("ed", "ed3") else None
    return replace(plain, **(cured | changes))


def least(rule: Any, total: Any, stays: Any) -> float:
    """Factor of what does not stay, by bisection."""

    def over(factor: float) -> float:
        both = stays + factor * (total - stays)
        return float(rule.utilisations(both, both, STRENGTH).max()) - 1

    return float(scipy.optimize.brentq(over, 0, 1e9)) if over(1e9) > 0 else np.inf


@pytest.mark.parametrize("scheme", ["static", "ed3", *QUIET])
def test_the_least_of_a_motion_is_that_of_its_stresses(scheme: str) -> None:
    """Beside the factor by which the share of the load may grow, found by bisection."""
    run = sm.run(blade(scheme, output=sm.Output(frames=11, fields=(*FIELDS, "utilisation"))))
    for name, row in run.reserves.iterrows():
        column = run.history[name].to_numpy()
        assert 1 / row["factor"] == pytest.approx(column.max()) and column.argmax() == row["step"]
        table = run.plies(at=tuple(row[["x", "y", "z"]]), t=row["t"])
        total = table.filter(like="stress").to_numpy()
        kept = np.pad(by_hand((30, -45, 90, 90, -45, 30))[1], ((0, 0), (0, 2)))
        rule = CRITERIA[name]
        factors = [least(rule, *each) for each in zip(total, kept, strict=True)]
        place = list(table.index).index((row["ply"], row["side"]))
        assert min(factors) == pytest.approx(factors[place], rel=1e-9)
        assert factors[place] == pytest.approx(row["factor"], rel=1e-8)
        field = run.fields["blade"].sel(t=row["t"], method="nearest")[f"utilisation_{name}"]
        assert field.values.max() == pytest.approx(column.max(), rel=1e-9)


@pytest.mark.parametrize("scheme", ["static", *QUIET])
def test_factors_know_no_axes_and_no_units(scheme: str) -> None:
    plain = sm.run(blade(scheme)).reserves
    turned = sm.run(blade(scheme, TURN)).reserves
    # K stays, and so do expansions; forces are in mN
    other = sm.run(blade(scheme, units=(1e3, 1.0))).reserves
    for found, scale in ((turned, 1.0), (other, 1e3)):
        np.testing.assert_allclose(found["factor"], plain["factor"], rtol=1e-6)
        for name in ("step", "ply", "side", "mode"):
            assert (found[name] == plain[name]).all(), name
        size = [np.linalg.norm(table[["x", "y", "z"]], axis=1) for table in (found, plain)]
        np.testing.assert_allclose(size[0], scale * size[1], atol=1e-9 * scale)


@pytest.mark.parametrize("relaxation", [None, sm.Prony([(0.4, 0.1)])])
@pytest.mark.parametrize("factor", [None, sm.Sine(2.0)])
def test_stresses_have_the_resultants(factor: Any, relaxation: Any) -> None:
    """In motion, heated and cooled: what plies hold has no force, and no moment."""
    if factor is not None and relaxation is not None:
        pytest.skip("branches do not follow natural strains that change")
    section = laminate((0, 90, 45), relaxation=relaxation)
    scene = blade(dt=0.02, t_end=0.2, output=sm.Output(frames=10, fields=FIELDS), reserves=())
    shell = replace(scene.shells[0], section=section, natural=cooled(section, time=factor))
    run = sm.run(replace(scene, shells=shell, start=()))
    for t in (0.06, 0.2):
        table = run.plies(at=(0.15, 0.05, 0), t=t, axes="shell")
        stress = stresses(table, "11", "22", "12", "13", "23").reshape(3, 3, 5)
        z, weights = table["z"].to_numpy().reshape(3, 3), H * np.array([1, 4, 1]) / 6
        force = np.einsum("s,ksi->i", weights, stress)
        moment = np.einsum("ks,ksi->i", weights * z, stress[..., :3])
        state = run.fields["blade"].sel(t=t, method="nearest")
        node = np.linalg.norm(state["reference"].values - (0.15, 0.05, 0), axis=1).argmin()
        for name, found in (("N", force[:3]), ("M", moment), ("Q", force[3:])):
            size = np.abs(stress).max() * H * (H if name == "M" else 1)
            np.testing.assert_allclose(found, state[name].values[node], atol=1e-8 * size)


@pytest.mark.parametrize("scheme", ["static", pytest.param("ed3", marks=pytest.mark.slow)])
def test_derivatives_are_those_of_differences_of_runs(scheme: str) -> None:
    def make(temperature: float = COOLED) -> sm.Scene:
        return blade(scheme, temperature=temperature)

    found = sm.sensitivities(make, ["temperature"]).reserves
    above, below = (sm.run(make(COOLED + d)).reserves["factor"] for d in (0.1, -0.1))
    np.testing.assert_allclose(found["temperature"], (above - below) / 0.2, rtol=1e-4, atol=1e-7)
    assert found.loc["hashin", "temperature"] > 0


@pytest.mark.mpi
def test_two_ranks_find_the_same(mpirun: Callable[..., str]) -> None:
    assert_same_on_two_ranks(blade, mpirun)


def test_natural_strains_of_plies_must_be_those_of_the_section() -> None:
    section = laminate((0, 90))
    good = cooled(section)

    def shell(natural: Any, **changes: Any) -> sm.Shell:
        given = {"section": section, **changes}
        return sm.Shell("s", sm.Rectangle(1, 1), natural=natural, **given)

    shell(good)
    varying = replace(section, offset=lambda x: 0 * x[0])
    for says, make in {
        "with plies of 2 strains; there must be 4, one for each ply": lambda: shell(
            good, section=laminate()
        ),
        "plies; its section and its strains must be the same everywhere": lambda: shell(
            good, section=varying
        ),
        r"plies, membrane \(.*they must be those of the plies in this section, \(": lambda: shell(
            replace(good, curvature=(1.0, 0, 0))
        ),
        "plies": lambda: replace(good, plies=[(1, 2, 3)]),
        "'natural_factor'; it must be left out, as there is no shell whose plies": lambda: sheet(
            section, sm.NaturalStrain((1e-3, 0, 0)), output=sm.Output(fields="natural_factor")
        ),
    }.items():
        with pytest.raises(sm.SceneError, match=says):
            make()
