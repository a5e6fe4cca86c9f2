"""Stresses of plies through the thickness: equilibrium, and three-dimensional elasticity."""

import math
from dataclasses import replace

import numpy as np
import pytest

import shellmb as sm
from shellmb.demos.references.pagano import Solid, Wave, pagano
from shellmb.demos.verification.laminates import Stiffness, wave_stiffness
from shellmb.observers.fields.by_section import ply_stress
from shellmb.observers.fields.through import interlaminar, ply_rows, ply_state

SOLID = Solid((25.0, 1.0, 1.0), (0.25, 0.25, 0.25), (0.5, 0.5, 0.2))
MATERIAL = sm.PlyMaterial(25.0, 1.0, nu12=0.25, G12=0.5, G13=0.5, G23=0.2)
FIELDS = sm.Output(fields=("N", "M", "Q", "interlaminar"))
LAYUP = (0, 90, 90, 0)
SIDES = (0.0, 0.5, 1.0)


@pytest.mark.parametrize(
    ("slenderness", "published"),
    [
        # sigma_x (a/2, a/2, h/2), tau_xz (0, a/2, 0), tau_yz (a/2, 0, 0), tau_xy (0, 0, h/2) in
        # units of q S^2 and q S: Pagano & Hatfield, AIAA J. 10 (1972) 931, three digits
        (4, (0.720, 0.219, 0.292, 0.0467)),
        (10, (0.559, 0.301, 0.196, 0.0275)),
        (20, (0.543, 0.328, 0.156, 0.0230)),
        (100, (0.539, 0.339, 0.139, 0.0214)),
    ],
)
def test_the_exact_solution_is_the_published_one(slenderness, published) -> None:
    plies = [(1 / slenderness / 4, angle == 90) for angle in LAYUP]
    middle, top = pagano(SOLID, plies, 1.0, 1.0, 1.0, [(1, 1.0), (3, 1.0)])
    S = slenderness
    found = [top.normal[0] / S**2, *middle.transverse / S, -top.in_plane / S**2]
    # the last digit of the table
    np.testing.assert_allclose(found, published, atol=6e-4)


def waves(layup, h: float, b: float) -> list[Wave]:
    plies = [(h / len(layup), angle == 90) for angle in layup]
    return pagano(SOLID, plies, 1.0, b, 1.0, [(k, s) for k in range(len(layup)) for s in SIDES])


def square(layup, h, turn=0.0, mesh=(16, 16)):
    """A square on simple supports, its material axes turned and its plies turned back."""
    section = sm.Laminate.from_stacking(
        MATERIAL, h / len(layup), [a - turn for a in layup], shear_correction="energy"
    )
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    return sm.Scene(
        "pagano",
        sm.Shell("plate", sm.Rectangle(1, 1), section, mesh=mesh, direction=(c, s, 0)),
        supports=[
            sm.Fixed(("left", "right"), (None, 0, 0), (None, 0, None)),
            sm.Fixed(("bottom", "top"), (0, None, 0), (0, None, None)),
        ],
        loads=sm.Pressure(lambda x: np.sin(np.pi * x[0]) * np.sin(np.pi * x[1])),
        scheme="linear-statics",
        output=FIELDS,
    )


def test_shear_of_a_plate_is_paganos() -> None:
    """In both directions, also in the weak one, and whatever the axes of the shell."""
    exact = waves(LAYUP, 1 / 20, 1.0)
    plain, turned, oblique = (sm.run(square(LAYUP, 1 / 20, turn)) for turn in (0.0, 90.0, 30.0))
    for place, k in (((0, 0.5, 0), 0), ((0.5, 0, 0), 1)):
        wanted = np.array([wave.transverse[k] for wave in exact])
        along = plain.plies(at=place)
        # plies across have their 2-axis along -x
        along["x"], along["y"] = along["stress 13"], along["stress 23"]
        across = along.index.isin([2, 3], level="ply")
        along.loc[across, "x"] = -along.loc[across, "stress 23"]
        along.loc[across, "y"] = along.loc[across, "stress 13"]
        found = along["xy"[k]].to_numpy()
        assert np.abs(found).max() == pytest.approx(np.abs(wanted).max(), rel=0.02)
        # 5 %: in layers where it is small, too
        np.testing.assert_allclose(found, wanted, atol=0.05 * np.abs(wanted).max())
        shell = plain.plies(at=place, axes="shell")[f"stress {'12'[k]}3"].to_numpy()
        np.testing.assert_allclose(shell, found, atol=1e-12 * np.abs(found).max())
    one = plain.plies(at=(0.3, 0.4, 0))
    # 3 %: elements have other polynomials along oblique axes
    for other, bound in ((turned, 1e-9), (oblique, 0.03)):
        two = other.plies(at=(0.3, 0.4, 0))
        for kind in ("stress", "strain"):
            for parts in (("11", "22", "12"), ("13", "23")):
                columns = [f"{kind} {part}" for part in parts]
                a, b = one[columns].to_numpy(), two[columns].to_numpy()
                np.testing.assert_allclose(a, b, atol=bound * np.abs(a).max())
    assert one["z"].to_numpy()[1::3] == pytest.approx((np.arange(4) - 1.5) / 80)


def wave(slenderness: float, correction):
    """Largest stresses 11, 13, 23 of first-order theory over exact ones, [0/90/90/0]."""
    h, turn = 1 / slenderness, math.pi
    section = sm.Laminate.from_stacking(MATERIAL, h / 4, LAYUP, shear_correction=correction)
    stiff = Stiffness(section.A, section.B, section.D, section.G)
    x = np.linalg.solve(wave_stiffness("SS-1", stiff, turn, turn), [0, 0, 1, 0, 0])
    # bending 11, 22 go with sin sin, twisting with cos cos
    kappa = np.array([-turn * x[3], -turn * x[4], turn * (x[3] + x[4])])
    M = section.D @ kappa
    both = np.zeros((2, 20))
    both[0, 3:5], both[1, 6:8] = M[:2], section.G @ [turn * x[2] + x[3], turn * x[2] + x[4]]
    # of N and M along 1, and along 2
    both[1, [11, 12]] = both[1, [17, 18]] = turn * M[:2]
    both[1, [13, 19]] = -turn * M[2]
    shell = sm.Shell("s", sm.Rectangle(1, 1), section)
    stress = ply_state(ply_rows(shell, section.generic), both).total[0]
    # plies across have their 1-axis along y
    found = stress[0, 3, 2, 0], stress[1, 1, 2, 4], stress[1, 1, 2, 3]
    exact = waves(LAYUP, h, 1.0)
    wanted = exact[-1].normal[0], *exact[5].transverse
    return [abs(a / b) - 1 for a, b in zip(found, wanted, strict=True)]


def test_the_theory_is_as_far_from_exact_as_the_page_says() -> None:
    """Not meshes: what `docs/howto/failure.md` says of the theory itself."""
    for slenderness, below, *shears in (
        (10, -0.136, 0.027, 0.010),
        (20, -0.038, 0.007, 0.001),
        (50, -0.006, 0.001, 0.000),
    ):
        # the digits of the page
        assert wave(slenderness, "energy") == pytest.approx([below, *shears], abs=6e-4)
    assert wave(10, 5 / 6)[2] == pytest.approx(-0.078, abs=6e-4)


@pytest.mark.parametrize("layup", [(0, 90), (0, 90, 0), (0,)])
def test_cylindrical_bending_is_paganos(layup) -> None:
    """Also without symmetry, and of a single layer, at a slenderness of 20."""
    h = 1 / 20
    section = sm.Laminate.from_stacking(MATERIAL, h / len(layup), layup, shear_correction="energy")
    strip = sm.Scene(
        "strip",
        sm.Shell("strip", sm.Rectangle(1, 0.1), section, mesh=(24, 1), direction=(1, 0, 0)),
        supports=[
            sm.Fixed(("left", "right"), (None, 0, 0), (None, 0, None)),
            sm.Fixed("left-bottom", (0, None, None)),
            sm.Fixed(("bottom", "top"), (None, 0, None), (None, 0, None)),
        ],
        loads=sm.Pressure(lambda x: np.sin(np.pi * x[0])),
        scheme="linear-statics",
        output=FIELDS,
    )
    found = sm.run(strip).plies(at=(0, 0.05, 0), axes="shell")["stress 13"].to_numpy()
    wanted = np.array([wave.transverse[0] for wave in waves(layup, h, math.inf)])
    assert np.abs(found).max() == pytest.approx(np.abs(wanted).max(), rel=0.02)
    np.testing.assert_allclose(found, wanted, atol=0.03 * np.abs(wanted).max())


def test_stresses_across_are_in_equilibrium() -> None:
    """Of any lay-up and resultants: both faces are free, and the integral is the shear force."""
    random = np.random.default_rng(3)
    thick = (lambda x: 1 + x[0], 0.3, lambda x: 0 * x[0], 2.0)
    plies = tuple(sm.Ply(MATERIAL, t, a) for t, a in zip(thick, (10, 75, 0, -40), strict=True))
    for offset in (0.0, 0.7):
        section = sm.Laminate(plies, shear_correction="energy", offset=offset)
        shell = sm.Shell("s", sm.Rectangle(1, 1), section)
        at = section.at(random.uniform(size=(3, 5)))
        rows = ply_rows(shell, at)
        both = random.normal(size=(5, 20))
        found = [interlaminar(ply, both).reshape(5, 3, 2) for ply in rows]
        assert not found[2].any()
        assert np.abs(found[0][:, 0]).max() < 1e-14 and np.abs(found[3][:, 2]).max() < 1e-13
        total = 0.0
        for values, layer in zip(found, at.layers, strict=True):
            c, s = np.cos(np.radians(layer.angle)), np.sin(np.radians(layer.angle))
            back = values @ np.array([[c, s], [-s, c]])
            h = np.reshape(layer.thickness, (-1, 1))
            total = total + h * (back[:, 0] + 4 * back[:, 1] + back[:, 2]) / 6
        np.testing.assert_allclose(total, both[:, 6:8], atol=1e-12)
        # as the field of faces has them
        stress, _ = ply_state(rows, both).total
        for k in (0, 1, 3):
            plain = ply_stress(shell, at, k)(both[:, :8])
            np.testing.assert_allclose(plain[:, :3], stress[:, k, 0, :3], atol=1e-12)
            np.testing.assert_allclose(plain[:, 3:], stress[:, k, 2, :3], atol=1e-12)


def test_a_plate_of_one_layer_has_a_parabola() -> None:
    """Steel under an end force: 3 Q/2h in the middle; sentences where something is missing."""
    steel = sm.Isotropic(E=210e9, nu=0.0, thickness=4e-3)
    scene = sm.Scene(
        "strip",
        sm.Shell("plate", sm.Rectangle(1.0, 0.08), steel, mesh=(6, 2)),
        supports=sm.Clamped("left"),
        loads=sm.EdgeForce("right", (0, 0, 100.0)),
        scheme="linear-statics",
        output=FIELDS,
    )
    run = sm.run(scene)
    table = run.plies(at=(0.37, 0.03, 0))
    np.testing.assert_allclose(table["stress 13"], [0, 1.5 * 100 / 4e-3, 0], atol=1e-3)
    bending = 100 * 0.63 * 6 / 4e-3**2
    # 1 %: the share of shear of the element's displacements
    np.testing.assert_allclose(table["stress 11"], [bending, 0, -bending], atol=0.01 * bending)
    np.testing.assert_allclose(table["strain 11"] * 210e9, table["stress 11"], atol=1e-3)
    np.testing.assert_allclose(table["strain 13"] * 105e9, table["stress 13"], atol=1e-3)
    with pytest.raises(sm.SceneError, match=r"at is \(2.0, 0.0, 0.0\), which is not on it; its n"):
        run.plies(at=(2, 0, 0))
    with pytest.raises(sm.SceneError, match="which is not on it"):
        run.plies(at=(0.5, 0.04, 0.1))
    with pytest.raises(sm.SceneError, match="axes is 'global'; it must be 'ply' or 'shell'"):
        run.plies(at=(0, 0, 0), axes="global")
    without = sm.run(replace(scene, output=sm.Output(fields=("N", "M"))))
    with pytest.raises(sm.SceneError, match="shell 'plate' has no field interlaminar_1; the scene"):
        without.plies(at=(0, 0, 0))
