"""Kind: modes of linear buckling that single elements have, and the shell has not."""

from dataclasses import replace
from typing import Any

import pytest
import ufl

from shellmb.demos.verification.problems.linear_shells import compressed_cylinder, compressed_plate
from shellmb.running.natural_modes.run import find_buckling
from shellmb.scene import Hyperelastic, Scene, ShellDamping


def buckled(scene: Scene, tmp_path: Any, count: int = 4) -> Any:
    return find_buckling(scene, tmp_path / "run", count, pictures=False)


def test_elements_that_buckle_one_by_one_are_said(tmp_path) -> None:
    """Of a cylinder in its ring mode, at one of the classical load, on one cell across."""
    found = buckled(compressed_cylinder("tri", (1, 24)), tmp_path)
    (sentence,) = found.warnings
    assert sentence.startswith("modes 1, 3, 4 are of single elements of shell 'sector'")
    # of the quadratic forms themselves 0.3891 at most
    assert "up to 39 % of the energy" in sentence
    assert found.factors[0] < 0.9


@pytest.mark.parametrize("mesh", [(1, 8), (1, 24), (2, 8), (2, 16), (4, 16)])
def test_quadrilaterals_do_not(mesh: tuple[int, int], tmp_path) -> None:
    """Ring modes of four, and of three and five half-waves, in every shape of element."""
    found = buckled(compressed_cylinder("quad", mesh), tmp_path)
    # 1.000, 1.112 on eight elements along four half-waves, 0.996, 1.091 on 24
    assert found.factors[:2] == pytest.approx([0.998, 1.10], rel=0.02)
    assert found.warnings == []


DAMPING = ShellDamping(membrane=1e-3, bending=2e-3, shear=3e-3)


def quadratic(strains: Any, p: Any) -> Any:
    """Energy of an isotropic section without contraction."""
    eps, kap, gam = strains

    def of(e: Any) -> Any:
        return e[0] ** 2 + e[1] ** 2 + e[2] ** 2 / 2

    return p["membrane"] * of(eps) + p["bending"] * of(kap) + p["shear"] * ufl.dot(gam, gam)


STIFF = {"membrane": 3.5e8, "bending": 2.9e3, "shear": 1.15e8}
RUBBER = Hyperelastic(quadratic, STIFF, thickness=0.01, density=1.0, stiffness=7e8)


@pytest.mark.parametrize(
    "change",
    [
        pytest.param(lambda s: replace(s, section=RUBBER), id="hyperelastic"),
        pytest.param(lambda s: replace(s, transverse_shear=False), id="unshearable"),
        pytest.param(
            lambda s: replace(
                s, section=replace(s.section, offset=2e-3, stiffness_damping=DAMPING)
            ),
            id="coupled, unlike damping",
        ),
    ],
)
def test_they_are_said_of_any_section(change, tmp_path) -> None:
    """Whatever the form of the section's energy is."""
    scene = compressed_cylinder("tri", (1, 16))
    found = buckled(replace(scene, shells=(change(scene.shells[0]),)), tmp_path)
    assert found.factors[0] < 0.9
    assert len(found.warnings) == 1


@pytest.mark.parametrize(
    "scene",
    [
        pytest.param(compressed_cylinder("quad", (8, 32)), id="cylinder"),
        pytest.param(compressed_cylinder("tri", (6, 24)), id="triangles"),
        pytest.param(compressed_plate("quad", 100.0, 8)[0], id="fine"),
        pytest.param(compressed_plate("quad", 10.0, 4)[0], id="thick"),
        pytest.param(compressed_plate("quad", 1000.0, 4)[0], id="thin"),
        pytest.param(compressed_plate("tri", 1000.0, 8)[0], id="thin triangles"),
    ],
)
def test_modes_of_shells_are_not(scene, tmp_path) -> None:
    assert buckled(scene, tmp_path).warnings == []
