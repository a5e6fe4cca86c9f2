"""Kind: single nodes of triangles that move against their neighbours, in states and in modes."""

import re
from dataclasses import replace
from typing import Any

from mpi4py import MPI

import numpy as np
import pytest
import ufl

import shellmb as sm
from shellmb.demos.verification.problems.elements.curved import octant
from shellmb.demos.verification.problems.elements.rows import Mesh, everywhere
from shellmb.demos.verification.problems.linear_shells import compressed_cylinder, compressed_plate
from shellmb.diagnostics.elements.coarse import Coarse
from shellmb.running.natural_modes.run import find_buckling
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.scene import Hyperelastic, Scene, ShellDamping
from shellmb.simulate.simulation import Simulation


def filled(cell: Any, size: int, thickness: float, **more: Any) -> Scene:
    """An eighth of a closed sphere under pressure, with a modulus, radius and density of one."""
    shell, symmetry = octant(Mesh(cell, (size, size)), thickness)
    load = sm.Pressure(1e-4 * thickness)
    return Scene("filled", shell, supports=symmetry, loads=load, **more)


def tube(thickness: float, around: int, **more: Any) -> Scene:
    """A tube under pressure, which can grow all over, of triangles."""
    shell = sm.Shell(
        "shell",
        sm.Cylinder(1.0, 1.0, angles=(0.0, 90.0)),
        sm.Isotropic(1.0, 0.3, thickness=thickness, density=1.0),
        (around, around),
        cell="tri",
    )
    normals = {"left": (0, 1, 0), "right": (1, 0, 0), "bottom": (0, 0, 1)}
    symmetry = [sm.SymmetryPlane(name, normal) for name, normal in normals.items()]
    load = sm.Pressure(1e-4 * thickness)
    return Scene("tube", shell, supports=symmetry, loads=load, **more)


def told(scene: Scene) -> tuple[float | None, Simulation]:
    """What the watch says of a run, and the run."""
    simulation = Simulation(scene)
    watch = Coarse(None)  # type: ignore[arg-type]
    simulation.run([watch])
    found = list(watch.cautions(simulation))
    if found:
        assert found[0].value is not None
        assert f"off by about {100 * found[0].value:.0f} %" in found[0].says
    return (found[0].value if found else None), simulation


@pytest.mark.parametrize(
    ("scene", "axes", "exact"),
    [
        (filled("tri", 4, 1e-3, scheme="linear-statics"), 3, 0.35e-4),
        (filled("tri", 4, 2e-2, scheme="static", dt=1.0, t_end=1.0), 3, 0.35e-4),
        (filled("tri", 8, 1e-3, scheme="linear-statics"), 3, 0.35e-4),
        (tube(1e-3, 4, scheme="linear-statics"), 2, 1e-4),
        (tube(1e-3, 8, scheme="linear-statics"), 2, 1e-4),
    ],
    ids=["thin", "large displacements", "finer", "tube", "finer tube"],
)
def test_how_far_nodes_are_off(scene: Scene, axes: int, exact: float) -> None:
    """Within a factor of two, beside the growth of a sphere and of a cylinder."""
    said, simulation = told(scene)
    x, u = everywhere(simulation)
    out = np.linalg.norm(x[:, :axes], axis=1)
    growth = np.sum(u[:, :axes] * x[:, :axes], axis=1) / out
    off = np.abs(growth - exact).max() / np.linalg.norm(u, axis=1).max()
    assert said is not None and off / 2 < said < 2 * off


@pytest.mark.parametrize("scheme", ["ep", "ed", "ep4", "ed3"])
def test_in_motion(scheme: str) -> None:
    """A sphere that breathes: as much as at rest."""
    said, _ = told(filled("tri", 4, 1e-3, scheme=scheme, dt=0.1, t_end=0.3))
    still, _ = told(filled("tri", 4, 1e-3, scheme="linear-statics"))
    assert said == pytest.approx(still, rel=1e-6)


def _plate(cell: Any, size: int, **section: Any) -> sm.Shell:
    return sm.Shell(
        "shell",
        sm.Rectangle(1.0, 1.0),
        sm.Isotropic(1.0, 0.3, density=1.0, **section),
        (size, size),
        cell=cell,
    )


EDGES = "left", "right", "bottom", "top"


@pytest.mark.parametrize(
    "scene",
    [
        filled("quad", 4, 1e-3, scheme="linear-statics"),
        filled("tri", 8, 2e-2, scheme="linear-statics"),
        *(
            Scene(
                "plate",
                _plate("tri", 8, **section),
                supports=sm.Clamped(EDGES),
                loads=sm.SurfaceForce((0.0, 0.0, 1e-9)),
                scheme="linear-statics",
            )
            # the second one shears more than it bends, and its bulges are right
            for section in ({"thickness": 1e-2}, {"thickness": 0.1, "shear_correction": 1e-2})
        ),
    ],
    ids=["quadrilaterals", "right", "plate", "soft in shear"],
)
def test_nothing_is_told(scene: Scene) -> None:
    assert told(scene)[0] is None


def test_natural_modes_tell() -> None:
    """A plate of 4x4 on hinges: its ninth frequency is 17 % too low, its first is right."""
    plate = _plate("tri", 4, thickness=1e-2)
    hinged = sm.Fixed(EDGES, displacement=(0.0, 0.0, 0.0))
    found = natural_modes(Scene("plate", plate, supports=hinged), count=9)
    bending = np.sqrt(1e-4 / 12 / 0.91)
    navier = np.sort([i**2 + j**2 for i in range(1, 6) for j in range(1, 6)])[:9]
    low = 1 - found.frequencies / (np.pi / 2 * bending * navier)
    assert abs(low[0]) < 0.01 and low[8] > 0.15
    (sentence,) = found.warnings
    said = re.search(r"modes 5, 7, 8, 9 are off .*mode 9 most of all, by about (\d+) %", sentence)
    assert said is not None and low[8] / 2 < int(said[1]) / 100 < 2 * low[8]


def buckled(scene: Scene, count: int = 4) -> Any:
    return find_buckling(scene, MPI.COMM_WORLD, count).computed


def test_elements_that_buckle_one_by_one_are_said() -> None:
    """Of a cylinder in its ring mode, at one of the classical load, on one cell across."""
    found = buckled(compressed_cylinder("tri", (1, 24)))
    (sentence,) = found.warnings
    # the second one, 0.90, should be 1.10
    assert "modes 1, 2, 3, 4 are off in their load factor" in sentence
    assert found.factors[0] < 0.9


@pytest.mark.parametrize("mesh", [(1, 8), (1, 24), (2, 8), (2, 16), (4, 16)])
def test_quadrilaterals_do_not(mesh: tuple[int, int]) -> None:
    """Ring modes of four, and of three and five half-waves, in every shape of element."""
    found = buckled(compressed_cylinder("quad", mesh))
    # 1.000, 1.112 on eight elements along four half-waves, 0.996, 1.091 on 24
    assert found.factors[:2] == pytest.approx([0.998, 1.10], rel=0.02)
    # the fourth one of eight elements, 1.392, is 1.326 on finer meshes
    assert [text[:13] for text in found.warnings] == ["mode 4 is off"] * (mesh[1] == 8)


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
def test_they_are_said_of_any_section(change) -> None:
    """Whatever the form of the section's energy is."""
    scene = compressed_cylinder("tri", (1, 16))
    found = buckled(replace(scene, shells=(change(scene.shells[0]),)))
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
def test_modes_of_shells_are_not(scene) -> None:
    # higher ones are those of finer meshes no more
    assert buckled(scene, 2).warnings == []
