"""Meshes from files of other programs, and edges by where they lie."""

import sys
from pathlib import Path
from typing import Any

from mpi4py import MPI

import meshio
import numpy as np
import pytest

from shellmb.errors import SceneError
from shellmb.meshes.mesh import SurfaceMesh, build_surface
from shellmb.running.execute import execute
from shellmb.scene import (
    Clamped,
    EdgeForce,
    GmshFile,
    Isotropic,
    MeshFile,
    Probe,
    Rectangle,
    Scene,
    Shell,
)

LENGTH, WIDTH = 2.0, 1.0
SECTION = Isotropic(E=1e7, nu=0.3, thickness=0.05)
ENDS = {
    "root": lambda x: np.isclose(x[0], 0.0),
    "tip": lambda x: np.isclose(x[0], LENGTH),
}


def build_mesh(shell: Shell) -> SurfaceMesh:
    return build_surface(shell, MPI.COMM_SELF)


def deflection(surface: Any, cell: Any = "quad", names: tuple[str, str] = ("root", "tip")) -> float:
    scene = Scene(
        "strip",
        Shell("strip", surface, SECTION, cell=cell, mesh=(4, 2)),
        supports=Clamped(names[0]),
        loads=EdgeForce(names[1], (0, 0, 1.0)),
        probes=Probe("tip", (LENGTH, WIDTH, 0.0)),
        scheme="linear-statics",
    )
    return float(execute(scene).column("tip")[-1])


def grid() -> tuple[np.ndarray, np.ndarray]:
    x, y = np.meshgrid(np.linspace(0, LENGTH, 5), np.linspace(0, WIDTH, 3), indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], 1)
    quads = [
        [3 * i + j, 3 * i + j + 3, 3 * i + j + 4, 3 * i + j + 1] for i in range(4) for j in (0, 1)
    ]
    return points, np.array(quads)


@pytest.mark.parametrize("ending", ["inp", "bdf", "vtk", "msh"])
def test_quadrilaterals_of_any_format_are_the_same_strip(tmp_path: Path, ending: str) -> None:
    points, quads = grid()
    file = tmp_path / f"strip.{ending}"
    # in millimetres
    meshio.Mesh(1e3 * points, [("quad", quads)]).write(file)
    same = deflection(Rectangle(LENGTH, WIDTH), names=("left", "right"))
    found = deflection(MeshFile(file, edges_where=ENDS, scale=1e-3))
    # positions are written with seven digits at least
    assert found == pytest.approx(same, rel=1e-5)


def test_stl_writes_every_point_several_times(tmp_path: Path) -> None:
    points, quads = grid()
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    file = tmp_path / "strip.stl"
    meshio.Mesh(points, [("triangle", triangles)]).write(file)
    same = deflection(Rectangle(LENGTH, WIDTH), "tri", names=("left", "right"))
    found = deflection(MeshFile(file, edges_where=ENDS), "tri")
    # the diagonals run as they may, and triangles are soft: 5 % on this mesh
    assert found == pytest.approx(same, rel=5e-2)


def test_a_bare_step_file_gets_its_edges_from_the_scene(tmp_path: Path) -> None:
    import gmsh

    file = tmp_path / "strip.step"
    gmsh.initialize(["test", "-v", "0"], False, False, False)
    try:
        gmsh.model.occ.addRectangle(0, 0, 0, LENGTH, WIDTH)
        gmsh.model.occ.synchronize()
        gmsh.write(str(file))
    finally:
        gmsh.finalize()
    surface = GmshFile(file, edges_where=ENDS)
    raw = build_mesh(Shell("strip", surface, SECTION, mesh=(4, 2)))
    size = np.ptp(raw.mesh.geometry.x, axis=0)
    assert size == pytest.approx((LENGTH, WIDTH, 0.0))
    same = deflection(Rectangle(LENGTH, WIDTH), names=("left", "right"))
    # another mesh of as many elements
    assert deflection(surface) == pytest.approx(same, rel=1e-2)


@pytest.mark.parametrize(
    ("where", "said"),
    [
        ({"root": lambda x: x[0] < -1}, r"edges_where\['root'\] is true on no edge .* 0 to 2"),
        ({"root": lambda x: x[7]}, r"edges_where\['root'\] fails .*must give \(n,\) truth values"),
    ],
)
def test_edges_that_are_nowhere(tmp_path: Path, where: Any, said: str) -> None:
    points, quads = grid()
    file = tmp_path / "strip.vtk"
    meshio.Mesh(points, [("quad", quads)]).write(file)
    with pytest.raises(SceneError, match=said):
        build_mesh(Shell("strip", MeshFile(file, edges_where=where), SECTION))


def test_files_that_are_no_surfaces(tmp_path: Path) -> None:
    points, quads = grid()
    lines, unknown = tmp_path / "lines.vtk", tmp_path / "strip.nothing"
    meshio.Mesh(points, [("line", quads[:, :2])]).write(lines)
    unknown.write_text("nothing")
    for surface, said in (
        (
            MeshFile(lines),
            "the mesh has cells 'line'; the cells of a shell must be triangles with 3 or 6",
        ),
        (MeshFile(unknown), "is not read .*it must be a mesh in a format of meshio"),
    ):
        with pytest.raises(SceneError, match=said):
            build_mesh(Shell("strip", surface, SECTION))
    quad = tmp_path / "quad.vtk"
    meshio.Mesh(points, [("quad", quads)]).write(quad)
    with pytest.raises(SceneError, match="cell must be 'quad', not 'tri'"):
        build_mesh(Shell("strip", MeshFile(quad), SECTION, cell="tri"))
    with pytest.raises(SceneError, match="has no set of cells 'skin'"):
        build_mesh(Shell("strip", MeshFile(quad, group="skin"), SECTION))


def test_cells_that_are_left_out_are_those_of_the_file(tmp_path: Path) -> None:
    """Triangles as quadrilaterals; a degree that triangles do not have is refused when they are."""
    points, quads = grid()
    halves = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    for name, cells in (("quadrilateral", [("quad", quads)]), ("triangle", [("triangle", halves)])):
        file = tmp_path / f"{name}.vtk"
        meshio.Mesh(points, cells).write(file)
        assert build_mesh(Shell("strip", MeshFile(file), SECTION)).mesh.topology.cell_name() == name
    with pytest.raises(SceneError, match="shell 'strip': degree is 3; it must be 2 on triangles"):
        build_mesh(Shell("strip", MeshFile(file), SECTION, degree=3))
    with pytest.raises(SceneError, match="cell must be 'tri', not 'quad'"):
        build_mesh(Shell("strip", MeshFile(file), SECTION, cell="quad"))


@pytest.mark.parametrize("ending", [".xdmf", ".h5m"])
def test_a_package_that_is_missing_is_named(ending: str, tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setitem(sys.modules, "h5py", None)
    file = tmp_path / f"strip{ending}"
    nodes = '<DataItem DataType="Float" Dimensions="3 3" Format="HDF">a.h5:/x</DataItem>'
    grid = f'<Grid><Geometry GeometryType="XYZ">{nodes}</Geometry></Grid>'
    file.write_text(f'<Xdmf Version="3.0"><Domain>{grid}</Domain></Xdmf>')
    with pytest.raises(SceneError, match=f"strip{ending} is not read, .* needs the package h5py"):
        build_mesh(Shell("strip", MeshFile(file), SECTION))
