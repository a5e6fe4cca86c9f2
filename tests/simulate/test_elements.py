"""Elements and meshes that the other tests do not use: cubic quadrilaterals, gmsh's meshes."""

import pytest

from shellmb.demos.references.beams import cantilever_end_force
from shellmb.scene import (
    Clamped,
    EdgeForce,
    GmshModel,
    Isotropic,
    Join,
    Rectangle,
    Scene,
    Shell,
)

E, H, LENGTH, WIDTH = 70e9, 0.01, 1.0, 0.25
SECTION = Isotropic(E=E, nu=0.0, thickness=H)
INERTIA = WIDTH * H**3 / 12


def test_cubic_quadrilaterals(run, at) -> None:
    """A strip under an end force, bent by a cubic polynomial: the elements have it exactly."""
    strip = Shell("strip", Rectangle(LENGTH, WIDTH), SECTION, mesh=(2, 1), degree=3)
    load = EdgeForce("right", (0, 0, 1.0 / WIDTH))
    scene = Scene("strip", strip, supports=Clamped("left"), loads=load, scheme="linear-statics")
    tip = at(run(scene), "strip", (LENGTH, 0.0, 0.0))[2]
    shear_area = 5 / 6 * WIDTH * H
    exact = cantilever_end_force(1.0, E * INERTIA, LENGTH, E / 2 * shear_area)
    assert tip == pytest.approx(exact, rel=1e-9)


def angle(gmsh, mesh) -> None:  # type: ignore[no-untyped-def]
    """A floor in the x-y plane and a wall on its far edge, in one mesh of quadrilaterals."""
    geo, size = gmsh.model.geo, WIDTH / mesh[1]
    corners = (
        (0, 0, 0), (LENGTH, 0, 0), (LENGTH, WIDTH, 0), (0, WIDTH, 0),
        (LENGTH, 0, LENGTH), (LENGTH, WIDTH, LENGTH),
    )  # fmt: skip
    p = [geo.addPoint(*corner, size) for corner in corners]
    ends = ((0, 1), (1, 2), (2, 3), (3, 0), (1, 4), (4, 5), (5, 2))
    line = [geo.addLine(p[a], p[b]) for a, b in ends]
    floor = geo.addPlaneSurface([geo.addCurveLoop(line[:4])])
    wall = geo.addPlaneSurface([geo.addCurveLoop([line[4], line[5], line[6], -line[1]])])
    geo.synchronize()
    gmsh.option.setNumber("Mesh.RecombineAll", 1)
    groups = (("floor", 2, floor), ("wall", 2, wall), ("fold", 1, line[1]))
    for name, dim, entity in (*groups, ("base", 1, line[3]), ("top", 1, line[5])):
        gmsh.model.addPhysicalGroup(dim, [entity], name=name)


def test_kink_in_a_gmsh_model_by_group_names(run, at) -> None:
    """An angle of two physical groups, clamped at its base: tip of the wall as by beam theory."""
    floor, wall = (
        Shell(name, GmshModel(angle, group=name), SECTION, mesh=(4, 2))
        for name in ("floor", "wall")
    )
    scene = Scene(
        "angle",
        (floor, wall),
        supports=Clamped("base", body="floor"),
        joins=Join("floor", "wall", "fold", "fold"),
        loads=EdgeForce("top", (1.0 / WIDTH, 0, 0), body="wall"),
        scheme="linear-statics",
    )
    tip = at(run(scene), "wall", (LENGTH, 0.0, LENGTH))[0]
    # bending of the wall, and its rotation by the floor's end moment
    bending = E * INERTIA
    exact = LENGTH**3 / 3 / bending + LENGTH * LENGTH * LENGTH / bending
    assert tip == pytest.approx(exact, rel=0.01)
