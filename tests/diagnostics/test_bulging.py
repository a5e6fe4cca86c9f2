"""Triangles of doubly curved shells under pressure: the run says by how much vertices are off."""

from typing import Any, cast

import numpy as np
import pytest

from shellmb.diagnostics.elements.bulging import Bulging
from shellmb.running.execute import execute
from shellmb.scene import (
    Cylinder,
    EnclosedVolume,
    Isotropic,
    Pressure,
    Scene,
    Shell,
    Sphere,
    SymmetryPlane,
)
from shellmb.simulate.simulation import Simulation

P, E, NU = 1e-3, 1e3, 0.3
PLANES = [
    SymmetryPlane("left", (0, 1, 0)),
    SymmetryPlane("right", (1, 0, 0)),
    SymmetryPlane("top", (0, 0, 1)),
]
ENDS = [*PLANES, SymmetryPlane("bottom", (0, 0, 1))]


def octant(cells: int, thickness: float, **more: Any) -> Scene:
    """An eighth of a sphere of triangles."""
    surface = Sphere(1.0, polar=(0, 90), azimuth=(0, 90), flip=more.pop("flip", False))
    skin = Isotropic(E, NU, thickness=thickness)
    shell = Shell("ball", surface, skin, mesh=(cells, cells), cell=more.pop("cell", "tri"))
    return Scene("ball", shell, supports=PLANES, dt=1.0, **({"loads": Pressure(P)} | more))


def told(scene: Scene) -> list[float]:
    """Errors that the run names."""
    return [c.value for c in execute(scene).warnings if c.watch == "bulging" and c.value]


@pytest.mark.parametrize(
    ("cells", "thickness"), [(4, 0.02), pytest.param(8, 5e-3, marks=pytest.mark.slow)]
)
def test_the_error_at_vertices_is_said_within_a_factor_of_two(cells: int, thickness: float) -> None:
    scene = octant(cells, thickness)
    simulation = Simulation(scene)
    simulation.run(())
    body = simulation.model.shells["ball"]
    nodes = np.unique(body.mixed.subspaces["u"].dofmap.list[:, :3])
    u = simulation.problem.levels["ball"].q.x.array[body.mixed.dofs["u"]].reshape(-1, 3)
    outwards = np.einsum("ni,ni->n", u, body.mixed.nodes("u"))[nodes]
    # a thin sphere grows by this
    worst = np.abs(outwards / (P * (1 - NU) / (2 * E * thickness)) - 1).max()
    (said,) = told(scene)
    assert worst / 2 < said < 2 * worst


def test_a_volume_and_normals_to_the_inside_are_told_alike() -> None:
    by_pressure = told(octant(4, 0.02))
    oil = EnclosedVolume("oil", change=lambda t: 1e-3 * t)
    assert told(octant(4, 0.02, loads=(), volumes=oil)) == by_pressure
    inside = octant(4, 0.02, flip=True, loads=Pressure(-P))
    assert told(inside) == pytest.approx(by_pressure, rel=1e-12)


@pytest.mark.parametrize(("thickness", "said"), [(0.105, False), (0.086, True)])
def test_vertices_off_by_more_than_five_per_cent_are_told(thickness: float, said: bool) -> None:
    """Of sides of an octant in 4x4 cells of a sphere of radius one, by the law in the module.

    With the mean area `pi/2/24` of its triangles `a b/(a + b)` is 4.6 and 5.7 per cent.
    """
    side = np.sqrt(np.pi / 24)
    thin, most = 0.19 * side**4.5 * thickness**-1.5, 0.6 * side
    assert (thin * most / (thin + most) > 0.05) == said
    simulation = Simulation(octant(4, thickness))
    watch = Bulging(cast(Any, None))
    watch.start(simulation)
    assert bool(list(watch.cautions(simulation))) == said


def test_fine_meshes_quadrilaterals_and_cylinders_are_no_such() -> None:
    assert told(octant(8, 0.02)) == []
    assert told(octant(4, 0.02, cell="quad")) == []
    tube = Shell(
        "tube",
        Cylinder(1.0, 1.0, angles=(0, 90)),
        Isotropic(E, NU, thickness=0.02),
        mesh=(4, 3),
        cell="tri",
    )
    assert told(Scene("tube", tube, supports=ENDS, loads=Pressure(P), dt=1.0)) == []
