"""Membranes that wrinkle: their energy, closed forms of tension-field theory, exact accounts."""

import math
from dataclasses import replace

import numpy as np
import pytest
import ufl
from scipy.optimize import minimize

import shellmb as sm
from shellmb.demos import airbag
from shellmb.demos.references.membranes import sheared_energy, stretched_strip_curvature
from shellmb.demos.verification.problems.membranes import (
    HEIGHT,
    LENGTH,
    STRAIN,
    THICKNESS,
    E,
    last,
    sheared_sheet,
    stretched_strip,
)
from shellmb.errors import SceneError
from shellmb.forms.materials import tension_field
from shellmb.forms.shell import ShellStrains
from tests.scenes import plate_scene

SECTION = sm.Wrinkling(1.0, 0.3, 0.01, density=1.0)


def energy(e: np.ndarray, nu: float, compression: float) -> float:
    """Energy per volume of a membrane strain (11, 22, 2*12)."""
    parameters = {"E": 1.0, "nu": nu, "thickness": 1.0, "shear_correction": 1.0}
    zero = ufl.as_vector([ufl.as_ufl(0.0)] * 3)
    strains = ShellStrains(ufl.as_vector([ufl.as_ufl(float(x)) for x in e]), zero, zero)
    given = {k: ufl.as_ufl(v) for k, v in (parameters | {"compression": compression}).items()}
    return float(tension_field(strains, given)(()))


@pytest.mark.parametrize("nu", [0.3, 0.0, -0.4])
def test_it_is_the_least_energy_that_wrinkles_can_reach(nu: float) -> None:
    """Pipkin's definition: wrinkles add any strain that is not negative to that of the mean."""
    C = np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]]) / (1 - nu**2)
    generator, slack, taut = np.random.default_rng(1), 0, 0
    for _ in range(24):
        e = generator.normal(size=3)

        def whole(r: np.ndarray, e: np.ndarray = e) -> float:
            shortened = e + np.array([r[0] ** 2, r[1] ** 2 + r[2] ** 2, 2 * r[0] * r[1]])
            return float(shortened @ C @ shortened / 2)

        starts = generator.normal(size=(6, 3))
        least = min(float(minimize(whole, r, tol=1e-12).fun) for r in starts)
        assert energy(e, nu, 0.0) == pytest.approx(least, abs=1e-7)  # not round-off: a search
        assert energy(e, nu, 1.0) == pytest.approx(e @ C @ e / 2, rel=1e-12)
        slack += least < 1e-7
        taut += least > e @ C @ e / 2 - 1e-7
    assert 0 < slack and 0 < taut and slack + taut < 24
    assert energy(np.zeros(3), nu, 0.0) == energy(np.array([-1.0, -1.0, 0.0]), nu, 0.0) == 0.0


KINDS = [
    ("quad", {}),
    ("tri", {}),
    ("quad", {"nu": 0.0, "distortion": 0.2}),
]


@pytest.mark.parametrize(("cell", "given"), KINDS)
def test_a_stretched_strip_that_a_moment_wrinkles(cell, given) -> None:
    """Half as stiff as the strip would be that does not wrinkle, with 0.4 of it wrinkled."""
    m = 0.3
    turn = -last(stretched_strip(m, (4, 8), cell, **given))["turn"]
    exact = stretched_strip_curvature(m, STRAIN, HEIGHT)
    assert exact > 1.5 * 12 * m * STRAIN / HEIGHT
    # a band whose end is inside of an element, grips that hold the width, and compression: measured
    # up to 1e-3
    assert turn / LENGTH == pytest.approx(exact, rel=3e-3)


def test_with_all_of_its_compression_it_is_an_isotropic_section() -> None:
    kept = stretched_strip(0.3, (2, 2), "tri", compression=1.0)
    (shell,) = kept.shells
    plain = replace(shell, section=sm.Isotropic(E, 0.3, THICKNESS))
    turns = [last(scene)["turn"] for scene in (kept, replace(kept, shells=plain))]
    assert turns[0] == pytest.approx(turns[1], rel=1e-6)  # not round-off: Newton's tolerance


@pytest.mark.parametrize("cell", ["quad", "tri"])
def test_a_sheared_sheet_is_in_tension_along_one_direction(cell) -> None:
    """The energy of a length in the middle, also in other units, along other axes."""
    first, second = np.array([2.0, 1.0, 2.0]) / 3, np.array([-2.0, 2.0, 1.0]) / 3
    others = {"size": 1000.0, "along": (tuple(first), tuple(second)), "distortion": 0.2}
    for given, unit in (({}, 1.0), (others, 1000.0)):
        long, short = (
            last(sheared_sheet(0.02, n, cell, **given))["strain_energy"] for n in (12, 8)
        )
        density = (long - short) / (2 * HEIGHT**2 * THICKNESS) / unit
        # compression, and ends that are not wholly out of it
        assert density == pytest.approx(sheared_energy(E, 0.02), rel=5e-3)


# with what an isotropic section leaves of the angular momentum in the same motion
SCHEMES = [
    ("ep", None, 1e-13),
    ("ed", 0.5, 2e-3),
    ("ep4", None, 1.3e-5),
    pytest.param("ed3", 0.5, 1e-4, marks=pytest.mark.slow),
]


def thrown(scheme: str, alpha: float | None, size: float = 1e-4, **given) -> sm.Scene:
    """A free sheet that is pulled, let go and turns: taut, wrinkled, slack in turn."""
    loads = [
        sm.EdgeForce(edge, (sign * size, 0.0, sign * size / 5), time=lambda t: float(t < 1.0))
        for edge, sign in (("left", -1), ("right", 1))
    ]
    turning = sm.InitialVelocity(spin=(0.0, 200 * size, 100 * size), about=(0.5, 0.25, 0.0))
    motion = {"loads": loads, "initial": turning, "dt": 0.25, "t_end": 5.0}
    return plate_scene(scheme, alpha, **({"section": SECTION} | motion | given))


@pytest.mark.parametrize(("scheme", "alpha", "turned"), SCHEMES)
def test_a_sheet_that_goes_slack_keeps_its_account(scheme, alpha, turned) -> None:
    """Energy and momenta from outside, though stresses have kinks within a step."""
    # at small strains, too, where a smooth energy needs no correction
    run, small = (sm.run(thrown(scheme, alpha, size)) for size in (1e-4, 1e-5))
    for each in (run, small):
        # 2e-15 of ep, and 3e-11 of ed3, whose derivatives leave out the kinks: not round-off
        assert each.summary["energy_balance_error"] < (1e-12 if scheme == "ep" else 2e-10)
    assert run.summary["linear_momentum_drift"] < 1e-10
    assert run.summary["angular_momentum_drift"] < 1.5 * turned
    assert np.all(np.diff(run.history["dissipation"]) > -1e-16)


def test_what_compression_stores_is_told() -> None:
    kept = sm.run(stretched_strip(0.4, (2, 4), "quad", compression=1e-2))
    (said,) = [w for w in kept.warnings if "compression=0.01" in w]
    off = 1 + kept.history["turn"].iloc[-1] / LENGTH / stretched_strip_curvature(
        0.4, STRAIN, HEIGHT
    )
    assert 1 < 100 * off / float(said.split(" %")[0]) < 10
    assert not sm.run(stretched_strip(0.3, (2, 4), "quad")).warnings


def test_modes_about_rest_are_those_of_the_taut_sheet() -> None:
    found = sm.modes(
        plate_scene(section=SECTION, supports=sm.Clamped("left"), dt=0.1, t_end=1.0), count=1
    )
    assert "taut at rest" in " ".join(found.warnings)


def test_linear_models_do_not_wrinkle() -> None:
    with pytest.raises(SceneError, match="its model is 'floating-frame'; it must be 'exact'"):
        plate_scene(section=SECTION, model="floating-frame", dt=0.1, t_end=0.2)
    linear = plate_scene("linear-statics", section=SECTION, supports=sm.Clamped("left"))
    found = sm.run(replace(linear, loads=sm.EdgeForce("right", (-1e-6, 0.0, 0.0))))
    assert "does not wrinkle under the scheme 'linear-statics'" in " ".join(found.warnings)


@pytest.mark.slow
@pytest.mark.parametrize("cell", ["quad", "tri"])
def test_an_airbag_from_flat(cell) -> None:
    assert last(airbag.scene(scheme="static", cell=cell))["middle"] == pytest.approx(
        0.2165, rel=5e-3
    )


@pytest.mark.parametrize("value", [-1e-3, 1.5, math.nan])
def test_a_part_of_the_stiffness_is_between_none_and_all(value: float) -> None:
    with pytest.raises(SceneError, match="compression"):
        sm.Wrinkling(1.0, 0.3, 0.01, compression=value)
