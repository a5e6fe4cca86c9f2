"""Modes about states whose loads follow the bodies, or that are unstable: found, and said.

Whether a matrix is symmetric is seen in the matrix, whatever loads there are, and a square that is
negative or complex never goes out without a sentence.
"""

import math
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import shellmb as sm
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.scene import (
    Beam,
    Clamped,
    EdgeForce,
    EdgeMoment,
    FollowerEdgeForce,
    FollowerForce,
    FollowerLineForce,
    FollowerMoment,
    GeneralSection,
    Gravity,
    Isotropic,
    Line,
    PointForce,
    PointMoment,
    Pressure,
    Rectangle,
    Scene,
    Shell,
)
from tests import scenes


def column(load: Any, thin: float = 3e-3, length: float = 1.0, axis: int = 2) -> Scene:
    """A clamped column, `EI/L^2 = 1` and `m L^4/EI = 1`, in units and axes of choice."""
    EI = length**2
    stiff = 12 * EI / (thin * length) ** 2
    section = GeneralSection(
        [stiff, stiff / 2.4, stiff / 2.4, EI, EI, EI],
        mass_per_length=1 / length**2,
        second_moments=tuple(thin**2 / 12 * np.array((1, 0, 1))),
    )
    end = tuple(length * np.eye(3)[axis])
    up = tuple(np.eye(3)[(axis + 1) % 3])
    beam = Beam("column", Line((0, 0, 0), end), section, elements=8, up=up)
    return Scene("column", beams=beam, supports=Clamped("start"), loads=load, scheme="static")


def beck(W: float, P: float = 5.0) -> float:
    """Characteristic function of Beck's column at a frequency."""
    middle = math.sqrt(P**2 / 4 + W**2)
    a, b = math.sqrt(middle + P / 2), math.sqrt(middle - P / 2)
    return float(
        P**2 + 2 * W**2 * (1 + math.cos(a) * math.cosh(b)) + W * P * math.sin(a) * math.sinh(b)
    )


@pytest.mark.parametrize(("length", "axis"), [(1.0, 2), (1000.0, 0), (1e-3, 1)])
def test_both_planes_of_becks_column_have_its_frequencies(length: float, axis: int) -> None:
    """In pairs, whatever units and axes: both planes of bending are alike."""
    modes = natural_modes(
        column(FollowerForce("end", (-5.0, 0, 0)), 3e-3, length, axis), count=4, loaded=True
    )
    exact = np.repeat([brentq(beck, 3, 6), brentq(beck, 15, 25)], 2)
    # shear and rotary inertia of a column as slender as that are 1e-5, eight elements 3e-4
    np.testing.assert_allclose(modes.omega, exact, rtol=1e-3)
    np.testing.assert_allclose(modes.omega[::2], modes.omega[1::2], rtol=1e-6)
    assert not modes.warnings


def test_beyond_becks_load_modes_flutter_and_it_is_said() -> None:
    """Squares are complex from `20.05 EI/L^2` on; growth as that of the complex modes at rest."""
    scene = column(FollowerForce("end", (-22.0, 0, 0)))
    modes = sm.modes(scene, count=4, loaded=True, pictures=False)
    (said,) = modes.warnings
    assert "flutter" in said and "modes 1, 2, 3, 4 grow" in said
    assert not modes.table["stable"].any()
    complex_ones = sm.modes(
        scene, count=4, loaded=True, rates=[0.0], axis=(0, 0, 1), pictures=False
    ).table
    growth = modes.table["growth_per_s"].to_numpy()
    assert growth == pytest.approx(complex_ones["growth_per_s"].abs().to_numpy(), rel=1e-5)
    assert modes.frequencies == pytest.approx(complex_ones["frequency_hz"].tolist(), rel=1e-5)


def solved_as(monkeypatch: pytest.MonkeyPatch, scene: Scene) -> bool:
    """Whether the eigenproblem of a scene is solved as a symmetric one."""
    module, seen = sys.modules["shellmb.simulate.eigenmodes"], []
    original = module.eigenpairs

    def watched(*given: Any) -> Any:
        seen.append(given[-1])
        return original(*given)

    monkeypatch.setattr(module, "eigenpairs", watched)
    natural_modes(scene, count=2, loaded=True)
    # later ones are of better elements without loads
    return bool(seen[0])


FOLLOWING = {
    "point": FollowerForce("end", (-1.0, 0.1, 0.0)),
    "line": FollowerLineForce((0.1, 0.2, 0.0)),
    "moment": FollowerMoment("end", (0.2, 0.1, 0.0)),
    # a moment that keeps its direction in space has no potential either (H. Ziegler, 1952)
    "dead moment": PointMoment("end", (0.0, 0.0, 0.3)),
}


@pytest.mark.parametrize("load", FOLLOWING.values(), ids=FOLLOWING)
@pytest.mark.parametrize("thin", [1e-1, 1e-4])
def test_loads_of_beams_without_a_potential_show_in_the_matrix(
    load: Any, thin: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever class they are of, and however stiff the beam is beside them."""
    assert not solved_as(monkeypatch, column(load, thin))
    assert solved_as(monkeypatch, column(PointForce("end", (0.3, 0, -1.0)), thin))


def plate(load: Any, held: Any, thin: float) -> Scene:
    """A plate under a load times its bending stiffness."""
    section = Isotropic(E=210e9, nu=0.3, thickness=thin, density=7850.0)
    given = {"supports": Clamped(held), "loads": load(210e9 * thin**3 / 12)}
    return scenes.plate_scene("static", section=section, size=(1.0, 0.3), mesh=(4, 2), **given)


@pytest.mark.parametrize("thin", [1e-2, 2e-4])
def test_loads_of_shells_show_in_the_matrix(thin: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pressure has a potential where all edges are held, and none where one moves."""
    every = ("left", "right", "top", "bottom")
    for load, held, symmetric in (
        (lambda D: Pressure(D), "left", False),
        (lambda D: Pressure(D), every, True),
        (lambda D: FollowerEdgeForce("right", (0, 0, D / 2)), "left", False),
        (lambda D: EdgeMoment("right", (0, D / 2, 0)), "left", False),
        (lambda D: EdgeForce("right", (0, 0, D / 2)), "left", True),
        (lambda D: Gravity((0, 0, -0.1)), "left", True),
    ):
        with monkeypatch.context() as patch:
            assert solved_as(patch, plate(load, held, thin)) is symmetric


@pytest.mark.parametrize("thin", [2e-3, 2e-4])
@pytest.mark.parametrize("count", [3, 7])
def test_rigid_motions_of_a_free_plate_are_not_called_unstable(thin: float, count: int) -> None:
    """Also where no elastic mode is asked for, by whose size they could be told."""
    section = Isotropic(E=70e9, nu=0.3, thickness=thin, density=2700.0)
    free = Shell("plate", Rectangle(1.0, 1.0), section, mesh=(8, 8))
    modes = natural_modes(Scene("free", free, scheme="ep", dt=1.0, t_end=1.0), count=count)
    assert modes.rigid == min(count, 6)
    assert not modes.warnings and not modes.growth.any()


def test_the_lowest_mode_is_found_far_beyond_the_critical_load() -> None:
    """Clamped and free, at 40 times Euler's load: the first mode asked for is the lowest."""
    load = PointForce("end", (0, 0, -100.0))
    one, many = (natural_modes(column(load, 1e-2), count=count, loaded=True) for count in (1, 10))
    assert one.omega2[0] == pytest.approx(many.omega2[0], rel=1e-8)
    # P_n = (2 n - 1)^2 pi^2/4: three of each plane are below 100 (2.5, 22.2, 61.7; 120.9 is not)
    assert int(np.sum(many.omega2 < 0)) == many.unstable == 6
    assert len(many.warnings) == 1 and "modes 1, 2, 3, 4, 5, 6 grow" in many.warnings[0]
    assert "6 directions, 1 of which" in one.warnings[1]


@pytest.mark.parametrize("force", [1e-3, 1.0])
def test_the_lowest_mode_is_found_where_loads_follow(force: float) -> None:
    """No inertia counts what diverges there: from 40 to 800 times Euler's load it is found."""
    for P, elements in ((100.0, 8), (2000.0, 16)):
        dead, follows = PointForce("end", (0, 0, -P)), FollowerForce("end", (force, 0, 0))
        scene = column([dead, follows], 1e-2)
        scene = replace(scene, beams=replace(scene.beams[0], elements=elements))
        one, many = (natural_modes(scene, count=count, loaded=True) for count in (1, 40))
        assert one.unstable is None
        assert one.omega2[0] == pytest.approx(many.omega2[0], rel=1e-6)
        assert "divergence" in one.warnings[0]
