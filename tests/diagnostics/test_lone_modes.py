"""Kind: modes of linear buckling that single elements have, and the shell has not."""

from typing import Any

import pytest

from shellmb.demos.verification.problems.linear_shells import compressed_cylinder, compressed_plate
from shellmb.running.modes import find_buckling
from shellmb.scene import Scene


def buckled(scene: Scene, tmp_path: Any, count: int = 4) -> Any:
    return find_buckling(scene, tmp_path / "run", count, pictures=False)


def test_elements_that_buckle_one_by_one_are_said(tmp_path) -> None:
    """Of a cylinder in its ring mode, at one of the classical load, on two cells across."""
    found = buckled(compressed_cylinder("quad", (2, 16)), tmp_path)
    (sentence,) = found.warnings
    assert sentence.startswith("modes 1, 2 are of single elements of shell 'sector'")
    assert found.factors[1] < 0.9 < found.factors[2] == pytest.approx(1.0, rel=0.01)


@pytest.mark.parametrize(
    "scene",
    [
        pytest.param(compressed_cylinder("quad", (8, 32)), id="cylinder"),
        pytest.param(compressed_cylinder("tri", (6, 24)), id="triangles"),
        pytest.param(compressed_plate("quad", 10.0, 4)[0], id="thick"),
        pytest.param(compressed_plate("quad", 1000.0, 4)[0], id="thin"),
        pytest.param(compressed_plate("tri", 1000.0, 8)[0], id="thin triangles"),
    ],
)
def test_modes_of_shells_are_not(scene, tmp_path) -> None:
    assert buckled(scene, tmp_path).warnings == []
