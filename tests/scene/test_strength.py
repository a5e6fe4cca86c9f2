"""Criteria of failure: reserve factors in closed form, published ones, and what each must keep."""

import math
from dataclasses import replace

import numpy as np
import pytest

from shellmb.errors import SceneError
from shellmb.scene import Strength
from shellmb.scene.shells.strength import CRITERIA

# carbon and epoxy of A. K. Kaw, Mechanics of Composite Materials, 2nd ed. (2006), table 2.1, in MPa
KAW = Strength(Xt=1500, Xc=1500, Yt=40, Yc=246, S12=68, S13=68, S23=50, yield_stress=300)
CARBON = Strength(
    Xt=2000, Xc=1100, Yt=60, Yc=200, S12=80, S13=80, S23=70, yield_stress=300,
    e1t=0.015, e1c=0.008, e2t=0.006, e2c=0.02, g12=0.016,
)  # fmt: skip
IN_PLANE = ("max-stress", "tsai-hill", "tsai-wu", "hashin", "puck")


def utilisation(criterion: str, stress, strength=CARBON, strain=None) -> float:
    s = np.zeros((5,) if np.ndim(stress) == 1 else (len(stress), 5))
    s[..., : np.shape(stress)[-1]] = stress
    e = s if strain is None else np.asarray(strain)
    return CRITERIA[criterion].utilisations(s, e, strength).max(axis=-1)


def along_fibres(pull, degrees: float):
    """Stresses 11, 22, 12 under stresses x, y, xy, the fibres at an angle to x."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    x, y, xy = pull
    return (
        c * c * x + s * s * y + 2 * c * s * xy,
        s * s * x + c * c * y - 2 * c * s * xy,
        c * s * (y - x) + (c * c - s * s) * xy,
    )


def test_published_factors() -> None:
    """Kaw's examples 2.17 to 2.20: x = 2, y = -3, xy = 4 MPa at 60 degrees."""
    stress = along_fibres((2.0, -3.0, 4.0), 60.0)
    for criterion, factor in (("max-stress", 16.33), ("tsai-hill", 16.06), ("tsai-wu", 22.39)):
        # all digits of the book
        assert 1 / utilisation(criterion, stress, KAW) == pytest.approx(factor, abs=6e-3)


@pytest.mark.parametrize("degrees", [0, 5, 15, 30, 45, 60, 75, 90])
@pytest.mark.parametrize("sign", [1, -1])
def test_off_axis_strength_is_in_closed_form(degrees: float, sign: int) -> None:
    """A ply that is pulled at an angle: R. M. Jones, Mechanics of Composite Materials."""
    k, c, s = CARBON, math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    X, Y = (k.Xt, k.Yt) if sign > 0 else (k.Xc, k.Yc)
    stress = along_fibres((sign, 0.0, 0.0), degrees)
    hill = c**4 / X**2 + (1 / k.S12**2 - 1 / X**2) * s**2 * c**2 + s**4 / Y**2
    assert 1 / utilisation("tsai-hill", stress) == pytest.approx(hill**-0.5)
    largest = max(c * c / X, s * s / Y, s * c / k.S12)
    assert utilisation("max-stress", stress) == pytest.approx(largest)
    b = sign * (c**2 * (1 / k.Xt - 1 / k.Xc) + s**2 * (1 / k.Yt - 1 / k.Yc))
    F11, F22 = 1 / (k.Xt * k.Xc), 1 / (k.Yt * k.Yc)
    a = F11 * c**4 + F22 * s**4 + s**2 * c**2 * (1 / k.S12**2 - math.sqrt(F11 * F22))
    assert 1 / utilisation("tsai-wu", stress) == pytest.approx(np.roots([a, b, -1]).max())


def test_single_stresses_fail_at_their_strengths() -> None:
    k = CARBON
    cases = (((k.Xt,), 0), ((-k.Xc,), 1), ((0, k.Yt), 2), ((0, -k.Yc), 3), ((0, 0, k.S12), 4))
    for criterion in IN_PLANE:
        for stress, _ in cases:
            assert utilisation(criterion, stress) == pytest.approx(1.0), (criterion, stress)
    modes = {"max-stress": (0, 1, 2, 3, 4), "hashin": (0, 1, 2, 3), "puck": (0, 1, 2, 4)}
    for criterion, numbers in modes.items():
        for (stress, _), mode in zip(cases, numbers, strict=False):
            s = np.array([*stress, *5 * [0.0]][:5])
            found = CRITERIA[criterion].utilisations(s, s, k)
            assert found.argmax() == mode
    for number, strain in enumerate((k.e1t, -k.e1c, k.e2t, -k.e2c, k.g12)):
        e = np.zeros(5)
        e[(0, 0, 1, 1, 2)[number]] = strain
        found = CRITERIA["max-strain"].utilisations(e, e, k)
        assert found.argmax() == number and found.max() == pytest.approx(1.0)
    assert utilisation("interlaminar", (0, 0, 0, k.S13, 0)) == pytest.approx(1.0)
    assert utilisation("interlaminar", (0, 0, 0, 48.0, 56.0)) == pytest.approx(1.0)
    assert utilisation("von-mises", (k.yield_stress,)) == pytest.approx(1.0)
    assert utilisation("von-mises", (0, 0, 0, 300 / math.sqrt(3), 0)) == pytest.approx(1.0)


@pytest.mark.parametrize("criterion", CRITERIA)
def test_factors_are_linear_in_the_load(criterion: str) -> None:
    """Of any stress: utilisations grow as it does, without jumps, in any units."""
    random = np.random.default_rng(1)
    size = np.array([500.0, 60.0, 50.0, 40.0, 40.0])
    stress = size * random.normal(size=(2000, 5))
    strain = stress / np.array([140e3, 9e3, 5e3, 5e3, 3e3])
    rule, one = CRITERIA[criterion], CRITERIA[criterion].utilisations(stress, strain, CARBON)
    assert (one >= 0).all() and np.isfinite(one).all()
    twice = rule.utilisations(3.7 * stress, 3.7 * strain, CARBON)
    np.testing.assert_allclose(twice, 3.7 * one, rtol=1e-12, atol=1e-14)
    assert not rule.utilisations(0 * stress, 0 * strain, CARBON).any()
    # Pa in place of MPa; strains have no unit
    names = [n for n in rule.needs if not n.startswith(("e", "g"))]
    pascal = replace(CARBON, **{name: 1e6 * getattr(CARBON, name) for name in names})
    scaled = rule.utilisations(1e6 * stress, strain, pascal)
    np.testing.assert_allclose(scaled, one, rtol=1e-12, atol=1e-14)
    # what the criterion itself says at failure, of the quadratic ones
    R = 1 / one.max(axis=1)
    s1, s2, s12 = (R[:, None] * stress).T[:3]
    k = CARBON
    if criterion == "tsai-wu":
        index = s1**2 / (k.Xt * k.Xc) + s2**2 / (k.Yt * k.Yc) + s12**2 / k.S12**2
        index += k.f12 * 2 * s1 * s2 / math.sqrt(k.Xt * k.Xc * k.Yt * k.Yc)
        index += s1 * (1 / k.Xt - 1 / k.Xc) + s2 * (1 / k.Yt - 1 / k.Yc)
        np.testing.assert_allclose(index, 1.0, atol=1e-12)
    if criterion == "hashin":
        rows = one.argmax(axis=1) == 3
        index = (s2 / (2 * k.S23)) ** 2 + (s12 / k.S12) ** 2
        index += ((k.Yc / (2 * k.S23)) ** 2 - 1) * s2 / k.Yc
        assert rows.sum() > 50
        np.testing.assert_allclose(index[rows], 1.0, atol=1e-12)
    # modes of Puck between fibres meet without a jump along the stresses 22 and 12
    if criterion == "puck":
        angle = np.linspace(0, np.pi, 4001)
        path = np.stack([0 * angle, 90 * np.cos(angle), 90 * np.sin(angle)], axis=1)
        along = utilisation("puck", path)
        assert np.abs(np.diff(along)).max() < 5e-3


def test_strengths_are_positive() -> None:
    for wrong, says in (
        ({"Xt": -1.0}, "strength: Xt is -1.0; it must be greater than 0"),
        ({"S12": 0.0}, "strength: S12 is 0.0; it must be greater than 0"),
        ({"f12": 1.0}, "strength: f12 is 1.0; it must be less than 1"),
    ):
        with pytest.raises(SceneError, match=says):
            Strength(**wrong)
