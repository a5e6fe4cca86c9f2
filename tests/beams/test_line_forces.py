"""A force per length that varies along a beam, exact and in modes."""

from typing import Any

import numpy as np
import pytest

import shellmb as sm
from shellmb.errors import SceneError

LENGTH, SIDE, YOUNG = 2.0, 0.02, 1e9


def grows(x: Any) -> Any:
    """One at the end, zero at the start."""
    return np.array([0 * x[0], 0 * x[0], x[0] / LENGTH])


def cantilever(force: Any, **more: Any) -> sm.Scene:
    section = sm.RectangularSection(E=YOUNG, nu=0.3, width=SIDE, height=SIDE, density=1000.0)
    line = sm.Line((0, 0, 0), (LENGTH, 0, 0))
    return sm.Scene(
        "cantilever",
        beams=sm.Beam("beam", line, section, elements=8, **more),
        supports=sm.Clamped("start"),
        loads=sm.LineForce(force),
        probes=sm.Probe("z", "end"),
        scheme="linear-statics",
    )


@pytest.mark.parametrize("more", [{}, {"model": sm.Modal(6)}])
def test_a_force_that_grows_along_a_cantilever(more: dict[str, Any]) -> None:
    """`11 q L^4/(120 E I)` by Timoshenko, Strength of Materials; shear adds 1e-4."""
    scene = cantilever(grows, **more)
    if more:
        scene = scene.with_options(scheme="static")
    exact = 11 * LENGTH**4 / 120 / (YOUNG * SIDE**4 / 12)
    # 9e-3 of the length, whose square counts in large displacements
    assert sm.run(scene).history["z"].iloc[-1] == pytest.approx(exact, rel=5e-3 if more else 2e-4)


def test_a_force_of_one_number_is_refused() -> None:
    with pytest.raises(SceneError, match="line force: force gives an array of shape"):
        cantilever(lambda x: x[0])
