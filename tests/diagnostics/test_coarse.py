"""Kind: elements that are wider than the layers of thin curved bodies, in statics."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

import shellmb as sm
from shellmb.demos.verification.problems.elements.curved import octant, on
from shellmb.demos.verification.problems.elements.rows import Mesh, everywhere
from shellmb.demos.verification.problems.linear_shells import hemisphere, scordelis_lo
from shellmb.diagnostics.elements.coarse import Coarse
from shellmb.scene import Scene
from shellmb.simulate.simulation import Simulation


def sphere(mesh: Mesh, thickness: float) -> Scene:
    """An octant of a sphere between forces at its poles."""
    shell, symmetry = octant(mesh, thickness)
    axes = np.eye(3)[:2]
    loads = [sm.PointForce(tuple(x), tuple(-1e-4 * thickness**2 * x)) for x in axes]
    return Scene("sphere", shell, supports=symmetry, loads=loads, scheme="linear-statics")


def tube(mesh: Mesh, thickness: float, load: Any, metre: float = 1.0) -> Scene:
    """A tube that is clamped at its top."""
    section = sm.Isotropic(1.0, 0.3, thickness=thickness * metre, density=1.0)
    surface = sm.Cylinder(metre, metre, angles=(0.0, 90.0))
    normals = {"left": (0, 1, 0), "right": (1, 0, 0), "bottom": (0, 0, 1)}
    symmetry = [sm.SymmetryPlane(name, normal) for name, normal in normals.items()]
    return Scene(
        "tube",
        mesh.shell(surface, section),
        supports=[*symmetry, sm.Clamped("top")],
        loads=load,
        scheme="linear-statics",
    )


def told(scene: Scene) -> tuple[float, float]:
    """How far nodes are off, beside a mesh four times as fine, and what is said of it."""
    simulation = Simulation(scene)
    watch = Coarse(None)  # type: ignore[arg-type]
    simulation.run([watch])
    found = list(watch.cautions(simulation))
    assert len(found) <= 1
    for caution in found:
        assert caution.value is not None
        assert f"off by about {100 * caution.value:.0f} %" in caution.says
    finer = Simulation(replace(scene, scheme="linear-statics").with_options(divide=4))
    finer.run([])
    (shell,) = scene.shells
    (x, u), (X, U) = (everywhere(run, shell.name) for run in (simulation, finer))
    apart, near = cKDTree(X).query(x)
    off = np.linalg.norm(u - U[near], axis=1)[apart < 1e-6 * np.ptp(X)].max()
    most = max(np.linalg.norm(v, axis=1).max() for v in (u, U))
    return float(off / most), sum(c.value or 0.0 for c in found)


def deeper(scene: Scene) -> Scene:
    """The scene with quadrilaterals of degree 3."""
    (shell,) = scene.shells
    return replace(scene, shells=(replace(shell, degree=3 if shell.cell == "quad" else 2),))


PULL = sm.PointForce((1.0, 0.0, 0.0), (-1e-12, 0.0, 0.0))


@pytest.mark.parametrize("cell", ["quad", "tri"])
@pytest.mark.parametrize(
    "scene",
    [
        pytest.param(lambda mesh: sphere(mesh, 2e-2), id="sphere"),
        pytest.param(lambda mesh: sphere(mesh, 1e-3), id="thin sphere"),
        pytest.param(
            lambda mesh: deeper(sphere(replace(mesh, size=(3, 3)), 2e-2)),
            id="quadrilaterals of degree 3",
        ),
        pytest.param(lambda mesh: tube(mesh, 2e-2, PULL), id="pulled tube"),
        pytest.param(lambda mesh: tube(mesh, 1e-3, PULL), id="thin pulled tube"),
        pytest.param(lambda mesh: tube(mesh, 2e-2, sm.Pressure(1e-6)), id="pressure"),
        pytest.param(lambda mesh: tube(mesh, 1e-3, sm.Pressure(1e-9), 1e3), id="thin, in mm"),
        pytest.param(
            lambda mesh: replace(sphere(mesh, 2e-2), scheme="static", dt=1.0, t_end=1.0),
            id="large displacements",
        ),
    ],
)
def test_by_how_much(scene: Any, cell: Any) -> None:
    """It is said within a factor of two."""
    off, said = told(scene(Mesh(cell, (4, 4))))
    assert off > 0.02
    assert off / 2 < said < 2 * off


@pytest.mark.parametrize(
    ("scene", "cell"),
    [
        (scordelis_lo(), "quad"),
        (scordelis_lo(), "tri"),
        (hemisphere(18.0), "quad"),
        (hemisphere(18.0), "tri"),
        (tube(Mesh("quad", (8, 8)), 2e-2, sm.Pressure(1e-6)), "quad"),
    ],
    ids=["roof", "roof of triangles", "hemisphere", "hemisphere of triangles", "tube"],
)
def test_nothing_is_said(scene: Scene, cell: Any) -> None:
    off, said = told(on(Mesh(cell, (8, 8)), scene))
    assert off < 0.02
    assert said == 0.0


def test_what_supports_deform_is_off_by_its_forces() -> None:
    """Of prescribed displacements: forces of 24x24 regular elements of degree 3 are 17.4 % less."""
    hypar = sm.Parametric(lambda x, y: np.stack([x - 0.5, y - 0.5, (x - y) * (x + y - 1)]))
    steel = sm.Isotropic(E=2e11, nu=0.3, thickness=1e-3, density=8e3)
    moved = sm.Fixed("right", displacement=(None, None, -1e-3))
    scene = sm.Scene(
        "hypar",
        sm.Shell("hypar", hypar, steel, (8, 8), distortion=0.25),
        supports=(sm.Clamped("left"), moved),
        scheme="static",
    )
    (warning,) = sm.run(scene, pictures=False).summary["warnings"]
    assert warning["value"] == pytest.approx(0.174, rel=0.1)
    assert "17 % of the forces of its supports" in warning["says"]

    # what a potential deforms moves less
    pulls = sm.Potential("pull", lambda at, p: at.u[2], at="right")
    scene = replace(scene, supports=sm.Clamped("left"), potentials=pulls)
    (warning,) = sm.run(scene, pictures=False).summary["warnings"]
    assert "% of its deformation, of up to 0.0025 m" in warning["says"]
