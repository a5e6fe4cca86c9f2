"""Loads and material directions that are functions of the position; surfaces turned over."""

from typing import Any

from mpi4py import MPI

import numpy as np
import pytest

from shellmb.errors import SceneError
from shellmb.model.model import Model
from shellmb.running.execute import execute
from shellmb.scene import (
    Clamped,
    Cylinder,
    Diaphragm,
    EdgeForce,
    EdgeMoment,
    Fixed,
    Isotropic,
    Laminate,
    MeshFile,
    Ply,
    PlyMaterial,
    Pressure,
    Probe,
    Rectangle,
    Scene,
    Shell,
    Sphere,
    SymmetryPlane,
)

L, B, H, E = 1.0, 0.2, 0.01, 1e9


def strip(load: Any) -> float:
    scene = Scene(
        "strip",
        Shell("strip", Rectangle(L, B), Isotropic(E, 0.0, thickness=H), mesh=(8, 1)),
        supports=Clamped("left"),
        loads=load,
        probes=Probe("tip", (L, 0.0, 0.0)),
        scheme="linear-statics",
    )
    return float(execute(scene).column("tip")[-1])


def test_a_pressure_that_falls_off_bends_as_a_beam_does() -> None:
    p = 10.0
    # triangular load: q L^4 / (30 E I); shear: q L^2/6 / (5/6 G h), 3e-4 of it
    bent = p * L**4 / (30 * E * H**3 / 12) + p * L**2 / 6 / (5 / 6 * E / 2 * H)
    # quadratic elements under a cubic moment
    assert strip(Pressure(lambda x: p * (1 - x[0] / L))) == pytest.approx(bent, rel=2e-4)


def test_constant_functions_are_constants() -> None:
    force, moment = (0.0, 0.0, 1.0), (0.0, -0.3, 0.0)

    def constant(value: tuple[float, float, float]) -> Any:
        return lambda x: np.tile(np.array(value)[:, None], x.shape[1])

    pairs = [
        (EdgeForce("right", force), EdgeForce("right", constant(force))),
        (EdgeMoment("right", moment), EdgeMoment("right", constant(moment))),
        (Pressure(3.0), Pressure(lambda x: 0 * x[0] + 3.0)),
    ]
    for given, of_position in pairs:
        assert strip(of_position) == pytest.approx(strip(given), rel=1e-12)


def test_functions_of_another_shape_are_refused() -> None:
    with pytest.raises(SceneError, match=r"pressure: p gives an array of shape \(3, 7\)"):
        strip(Pressure(lambda x: x))
    with pytest.raises(SceneError, match="edge force: force fails"):
        strip(EdgeForce("right", lambda x: x[5]))


def hoop(x: Any) -> Any:
    """Direction around the z axis."""
    return np.stack([-x[1], x[0], 0 * x[2]])


def pressurised(flip: bool = False, direction: Any = hoop) -> float:
    """Radial displacement of a closed tube with fibres around it, free at its ends."""
    fibre = PlyMaterial(E1=1e8, E2=1e6, nu12=0.3, G12=1e6, G13=1e6, G23=1e6)
    scene = Scene(
        "tube",
        Shell(
            "tube",
            Cylinder(1.0, 0.5, flip=flip),
            Laminate((Ply(fibre, 0.01),)),
            mesh=(24, 1),
            direction=direction,
        ),
        supports=[
            Fixed("bottom", displacement=(None, None, 0.0)),
            Fixed("left-bottom", displacement=(None, 0.0, None)),
            Fixed((-1.0, 0.0, 0.0), displacement=(None, 0.0, None)),
            Fixed((0.0, 1.0, 0.0), displacement=(0.0, None, None)),
        ],
        loads=Pressure(100.0),
        probes=Probe("r", (1.0, 0.0, 0.5), component=0),
        scheme="linear-statics",
    )
    return float(execute(scene).column("r")[-1])


def test_fibres_around_a_tube() -> None:
    """`p r^2 / (E1 h)`; along the tube they would give a hundred times as much."""
    exact = 100.0 / (1e8 * 0.01)
    # between its nodes the mesh is off the circle, and fibres with it: 0.1 % with 24 elements
    assert pressurised() == pytest.approx(exact, rel=2e-3)


def test_a_surface_turned_over_has_its_normal_inside() -> None:
    assert pressurised(flip=True) == pytest.approx(-pressurised(), rel=1e-6)


def test_a_direction_across_the_surface_is_refused() -> None:
    with pytest.raises(SceneError, match="direction is normal to the surface to 0 degrees at"):
        pressurised(direction=lambda x: np.stack([x[0], x[1], 0 * x[2]]))
    # 3 degrees off the normal, where y is largest
    with pytest.raises(
        SceneError, match=r"direction \(0.0, 1.0, 0.0524\) is normal .* to 3 degrees"
    ):
        pressurised(direction=(0.0, 1.0, 0.0524))


def test_a_cap_of_fibres_needs_a_direction() -> None:
    """Every axis is normal to a whole sphere somewhere; what is isotropic does without."""
    fibre = PlyMaterial(E1=1e8, E2=1e6, nu12=0.3, G12=1e6, G13=1e6, G23=1e6)
    sphere = Sphere(1.0, (0.0, 90.0), (0.0, 90.0))

    def model(section: Any) -> Any:
        shell = Shell("cap", sphere, section, mesh=(4, 4))
        return Model(Scene("cap", shell, supports=Clamped("left")), MPI.COMM_WORLD)

    with pytest.raises(SceneError, match=r"direction is None, and .*, the axis that"):
        model(Laminate((Ply(fibre, 0.01),)))
    model(Isotropic(E, 0.3, thickness=H))


def test_a_diaphragm_of_any_axis_holds_its_plane() -> None:
    """A quarter tube with diaphragms, turned in space: the same displacement along the load."""

    def sag(axis: tuple[float, float, float], start: tuple[float, float, float]) -> float:
        a, s = np.array(axis), np.array(start)
        tube = Cylinder(1.0, 2.0, angles=(0.0, 90.0), axis=axis, start=start)
        c = np.cross(a, s)
        place = 2.0 * a + np.sqrt(0.5) * (s + c)
        scene = Scene(
            "quarter",
            Shell("tube", tube, Isotropic(1e7, 0.3, thickness=0.01), mesh=(4, 4)),
            supports=[
                Diaphragm("bottom", axis),
                SymmetryPlane("left", tuple(c)),
                SymmetryPlane("right", tuple(s)),
                SymmetryPlane("top", axis),
            ],
            loads=Pressure(lambda x: 1.0 + 0 * x[0]),
            probes=[Probe(n, tuple(place), component=k) for k, n in enumerate("xyz")],
            scheme="linear-statics",
        )
        last = execute(scene).rows[-1]
        return float(np.dot([last[n] for n in "xyz"], (s + c) / np.sqrt(2)))

    straight = sag((0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
    r = np.sqrt(0.5)
    assert straight > 0
    assert sag((r, 0.0, r), (r, 0.0, -r)) == pytest.approx(straight, rel=1e-9)


def test_functions_need_to_hold_on_the_surface_only() -> None:
    """One that has no value at the origin, on a tube about it."""
    assert pressurised(direction=lambda x: hoop(x) / np.hypot(x[0], x[1])) == pytest.approx(
        pressurised(), rel=1e-12
    )


def test_functions_on_meshes_of_files_are_looked_at_where_their_nodes_are(tmp_path: Any) -> None:
    """What the surface does not tell before it is meshed is told in the same sentence."""
    import meshio

    file = tmp_path / "square.vtk"
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float)
    meshio.Mesh(points, [("quad", np.array([[0, 1, 2, 3]]))]).write(file)
    root = {"root": lambda x: np.isclose(x[0], 0.0)}
    scene = Scene(
        "square",
        Shell("square", MeshFile(file, edges_where=root), Isotropic(E, 0.0, thickness=H)),
        supports=Clamped("root"),
        loads=Pressure(lambda x: x),
        scheme="linear-statics",
    )
    with pytest.raises(SceneError, match=r"pressure: p gives an array of shape \(3, "):
        execute(scene)
