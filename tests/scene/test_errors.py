"""Every impossible description gives its own sentence, when it is made."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from shellmb.errors import SceneError
from shellmb.scene import (
    Clamped,
    Cylinder,
    Disc,
    Driven,
    EdgeForce,
    Fixed,
    GmshFile,
    GmshModel,
    Gravity,
    Isotropic,
    Join,
    Laminate,
    Orthotropic,
    Parametric,
    Ply,
    PlyMaterial,
    PointForce,
    Pressure,
    Probe,
    Ramp,
    Rectangle,
    Scene,
    Shell,
    Sine,
    Solver,
    Sphere,
    StepControl,
    SurfaceForce,
    SymmetryPlane,
    Table,
)
from tests.sentences import other_sentences

NAN = float("nan")
RANDOM = np.random.default_rng(0)
STEEL = Isotropic(E=2e11, nu=0.3, thickness=0.01, density=7800)
PLATE = Shell("plate", Rectangle(2, 1), STEEL)
ROOF = Shell("roof", Cylinder(1, 1, (0, 90)), STEEL)
CARBON = PlyMaterial(E1=138e9, E2=9e9, nu12=0.3, G12=7e9, G13=7e9, G23=3e9)
HELD = (Clamped("left"),)


class NotAScheme:
    pass


def made_of(*shells, **kwargs):
    return Scene("s", shells, **kwargs)


BAD = {
    "isotropic section: thickness is -0.1; it must be greater than 0": lambda: Isotropic(
        1, 0.3, thickness=-0.1
    ),
    "isotropic section: nu is 0.5; it must be less than 0.5": lambda: Isotropic(
        1, 0.5, thickness=0.1
    ),
    "isotropic section: nu is -1; it must be greater than -1": lambda: Isotropic(
        1, -1, thickness=0.1
    ),
    "isotropic section: E is 0; it must be greater than 0": lambda: Isotropic(
        0, 0.3, thickness=0.1
    ),
    "isotropic section: E is 'steel'; it must be a number": lambda: Isotropic(
        "steel", 0.3, thickness=0.1
    ),
    "isotropic section: density is -1; it must be at least 0": lambda: Isotropic(
        1, 0.3, thickness=0.1, density=-1
    ),
    "isotropic section: offset is inf; it must be a finite number": lambda: Isotropic(
        1, 0.3, thickness=0.1, offset=float("inf")
    ),
    "orthotropic section: nu12 is 2.1; its magnitude must be less than sqrt(E1/E2) = 2": lambda: (
        Orthotropic(4, 1, nu12=2.1, G12=1, G13=1, G23=1, thickness=0.1)
    ),
    "laminate: it has no plies; it must have one at least": lambda: Laminate(()),
    "laminate: plies[1] is 3; it must be a ply": lambda: Laminate((Ply(CARBON, 0.1), 3)),
    "laminate: shear_correction is 'guess'; it must be a factor greater than 0 or "
    "'energy'": lambda: Laminate((Ply(CARBON, 0.1),), shear_correction="guess"),
    "laminate: stacking is '[0/90'; it must read like '[0/90/45]s' or '[45/-45]4'": lambda: (
        Laminate.from_stacking(CARBON, 0.1, "[0/90")
    ),
    "rectangle: axis1 is (0.0, 0.0, 0.0); it must have a length greater than 0": lambda: Rectangle(
        1, 1, axis1=(0, 0, 0)
    ),
    "rectangle: axis1 (1.0, 1.0, 0.0) and axis2 (0.0, 1.0, 0.0) are not perpendicular; they must "
    "be": lambda: Rectangle(1, 1, axis1=(1, 1, 0)),
    "cylinder: angles is (0, 400); the second angle must exceed the first, by 360 degrees at "
    "most": lambda: Cylinder(1, 1, (0, 400)),
    "sphere: polar is (10.0, 180.0) and azimuth (0.0, 360.0); polar must begin at 0 or more and "
    "end below 180 degrees, or be (0, 180) with the full azimuth": lambda: Sphere(1, (10, 180)),
    "disc: radius is nan; it must be a finite number": lambda: Disc(NAN),
    "gmsh file: path is 'nowhere.msh'; there is no such file": lambda: GmshFile("nowhere.msh"),
    "gmsh model: build is 3; it must be a function": lambda: GmshModel(3),
    "shell 'a': mesh[0] is 0; it must be greater than 0": lambda: Shell(
        "a", Rectangle(1, 1), STEEL, mesh=(0, 8)
    ),
    "shell 'a': mesh[1] is 2.5; it must be a whole number": lambda: Shell(
        "a", Rectangle(1, 1), STEEL, mesh=(1, 2.5)
    ),
    "shell 'a': mesh is (2, 2); it must have at least 3 elements around a closed surface": lambda: (
        Shell("a", Cylinder(1, 1), STEEL, mesh=(2, 2))
    ),
    "shell 'a': degree is 4; it must be 2 or 3": lambda: Shell(
        "a", Rectangle(1, 1), STEEL, degree=4
    ),
    "shell 'a': degree is 3; it must be 2 on triangles": lambda: Shell(
        "a", Rectangle(1, 1), STEEL, degree=3, cell="tri"
    ),
    "shell 'a': cell is 'hex'; it must be 'quad' or 'tri'": lambda: Shell(
        "a", Rectangle(1, 1), STEEL, cell="hex"
    ),
    "shell 'a': distortion is 0.4; it must be at most 0.3": lambda: Shell(
        "a", Rectangle(1, 1), STEEL, distortion=0.4
    ),
    "shell 'a': distortion is 0.1; it must be 0 where the mesh is read, or made by gmsh": lambda: (
        Shell("a", GmshModel(print), STEEL, distortion=0.1)
    ),
    "shell 'a': direction is (0.0, 0.0, 0.0); it must have a length greater than 0": lambda: Shell(
        "a", Rectangle(1, 1), STEEL, direction=(0, 0, 0)
    ),
    "shell 'a': surface is 'flat'; it must be a surface": lambda: Shell("a", "flat", STEEL),
    "shell 'a': section is missing; its parameters are name, surface, section, mesh, degree, cell, "
    "geometry_order, distortion, direction, rotary_inertia, eccentric_inertia, transverse_shear, "
    "stretching, coupling, strains, terms, model, areas, natural": lambda: Shell(
        "a", Rectangle(1, 1)
    ),
    "shell: name is ''; it must not be empty": lambda: Shell("", Rectangle(1, 1), STEEL),
    "join: first and second are both 'a'; they must be two shells": lambda: Join(
        "a", "a", "left", "right"
    ),
    "surface force: force is (0, 0, nan); every component must be finite": lambda: SurfaceForce(
        (0, 0, NAN)
    ),
    "edge force: force is (1, 2); it must be a vector of three numbers": lambda: EdgeForce(
        "left", (1, 2)
    ),
    "edge force: at is 3; it must be the name of an edge or a tuple of such names": lambda: (
        EdgeForce(3, (1, 2, 3))
    ),
    "point force: at is (0, 0); it must be the name of a point, finite coordinates (x, y, z), "
    "or an Offset": lambda: PointForce((0, 0), (0, 0, 1)),
    "pressure: p is inf; it must be a finite number": lambda: Pressure(float("inf")),
    "pressure: there is no parameter value; its parameters are p, body, time": lambda: Pressure(
        1.0, value=3
    ),
    "fixed components: nothing is fixed at 'left'; give at least one component of displacement or "
    "director": lambda: Fixed("left"),
    "fixed components: displacement has the wrong number of entries": lambda: Fixed("left", (0, 0)),
    "fixed components: displacement[0] is nan; it must be a finite number": lambda: Fixed(
        "left", (NAN, 0, 0)
    ),
    "symmetry plane: normal is (0, 0, 0); it must not be zero": lambda: SymmetryPlane(
        "left", (0, 0, 0)
    ),
    "driven edge: neither rotation nor translation is given for 'left'; give one at least, or use "
    "Clamped": lambda: Driven("left"),
    "probe 'tip': component is 4; it must be 0, 1, 2 or 'norm'": lambda: Probe(
        "tip", (0, 0, 0), component=4
    ),
    "ramp: duration is 0; it must be greater than 0": lambda: Ramp(0),
    "sine: frequency is -1; it must be greater than 0": lambda: Sine(-1),
    "time table: it has 2 times and 1 values; it must have as many of each, and one at "
    "least": lambda: Table((0, 1), (1,)),
    "time table: time 1 follows 1; times must increase": lambda: Table((1, 1), (1, 2)),
    "step control: min_dt is 2.0; it must be at most max_dt, which is 1.0": lambda: StepControl(
        2, 1
    ),
    "solver: backend is 'picard'; it must be 'newton' or 'snes'": lambda: Solver(backend="picard"),
    "scene 's': it has no bodies; it must have a shell, a beam or a rigid body": lambda: made_of(),
    "scene 's': 2 shells are named 'plate'; each must have a name of its own": lambda: made_of(
        PLATE, PLATE
    ),
    "scene 's': 2 probes are named 'p'; each must have a name of its own": lambda: made_of(
        PLATE, supports=HELD, probes=[Probe("p", "left-top"), Probe("p", "right-top")]
    ),
    "scene 's': scheme is 'newmark'; it must be one of 'static', 'linear-statics', "
    "'linear-dynamics', 'ep', 'ed', 'ep4', 'ed3', 'generalized-alpha', 'ed-printed', or a "
    "scheme object": lambda: made_of(PLATE, scheme="newmark", dt=1, t_end=1),
    "scene 's': scheme is NotAScheme; it must be one of 'static', 'linear-statics', "
    "'linear-dynamics', 'ep', 'ed', 'ep4', 'ed3', 'generalized-alpha', 'ed-printed', or a "
    "scheme object with a name": lambda: made_of(PLATE, scheme=NotAScheme, dt=1, t_end=1),
    "scene 's': alpha is 1.5; it must be at most 1": lambda: made_of(PLATE, alpha=1.5),
    "scene 's': dt is 0; it must be greater than 0": lambda: made_of(
        PLATE, scheme="ep", dt=0, t_end=1
    ),
    "scene 's': dt is nan; it must be a finite number": lambda: made_of(
        PLATE, scheme="ep", dt=NAN, t_end=1
    ),
    "scene 's': dt is inf; it must be a finite number": lambda: made_of(
        PLATE, scheme="ep", dt=float("inf"), t_end=1
    ),
    "scene 's': dt is missing; scheme 'ep' needs it": lambda: made_of(PLATE, scheme="ep", t_end=1),
    "scene 's': t_end is missing; scheme 'ed' needs it": lambda: made_of(PLATE, scheme="ed", dt=1),
    "scene 's': t_end is -1; it must be greater than 0": lambda: made_of(
        PLATE, supports=HELD, t_end=-1
    ),
    "scene 's': jump_tolerance is 0.1; it must be left out, because scheme 'ep' has no jump as "
    "'ed' has": lambda: made_of(
        PLATE, scheme="ep", dt=1, t_end=1, step_control=StepControl(jump_tolerance=0.1)
    ),
    "scene 's': supports[0] is 1; it must be a support": lambda: made_of(PLATE, supports=[1]),
    "clamped edge: shell 'plate' has no edge 'north'; its edges are 'left', 'right', 'bottom', "
    "'top'": lambda: made_of(PLATE, supports=Clamped("north")),
    "clamped edge: there is no shell 'wall'; the scene has 'plate'": lambda: made_of(
        PLATE, supports=Clamped("left", body="wall")
    ),
    "pressure: body is missing; it must be one of 'plate', 'roof'": lambda: made_of(
        PLATE, ROOF, loads=Pressure(1.0)
    ),
    "fixed components: shell 'plate' has no edge or point 'tip'; its edges are 'left', 'right', "
    "'bottom', 'top', its points 'left-bottom', 'right-bottom', 'left-top', 'right-top', or give "
    "coordinates": lambda: made_of(PLATE, supports=Fixed("tip", (0, 0, 0))),
    "probe 'p': shell 'plate' has no point 'tip'; its points are 'left-bottom', 'right-bottom', "
    "'left-top', 'right-top', or give coordinates": lambda: made_of(
        PLATE, supports=HELD, probes=Probe("p", "tip")
    ),
    "probe 'p': at is ('left-top', 'right-top'); it must be the name of a point, finite "
    "coordinates (x, y, z), or an Offset": lambda: Probe("p", ("left-top", "right-top")),
    "join: shell 'roof' has no edge 'x'; its edges are 'left', 'right', 'bottom', 'top'": lambda: (
        made_of(PLATE, ROOF, joins=Join("plate", "roof", "left", "x"))
    ),
    "shell 'roof': nothing supports it, so it can move rigidly; a static scene must support every "
    "shell or join it to one that is supported": lambda: made_of(
        PLATE, ROOF, supports=Clamped("left", body="plate")
    ),
    "shell 'plate': its mass per area is 0; it must be greater than 0 with scheme 'ep', so give "
    "its section a density": lambda: made_of(
        Shell("plate", Rectangle(1, 1), Isotropic(1, 0.3, thickness=0.1)),
        scheme="ep",
        dt=1,
        t_end=1,
    ),
    "gravity: time gives nan at t = 0; it must give a finite number": lambda: made_of(
        PLATE, supports=HELD, loads=Gravity(time=lambda t: NAN)
    ),
    "driven edge: translation gives 1.0 at t = 0; it must give 3 finite numbers": lambda: made_of(
        PLATE, supports=Driven("left", translation=lambda t: 1.0)
    ),
    "surface force: force gives an array of shape (7,) for positions of shape (3, 7); it must give "
    "the same shape": lambda: made_of(PLATE, supports=HELD, loads=SurfaceForce(lambda x: x[0])),
    "surface force: force gives other values when it is called again; it must depend on positions "
    "only: make random numbers once, outside of it and with a seed": lambda: made_of(
        PLATE, supports=HELD, loads=SurfaceForce(lambda x: RANDOM.random(x.shape))
    ),
    "surface force: force gives a number that is not finite": lambda: made_of(
        PLATE, supports=HELD, loads=SurfaceForce(lambda x: NAN * x)
    ),
}


def test_messages():
    assert not other_sentences(BAD)


def test_a_map_has_to_give_positions():
    square = np.linspace(0, 1, 4)
    with pytest.raises(
        SceneError, match=r"array of shape \(4,\) for 4 points; it must be \(3, 4\)"
    ):
        Parametric(lambda xi, eta: xi).position(square, square)
    with pytest.raises(SceneError, match="not finite"):
        Parametric(lambda xi, eta: NAN * np.stack([xi] * 3)).position(square, square)


def test_replacing_a_part_checks_again():
    scene = made_of(PLATE, supports=HELD)
    with pytest.raises(SceneError, match="dt is -1"):
        dataclasses.replace(scene, dt=-1)
    with pytest.raises(SceneError, match="degree is 3; it must be 2 on triangles"):
        scene.with_options(cell="tri", degree=3)
    with pytest.raises(dataclasses.FrozenInstanceError):
        scene.dt = 3.0


def test_mesh_of_a_file_cannot_be_chosen(tmp_path: Path):
    file = tmp_path / "wing.msh"
    file.write_text("$MeshFormat")
    scene = made_of(Shell("wing", GmshFile(file), STEEL), supports=Clamped("root"))
    with pytest.raises(SceneError, match="mesh is \\(3, 3\\); it must be left out"):
        scene.with_options(mesh=(3, 3))
