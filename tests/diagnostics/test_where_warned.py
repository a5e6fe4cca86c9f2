"""Warnings are at the user's line, however deep in the project they begin.

The kind: a number of frames between both, which was wrong wherever a decorator, a check of a
dataclass or one more function was between them.
"""

import warnings
from collections.abc import Callable

import pytest

import shellmb as sm


def strip(E=200e9, thickness=2e-3, spare=1.0, **more) -> sm.Scene:
    steel = sm.Isotropic(E=E, nu=0.3, thickness=thickness, density=7850)
    return sm.Scene(
        **{
            "name": "strip",
            "shells": sm.Shell("strip", sm.Rectangle(0.5, 0.1), steel, mesh=(4, 1)),
            "supports": sm.Clamped("left"),
            "loads": sm.EdgeForce("right", (0, 0, 20.0)),
            "probes": [sm.Probe(name, (0.5, 0.05, 0), component=2) for name in ("tip", "twin")],
            "scheme": "ep",
            "dt": 5e-3,
            "t_end": 0.01,
            **more,
        }
    )


def larger(history) -> float:
    """The larger one of two values that are one."""
    return max(history["tip"][1], history["twin"][1])


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: strip(alpha=0.3), "alpha=0.3 has no effect"),
        (lambda: strip(scheme="linear"), "is now called"),
        (lambda: sm.run(strip(thickness=0.6), pictures=False), "so check the units"),
        (lambda: sm.adjoint(strip, larger, parameters="E"), "the objective has a kink"),
        (lambda: sm.frequency_sensitivities(strip, "spare", count=1), "nothing depends on 'spare'"),
    ],
)
def test_where_warned(call: Callable, said: str) -> None:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        call()
    found = [w for w in caught if said in str(w.message)]
    assert found
    assert {w.filename for w in found} == {__file__}
