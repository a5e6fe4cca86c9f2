"""Folds and corners within one mesh: right up to where one director can serve both sides."""

from pathlib import Path
from typing import Any

from mpi4py import MPI

import meshio
import numpy as np
import pytest

from shellmb.errors import ConvergenceError, SceneError, petsc_in_words
from shellmb.meshes.directors import reference_director
from shellmb.meshes.mesh import build_surface
from shellmb.meshes.spaces import shell_space
from shellmb.running.execute import execute
from shellmb.scene import (
    Clamped,
    EdgeForce,
    Gravity,
    Isotropic,
    Join,
    Laminate,
    MeshFile,
    Ply,
    PlyMaterial,
    Probe,
    Scene,
    Shell,
)

CORNERS = ((0, 0), (1, 0), (1, 1), (0, 1))


def write(file: Path, faces: Any, n: int, cell: str, turn: bool = False, size: float = 1.0) -> None:
    """Faces as pairs of axes from an origin, cut into cells that share their nodes."""
    number: dict[tuple[float, ...], int] = {}
    cells = []
    for origin, first, second in faces:
        for i in range(n):
            for j in range(n):
                at = [
                    np.asarray(origin) + (i + a) / n * np.asarray(first) + (j + b) / n * second
                    for a, b in CORNERS
                ]
                row = [number.setdefault(tuple((p + 0.0).round(12)), len(number)) for p in at]
                if cell == "quad":
                    cells.append(row)
                elif turn and (i + j) % 2:
                    cells += [[row[0], row[1], row[3]], [row[1], row[2], row[3]]]
                else:
                    cells += [[row[0], row[1], row[2]], [row[0], row[2], row[3]]]
    kind = "quad" if cell == "quad" else "triangle"
    meshio.write_points_cells(file, size * np.array(list(number)), [(kind, np.array(cells))])


def folded(degrees: float, axis: int = 1) -> list[Any]:
    """Two squares that meet in a line, the second turned by an angle."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    roll = [np.roll(v, axis - 1) for v in ((1, 0, 0), (0, 1, 0), (c, 0, s))]
    return [((0, 0, 0), roll[0], roll[1]), (roll[0], roll[2], roll[1])]


def director(file: Path, cell: Any, **options: Any) -> Any:
    shell = Shell("part", MeshFile(file, **options), Isotropic(1.0, 0.3, thickness=0.01), cell=cell)
    surface = build_surface(shell, MPI.COMM_SELF)
    nodal = shell_space(surface.mesh, 2, False).subspaces["u"]
    return nodal, reference_director(surface, nodal).x.array.reshape(-1, 3)


def test_a_bracket_bends_as_its_two_parts_do(tmp_path: Path) -> None:
    E, h, F = 210e3, 0.05, 0.01
    file = tmp_path / "bracket.vtk"
    for degrees in (60, 94):
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        write(file, folded(degrees), 4, "quad")
        ends = {
            "root": lambda x: np.hypot(x[0], x[2]) < 1e-6,
            "tip": lambda x, c=c, s=s: np.hypot(x[0] - 1 - c, x[2] - s) < 1e-6,
        }
        scene = Scene(
            "bracket",
            Shell("bracket", MeshFile(file, edges_where=ends), Isotropic(E, 0.0, thickness=h)),
            supports=Clamped("root"),
            loads=EdgeForce("tip", (0, 0, -F)),
            probes=Probe("w", (1 + c, 0.5, s), component=2),
            scheme="linear-statics",
        )
        bent = -F / (3 * E * h**3 / 12) * (c**2 + (1 + c) ** 3 - c**3)
        # shear and stretching add 0.5 %, the fold as much on this mesh
        assert execute(scene).column("w")[-1] == pytest.approx(bent, rel=1.2e-2)


def test_a_sharp_fold_in_one_file_is_two_joined_shells(tmp_path: Path) -> None:
    """The way that the refusal of the fold names, for files without groups."""
    E, h, F, degrees = 210e3, 0.05, 0.01, 150
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    file = tmp_path / "bracket.vtk"
    write(file, folded(degrees), 4, "quad")
    fold = {"fold": lambda x: np.hypot(x[0] - 1, x[2]) < 1e-6}
    root = fold | {"root": lambda x: np.hypot(x[0], x[2]) < 1e-6}
    tip = fold | {"tip": lambda x: np.hypot(x[0] - 1 - c, x[2] - s) < 1e-6}
    plate = Isotropic(E, 0.0, thickness=h)
    floor = MeshFile(file, where=lambda x: x[2] < 1e-3, edges_where=root)
    wall = MeshFile(file, where=lambda x: x[2] > 1e-3, edges_where=tip)
    scene = Scene(
        "bracket",
        (Shell("floor", floor, plate), Shell("wall", wall, plate)),
        joins=Join("floor", "wall", "fold", "fold"),
        supports=Clamped("root", body="floor"),
        loads=EdgeForce("tip", (0, 0, -F), body="wall"),
        probes=Probe("w", (1 + c, 0.5, s), component=2, body="wall"),
        scheme="linear-statics",
    )
    bent = -F / (3 * E * h**3 / 12) * (c**2 + (1 + c) ** 3 - c**3)
    # shear and stretching add 0.5 %
    assert execute(scene).column("w")[-1] == pytest.approx(bent, rel=1.2e-2)
    with pytest.raises(SceneError, match="where is true on no element of the mesh, whose middles"):
        director(file, "quad", where=lambda x: x[2] > 9)


@pytest.mark.parametrize("cell", ["quad", "tri"])
@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("size", [1e-3, 1e3])
def test_folds_beyond_a_right_angle_are_refused_where_they_are(
    tmp_path: Path, cell: str, axis: int, size: float
) -> None:
    file = tmp_path / "bracket.vtk"
    write(file, folded(90, axis), 3, cell, True, size)
    director(file, cell)
    for degrees in (110, 150):
        write(file, folded(degrees, axis), 3, cell, True, size)
        with pytest.raises(
            SceneError, match="make the parts shells, by group or where, and join them"
        ) as error:
            director(file, cell)
        line = np.roll((1, 0, 0), axis - 1), np.roll((1, 1, 0), axis - 1)
        for place in line:
            assert f"({', '.join(f'{size * v:.4g}' for v in place)})" in str(error.value)
        assert f"lean by up to {degrees / 2:.0f} degrees" in str(error.value)


@pytest.mark.parametrize("cell", ["quad", "tri"])
def test_a_director_does_not_depend_on_how_faces_are_cut(tmp_path: Path, cell: str) -> None:
    x, y, z = np.eye(3)
    file = tmp_path / "corner.vtk"
    write(file, [(0 * x, y, x), (0 * x, z, y), (0 * x, x, z)], 2, cell)
    nodal, found = director(file, cell)
    at = nodal.tabulate_dof_coordinates()
    (corner,) = np.flatnonzero(np.abs(at).max(axis=1) < 1e-9)
    assert np.abs(found[corner]) == pytest.approx(3**-0.5, abs=1e-12)
    # two faces at a node of a fold, of which one has two triangles and the other one or three
    on = np.flatnonzero((np.abs(at - 0.5 * x) < 1e-9).all(axis=1))
    assert np.abs(found[on]) == pytest.approx(np.array([[0, 0.5**0.5, 0.5**0.5]]), abs=1e-12)


@pytest.mark.parametrize("turned", [False, True])
def test_faces_along_all_axes_need_no_direction(tmp_path: Path, turned: bool) -> None:
    """Isotropic sections do without; others ask for one by name."""
    axes = np.eye(3)
    if turned:
        # one face is normal to the first vector that would be guessed
        axes = np.linalg.qr(np.array([[1.0, 2, 3], [0, 1, -1], [3, 0, 1]]).T)[0].T
    x, y, z = axes
    file = tmp_path / "corner.vtk"
    write(file, [(0 * x, x, y), (0 * x, y, z), (0 * x, z, x)], 1, "quad")
    edges = {"top": lambda p: z @ p > 1 - 1e-9}
    isotropic = Isotropic(E=70e9, nu=0.3, thickness=0.05, density=2700.0)

    def sinks(direction: Any, section: Any = isotropic, scheme: str = "linear-statics") -> float:
        surface = MeshFile(file, edges_where=edges)
        box = Shell("box", surface, section, direction=direction)
        scene = Scene("box", box, supports=Clamped("top"), loads=Gravity(), scheme=scheme, dt=1.0)
        result = execute(scene)
        return float(np.abs(result.simulation.arrays()["box/q"]).max())

    given = tuple(x + 2 * y + 3 * z)
    # nothing but round-off of thin plates between them
    assert sinks(None) == pytest.approx(sinks(given), rel=1e-6)
    fibre = PlyMaterial(E1=140e9, E2=10e9, nu12=0.3, G12=5e9, G13=5e9, G23=3e9, density=1600.0)
    carbon = Laminate((Ply(fibre, 0.05),))
    if not turned:
        with pytest.raises(SceneError, match=r"direction is None, and [xyz], the axis .* normal"):
            sinks(None, carbon)


def test_what_petsc_says_is_the_end_of_a_sentence() -> None:
    from petsc4py import PETSc

    for error in (PETSc.Error(76), RuntimeError("Failed to call PETSc function 'KSPSolve'")):
        with pytest.raises(ConvergenceError, match=r"could not be solved.*PETSc: "):
            with petsc_in_words():
                raise error
    with pytest.raises(RuntimeError, match="another"), petsc_in_words():
        raise RuntimeError("another")
