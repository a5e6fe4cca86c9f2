"""`alpha`: the default of each scheme, and what is said where it has no effect."""

import warnings

import pytest

from shellmb.errors import ShellmbWarning
from shellmb.options.run import Options
from shellmb.scene import Clamped, Isotropic, Rectangle, Scene, Shell
from shellmb.scene.checks.ignored_settings import doubts
from shellmb.scene.schemes import DISSIPATIVE, SCHEMES, dissipation
from shellmb.schemes.registry import make_scheme

PLATE = Shell("plate", Rectangle(1, 1), Isotropic(E=2e11, nu=0.3, thickness=0.01, density=7800))


def made(**changes):
    return Scene("s", PLATE, supports=Clamped("left"), **{"dt": 0.1, "t_end": 0.5} | changes)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_defaults(scheme):
    scene = made(scheme=scheme)
    own = getattr(make_scheme(scene.scheme, scene.dissipation), "alpha", 0.0)
    assert dissipation(scheme, None) == own  # also of `sm.Motion`
    assert own == scene.dissipation == DISSIPATIVE.get(scheme, 0.0) <= 0.5
    if scheme == "generalized-alpha":
        assert (1 - own) / (1 + own) == pytest.approx(0.8)  # what its users take


@pytest.mark.parametrize("scheme", SCHEMES)
def test_it_is_ignored_with_a_warning(scheme):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        scene = made(scheme=scheme, alpha=0.3)
    said = [str(w.message) for w in caught if w.category is ShellmbWarning]
    if scheme in DISSIPATIVE:
        assert (said, scene.dissipation) == ([], 0.3)
    else:
        assert said == [
            f"scene 's': alpha=0.3 has no effect: '{scheme}' takes no numerical dissipation from "
            "the scene; remove alpha, or use 'ed' or 'ed3'"
        ]
        # a run has it among its warnings, also one that changes other things
        with pytest.warns(ShellmbWarning, match="has no effect"):
            assert list(doubts(Options(t_end=0.3).apply(scene))) == said


def test_options():
    with pytest.warns(ShellmbWarning, match="alpha=1.0 has no effect: 'static' takes no"):
        Options(scheme="static", alpha=1.0).apply(made(scheme="ep"))
    # another scheme without a word about alpha: nothing to say
    assert Options(scheme="ep").apply(made(scheme="ed", alpha=0.3)).alpha is None
    assert Options(scheme="ed3").apply(made(scheme="ed", alpha=0.3)).dissipation == 0.3
