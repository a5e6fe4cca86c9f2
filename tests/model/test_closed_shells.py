"""Closed shells: whole spheres from the primitive and from gmsh, under pressure and in motion."""

import math
from typing import Any

import numpy as np
import pytest

import shellmb as sm
from shellmb.errors import SceneError
from shellmb.running.execute import execute
from shellmb.scene import (
    Fixed,
    GmshModel,
    Isotropic,
    Pressure,
    Probe,
    Scene,
    Shell,
    Sphere,
)

E, NU, RHO, H = 1e3, 0.3, 1.0, 0.02
SKIN = Isotropic(E, NU, thickness=H, density=RHO)
# six conditions that leave a sphere free to grow about its pole
HELD = [
    Fixed("pole", displacement=(0, 0, 0)),
    Fixed("antipole", displacement=(0, 0, None)),
    Fixed((1.0, 0, 0), displacement=(None, 0, None)),
]


def ball(mesh: tuple[int, int], **more: Any) -> Scene:
    shell = Shell("ball", Sphere(1.0, polar=(0, 180)), SKIN, mesh=mesh)
    return Scene("ball", shell, **more)


@pytest.mark.parametrize(
    ("mesh", "off"), [((4, 4), 0.01), pytest.param((8, 8), 2e-3, marks=pytest.mark.slow)]
)
def test_a_ball_under_pressure_grows_as_a_thin_sphere(mesh: tuple[int, int], off: float) -> None:
    p = 0.1
    probes = [Probe("far", "antipole", component=2), Probe("side", (1.0, 0, 0), component=0)]
    run = execute(ball(mesh, supports=HELD, loads=Pressure(p), probes=probes, dt=1.0))
    grown = p * (1 - NU) / (2 * E * H)
    # twice the growth, as the other pole is held; errors of the mesh
    assert -run.history["far"].iloc[-1] / 2 == pytest.approx(grown, rel=off)
    assert run.history["side"].iloc[-1] == pytest.approx(grown, rel=off)


def test_a_free_ball_vibrates_as_a_membrane_and_has_six_free_motions() -> None:
    found = sm.modes(ball((4, 4), scheme="ep", dt=1.0, t_end=1.0), count=11)
    # Baker 1961: Omega^4 - (n (n + 1) + 1 + 3 nu) Omega^2 + (n (n + 1) - 2) (1 - nu^2) = 0, n = 2
    b, c = 7 + 3 * NU, 4 * (1 - NU**2)
    omega = math.sqrt((b - math.sqrt(b * b - 4 * c)) / 2 * E / (1 - NU**2) / RHO)
    measured = 2 * math.pi * np.array(found.frequencies)
    assert np.abs(measured[:6]).max() < 1e-5 * omega
    # five ellipsoidal ones; bending at R/h = 50 adds 0.03 %, the mesh as much
    assert measured[6:] == pytest.approx(omega, rel=2e-3)


@pytest.mark.slow
def test_a_ball_from_gmsh_is_that_of_the_primitive() -> None:
    def build(gmsh: Any, mesh: tuple[int, int]) -> None:
        gmsh.model.occ.addSphere(0, 0, 0, 1.0)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(2, [t for _, t in gmsh.model.getEntities(2)], name="ball")
        gmsh.option.setNumber("Mesh.MeshSizeMax", 1 / mesh[0])

    volumes = []
    for surface, cell in ((GmshModel(build), "tri"), (Sphere(1.0, polar=(0, 180)), "quad")):
        shell = Shell("ball", surface, SKIN, mesh=(4, 4), cell=cell)  # type: ignore[arg-type]
        found = sm.modes(Scene("ball", shell, scheme="ep", dt=1.0, t_end=1.0), count=7)
        volumes.append(np.abs(found.frequencies[:6]).max() / found.frequencies[6])
    assert max(volumes) < 1e-5


def test_parts_of_spheres_do_not_reach_the_other_pole() -> None:
    with pytest.raises(SceneError, match=r"or be \(0, 180\) with the full azimuth"):
        Sphere(1.0, polar=(0, 180), azimuth=(0, 90))
    with pytest.raises(SceneError, match=r"end below 180 degrees"):
        Sphere(1.0, polar=(90, 180))
